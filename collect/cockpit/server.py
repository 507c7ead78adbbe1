"""The web server of the cockpit, a process of its own: settings come in by stdin, all else by a pipe.

Its one socket to pages is `/drive`; everything else is files.
"""

import asyncio
import contextlib
import gc
import itertools
import json
import os
import shutil
import socket
import sys
import time
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from handrail.collect.cockpit.guard import Guard, cookie_name
from handrail.collect.cockpit.http import Http, Server
from handrail.collect.cockpit.hub import Hub
from handrail.collect.cockpit.messages import LARGEST
from handrail.collect.cockpit.pipe import Kind, Pipe
from handrail.collect.cockpit_config import CockpitConfig
from handrail.controllers.errors import HandrailError
from handrail.controllers.user_folder import user_folder

_PAGE = Path(__file__).parent / "page"
_TRIES = 20  # ports after the one that is wanted
_PATIENCE = 5.0  # with a form that is sent [s]
_LONGEST = 200  # token [bytes]
_PAUSE, _MOST_PAUSES = 1.0, 32  # before another wrong token is answered [s], and how many wait so
_NICE = 5  # the loop of the robot comes first
_LEAVING = 2.0  # for pages to hear that it is over, and go [s]
_NOTES = 0.02  # between two looks at how late the loop is [s]
_REPORTS, _COLLECTIONS = 25, 250  # so many looks to a report, to a collection of garbage
_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:; frame-ancestors 'none'; "
    "base-uri 'none'; form-action 'self'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-cache",
}
_DOOR = ("", "index.html", "style.css", "door.js", "main.js")  # what anyone may see: nothing of the robot


class Site:
    """The pages and the socket.

    Args:
        hub: of the pages.
        guard: checks who may come in.
        folder: of files that the recording lets pages have.
    """

    def __init__(self, hub: Hub, guard: Guard, folder: Path) -> None:
        self._hub, self._guard, self._folder = hub, guard, folder
        self._files = {
            path.relative_to(_PAGE).as_posix(): path for path in _PAGE.rglob("*") if path.is_file()
        }
        self._pauses = 0
        self.app = Starlette(
            routes=[
                Route("/login", self._log_in, methods=["POST"]),
                Route("/meshes/{name}", self._kept),
                Route("/played/{name}", self._kept),
                Route("/{name:path}", self._file),
                WebSocketRoute("/drive", self._drive),
            ]
        )

    async def _file(self, request: Request) -> Response:
        name = request.path_params["name"] or "index.html"
        if not self._guard.is_ours(request.headers) or not (name in _DOOR or self._admits(request)):
            return _answer("not for you", 403)
        if name not in self._files:
            return _answer("not found", 404)
        return FileResponse(self._files[name], headers=_HEADERS)

    async def _kept(self, request: Request) -> Response:
        files = {path.name: path for path in self._folder.iterdir()}
        name = request.path_params["name"]
        if not self._admits(request) or name not in files:
            return _answer("not for you", 403)
        return FileResponse(files[name], headers=_HEADERS | {"Cache-Control": "max-age=86400, immutable"})

    async def _log_in(self, request: Request) -> Response:
        if not self._guard.is_ours(request.headers, origin=True):
            return _answer("not for you", 403)
        address = _address(request)
        if session := self._guard.log_in(await _short_body(request), address):
            answer = JSONResponse({}, headers=_HEADERS)
            secure = request.url.scheme == "https"
            name = cookie_name(request.headers)
            answer.set_cookie(name, session, httponly=True, samesite="strict", secure=secure)
            return answer
        if self._guard.guesses(address):  # whoever guesses waits; of too many at once nobody
            if self._pauses >= _MOST_PAUSES:
                return _answer("too many wrong tokens", 429)
            self._pauses += 1
            try:
                await asyncio.sleep(_PAUSE)
            finally:
                self._pauses -= 1
        return _answer("not for you", 403)

    async def _drive(self, page: WebSocket) -> None:
        name = page.query_params.get("page", "")
        fine = self._guard.is_ours(page.headers, origin=True) and self._admits(page)
        if fine and 8 <= len(name) <= 40:
            await self._hub.serve(page, name)
        else:
            await page.close(1008)

    def _admits(self, request: Request | WebSocket) -> bool:
        return self._guard.admits(request.headers, request.cookies, _address(request))


async def _short_body(request: Request) -> str:
    """Return what a form says; nothing if it is long or slow."""
    body = b""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(_PATIENCE):
            async for chunk in request.stream():
                body += chunk
                if len(body) > _LONGEST:
                    return ""
            return body.decode(errors="replace")
    return ""


def _address(request: Request | WebSocket) -> str:
    return request.client.host if request.client else ""


def _answer(words: str, status: int) -> Response:
    return Response(words, status, headers=_HEADERS)


def _listening(host: str, port: int) -> socket.socket:
    """Return a socket that listens at a port, or one of the next ones."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    place, trouble = "127.0.0.1" if host == "localhost" else host, ""
    for trial in range(port, min(port + _TRIES, 2**16) if port else 1):
        try:
            dual = family == socket.AF_INET6 and socket.has_dualstack_ipv6()  # `::` takes IPv4, too
            return socket.create_server((place, trial), family=family, backlog=64, dualstack_ipv6=dual)
        except OSError as error:
            trouble = error.strerror
    raise HandrailError(f"cockpit: cannot listen at {host}, port {port}: {trouble}")


async def serve(pipe: Pipe, config: CockpitConfig, folder: Path, secret: str) -> None:
    """Serve until the recording is gone."""
    listener = _listening(config.host, config.port)
    scheme = "http" if config.is_private else "https"
    guard, hub = Guard(not config.asks, scheme, secret), Hub(pipe)
    server = Server(_uvicorn(Site(hub, guard, folder), config))
    host, port = listener.getsockname()[:2]
    door = f"#{guard.token}" if config.asks else ""
    shown = f"[{host}]" if ":" in host else host
    note = {"address": f"{scheme}://{shown}:{port}/{door}", "port": port}
    pipe.send_surely(Kind.NOTE, note)
    gone, loop = asyncio.Event(), asyncio.get_running_loop()

    def hear() -> None:
        try:
            hub.hear()
        except HandrailError:  # the recording is gone
            gone.set()
            loop.remove_reader(pipe.fileno())

    loop.add_reader(pipe.fileno(), hear)
    beside = [asyncio.create_task(task) for task in (_note(pipe, hub, guard), _end(server, gone, hub))]
    await server.serve(sockets=[listener])
    for task in beside:
        task.cancel()


def _uvicorn(site: Site, config: CockpitConfig) -> uvicorn.Config:
    cert, key = (None, None) if config.is_private else _certificate(config)
    return uvicorn.Config(
        site.app,
        http=Http,
        log_level="critical",
        access_log=False,
        ws_max_size=2 * LARGEST,
        ws_per_message_deflate=False,
        h11_max_incomplete_event_size=2**14,
        timeout_graceful_shutdown=1,
        server_header=False,
        ssl_certfile=cert,
        ssl_keyfile=key and str(key),
    )


def _certificate(config: CockpitConfig) -> tuple[Path, Path]:
    from handrail.collect.cockpit.certificate import certificate

    if config.certificate:
        folder = Path(config.certificate).expanduser()
        return folder / "cert.pem", folder / "key.pem"
    return certificate(config.host, user_folder("XDG_CONFIG_HOME") / "cockpit")


async def _end(server: uvicorn.Server, gone: asyncio.Event, hub: Hub) -> None:
    """When the recording is gone, let the pages hear its last words and leave, and end the server."""
    await gone.wait()
    until = time.monotonic() + _LEAVING
    while hub.is_leaving and time.monotonic() < until:
        await asyncio.sleep(_NOTES)
    server.should_exit = True


async def _note(pipe: Pipe, hub: Hub, guard: Guard) -> None:
    """Look again and again how late the loop is; send what waits for the recording; give memory back.

    A TLS connection that is gone is 256 KiB of garbage in a cycle: too few objects for Python to look soon.
    """
    gc.freeze()
    for turn in itertools.count(1):
        before = time.monotonic()
        await asyncio.sleep(_NOTES)
        hub.strain.note(time.monotonic() - before - _NOTES)
        pipe.flush()
        if turn % _REPORTS == 0:
            hub.report(guard.refused)
        if turn % _COLLECTIONS == 0:
            gc.collect()


def main() -> None:
    """Run the process."""
    pipe = Pipe(socket.socket(fileno=int(sys.argv[1])))
    with contextlib.suppress(AttributeError, OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _NICE)
    try:
        if not (said := sys.stdin.read()):
            return  # the recording is gone already
        settings: dict[str, Any] = json.loads(said)
        folder, secret = settings.pop("folder"), settings.pop("secret")
        asyncio.run(serve(pipe, CockpitConfig(**settings), Path(folder), secret))
        with contextlib.suppress(HandrailError):
            pipe.receive()
            return  # the recording is still there
        shutil.rmtree(folder, ignore_errors=True)
    except HandrailError as error:
        pipe.send_surely(Kind.NOTE, {"error": str(error)})


if __name__ == "__main__":
    main()
