"""Attacks a cockpit from an address of its own; says what was let through.

    python cockpit_attacks.py ADDRESS SESSION

SESSION is a cookie of somebody else. ADDRESS has the token after `#`: some attackers know it.
"""

import asyncio
import json
import socket
import ssl
import sys
from contextlib import suppress
from urllib.parse import urlsplit

import numpy as np
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.typing import Origin

FROM = "127.0.0.3"
TRUSTING = ssl.create_default_context()
TRUSTING.check_hostname, TRUSTING.verify_mode = False, ssl.CERT_NONE
GOOD = {"kind": "drive", "seq": 1, "echo": 0.0, "on": True, "device": "keyboard", "grips": [False]}
GOOD |= {"axes": [1.0] * 18, "view": 0.0, "targets": []}
MESSAGES, CONNECTIONS = 5_000, 500
_REFUSED = (OSError, InvalidHandshake, ConnectionClosed, TimeoutError, EOFError)


class Attacker:
    """Somebody at another address."""

    def __init__(self, address):
        parts = urlsplit(address)
        self.host, self.port, self.token = parts.hostname, parts.port, parts.fragment
        self.site = f"https://{parts.netloc.split('#')[0]}"
        self.rng = np.random.default_rng(0)

    async def connected(self):
        """Return a connection's reader and writer."""
        async with asyncio.timeout(10.0):
            return await asyncio.open_connection(self.host, self.port, ssl=TRUSTING, local_addr=(FROM, 0))

    async def request(self, method, path, body=b"", **headers):
        """Return the lines of the answer's head; the status is the first one, "" where nothing is said."""
        said = {"Host": f"{self.host}:{self.port}", "Origin": self.site} | headers
        lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in said.items())]
        lines += [f"Content-Length: {len(body)}", "", ""]
        try:
            reader, writer = await self.connected()
            writer.write("\r\n".join(lines).encode("latin1") + body)
            async with asyncio.timeout(10.0):
                await writer.drain()
                head = await reader.readuntil(b"\r\n\r\n")
            writer.close()
            return head.decode(errors="replace").split("\r\n")
        except _REFUSED:
            return [""]

    def page(self, name, cookie, origin=""):
        """Return a page's connection."""
        return connect(
            f"wss://{self.host}:{self.port}/drive?page={name}",
            origin=Origin(origin or self.site),
            additional_headers={"Cookie": cookie} if cookie else {},
            ssl=TRUSTING,
            compression=None,
            open_timeout=20,
            ping_interval=None,
            local_addr=(FROM, 0),
        )

    async def comes_in(self, cookie="", origin=""):
        """Whether a page is let in."""
        try:
            async with self.page("an-attackers-page", cookie, origin):
                return True
        except _REFUSED:
            return False

    async def log_in(self):
        """Return a session of one who knows the token."""
        lines = await self.request("POST", "/login", self.token.encode())
        return next(line.split(": ")[1].split(";")[0] for line in lines if line.startswith("set-cookie"))

    def nonsense(self):
        """Return a message that makes no sense, or that no page of theirs may say."""
        kind = int(self.rng.integers(10))
        letters = bytearray(json.dumps(GOOD).encode())
        for place in self.rng.integers(0, len(letters), 3):
            letters[place] = int(self.rng.integers(0, 256))
        garbled = [bytes(letters), bytes(letters).decode("latin1"), "[" * 3000, '{"a":' * 700]
        garbled += [json.dumps(GOOD).replace("1.0", "NaN"), json.dumps(GOOD | {"axes": [1e300] * 18})]
        garbled += [self.rng.bytes(int(self.rng.integers(0, 9000))), "null", json.dumps(GOOD), "9" * 4000]
        return garbled[kind]

    async def fuzz(self, cookie):
        """Send messages that make no sense; return how many."""
        sent = 0
        while sent < MESSAGES:
            with suppress(*_REFUSED):
                async with self.page(f"page-that-fuzzes-{sent % 7}", cookie) as page:
                    for _ in range(100):
                        await page.send(self.nonsense())
                        sent += 1
                    await asyncio.sleep(0.1)
        return sent

    async def crowd(self):
        """Open connections that say nothing, in clear, or half a request; return how many were opened."""
        opened = []
        for number in range(CONNECTIONS):
            with suppress(OSError):
                if number % 2:
                    each = socket.create_connection((self.host, self.port), 10, source_address=(FROM, 0))
                    opened.append((None, each))
                else:
                    pair = await self.connected()
                    pair[1].write(b"GET / HTTP/1.1\r\nHost: 127.0.0.2\r\nX-Slow: ")
                    opened.append(pair)
        await asyncio.sleep(3.0)
        for _, each in opened:
            each.close()
        return len(opened)

    async def all(self, stolen):
        """Do everything; return what came of it."""

        async def status(*what, **headers):
            return (await self.request(*what, **headers))[0]

        said = {"no token": await status("GET", "/link.js")}
        wrong = await asyncio.gather(*(status("POST", "/login", b"wrong %d" % each) for each in range(60)))
        said["wrong tokens let in"] = sum(line.startswith("HTTP/1.1 200") for line in wrong)
        said["the owner after that"] = await status("POST", "/login", self.token.encode())
        own = await self.log_in()
        said["foreign origin"] = await self.comes_in(own, "https://evil.example")
        said["another's session"] = await self.comes_in(stolen)
        said["no session"] = await self.comes_in()
        said["a name made to point here"] = await status("GET", "/", Host="evil.example")
        said["a long body"] = await status("POST", "/login", b"x" * 3_000_000)
        said["a long head"] = await status("GET", "/", Cookie="x" * 3_000_000)
        paths = ["/" + self.rng.bytes(30).hex()[: int(self.rng.integers(1, 60))] for _ in range(200)]
        paths += ["/%00", "/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd", "/meshes/..%2f"]
        found = [await status("GET", path, Cookie=own) for path in paths]
        said["paths found"] = sum(line.startswith("HTTP/1.1 2") for line in found)
        said["paths that broke it"] = sum(line.startswith("HTTP/1.1 5") for line in found)
        async with self.page("page-that-reads-nothing", own, "") as deaf:
            said["messages"] = await self.fuzz(own)
            said["connections"] = await self.crowd()
            deaf.transport.abort()
        said["the page after all that"] = await status("GET", "/")
        return said


if __name__ == "__main__":
    print(json.dumps(asyncio.run(Attacker(sys.argv[1]).all(sys.argv[2]))))
