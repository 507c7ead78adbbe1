"""The pages that are connected: each gets what is newest, none makes another wait."""

import asyncio
import contextlib
import time
from collections import Counter, deque
from collections.abc import Hashable
from dataclasses import replace
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from handrail.collect.cockpit.lease import RESERVED, Lease
from handrail.collect.cockpit.messages import LEASE, CardAnswer, Drive, Message, Stop, parse, stills
from handrail.collect.cockpit.page_socket import REPLACED, PageSocket, text
from handrail.collect.cockpit.pipe import Kind, Pipe
from handrail.collect.cockpit.strain import Strain
from handrail.collect.operators.person.inputs import Ask
from handrail.controllers.errors import HandrailError

MOST_PAGES = 32
MOST_LATE = 0.3  # for how long there may have been a newer picture than the one that an input answers [s]
_LAST_WORDS = 0.5  # for which a page that is cut off may still say STOP [s]


class Hub:
    """Passes frames to the pages, and the driver's input to the recording.

    Attributes:
        strain: how late this server's loop is.
        counts: what was dropped or refused, by why.
    """

    def __init__(self, pipe: Pipe) -> None:
        self._pipe, self._lease, self.strain = pipe, Lease(), Strain()
        self._pages: set[PageSocket] = set()
        self._kept: dict[Kind, str] = {}  # scene, card and end, as pages that come later hear them too
        self._stamps: deque[float] = deque(maxlen=64)  # of the frames that pages have got
        self._presses: deque[int] = deque(maxlen=64)  # of STOP that were heard
        self._stopped = -1.0  # when it was said last [s]
        self.counts: Counter[str] = Counter()

    @property
    def is_leaving(self) -> bool:
        """Whether pages that have been told that it is over are still there: they go when they hear it."""
        return Kind.OVER in self._kept and bool(self._pages)

    def hear(self) -> None:
        """Pass on what the recording has sent."""
        newest: dict[Hashable, tuple[Kind, Any]] = {}
        for kind, value in self._pipe.receive():
            newest[kind, value[0] if kind is Kind.PICTURE else 0] = kind, value
            if kind is Kind.FRAME:  # also one that no page gets: inputs that do not answer it may be late
                self._stamps.append(value["stamp"])
        for key, (kind, value) in newest.items():
            said = value if kind is Kind.PICTURE else text(kind, **{kind: value})
            if kind in (Kind.STAGE, Kind.CARD, Kind.OVER):
                self._kept[kind] = said
            for page in self._pages:
                drives = self._lease.drives(page.name)
                if kind is Kind.PICTURE:
                    page.offer(key, said, 0.9 * self.strain.picture_period)
                elif kind is Kind.FRAME:  # the driver has every one, the others some
                    page.offer(key, said, 0.0 if drives else 0.9 * self.strain.spectator_period)
                elif drives or kind is not Kind.CARD:
                    page.offer(kind, said)

    def report(self, refused: int) -> None:
        """Tell the recording what was dropped, and how many were turned away."""
        self.counts["refused at the door"] = refused
        self.counts["input without room"] = self._pipe.dropped[Kind.DRIVE] + self._pipe.dropped[Kind.ASK]
        self._pipe.send(Kind.DROPPED, {why: n for why, n in self.counts.items() if n})

    async def serve(self, socket: WebSocket, name: str) -> None:
        """Serve a page until it goes; no other one makes it wait, also not one whose network is dead."""
        if len({page.name for page in self._pages} | {name}) > MOST_PAGES:
            self.counts["more pages than allowed"] += 1
            await socket.close(1013)
            return
        await socket.accept()
        page = PageSocket(socket, name)
        for other in [other for other in self._pages if other.name == name]:
            self._part(other)  # a reload, or a copy of the tab; one of them drives at most
            other.offer("close", REPLACED)
        self._pages.add(page)
        delivery = asyncio.create_task(page.deliver())
        delivery.add_done_callback(lambda _: self._part(page))  # it takes nothing
        try:
            if self._lease.is_free_for(name):
                self._lease.take(name)
            if Kind.STAGE in self._kept:
                page.offer(Kind.STAGE, self._kept[Kind.STAGE])
            self._tell_all()
            await self._listen(page)
        except (WebSocketDisconnect, RuntimeError):
            pass  # it is gone
        finally:
            delivery.cancel()
            page.end()
            self._part(page)

    def _part(self, page: PageSocket) -> None:
        """Take note that a page is gone; if it is still heard, then only when it says STOP."""
        if page not in self._pages:
            return
        self._pages.discard(page)
        if self._lease.drives(page.name):
            self._lose()
        self._lease.leave(page.name)
        self._tell_all()
        asyncio.get_running_loop().call_later(1.01 * RESERVED, self._settle)

    def _settle(self) -> None:
        """Let whoever asks drive when nobody has come back to the lease; say so."""
        self._lease.settle()
        self._tell_all()

    async def _listen(self, page: PageSocket) -> None:
        """Take a page's messages; one that is cut off may still say STOP."""
        while page in self._pages and not page.is_cut:
            self._take_all(page, await page.hear(), time.monotonic())
        self._part(page)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_LAST_WORDS):
                while True:
                    self._take_all(page, await page.hear(), time.monotonic())
        await page.socket.close(1008)

    def _take_all(self, page: PageSocket, heard: list[str | bytes], now: float) -> None:
        """Take messages that came together: STOP first, whatever was said before it.

        Before it, and beyond what a page may say, only what takes motion away counts; a press that is said
        again counts once.
        """
        said = [_parsed(each) for each in heard]
        presses = {n: each.press for n, each in enumerate(said) if isinstance(each, Stop)}
        stops = {n: press for n, press in presses.items() if press not in self._presses}
        if stops:  # anyone who sees danger may
            self._presses.extend(filter(None, presses.values()))
            self._stopped = now
            self._pipe.send_surely(Kind.STOP, instead_of=(Kind.ASK,))
        for number, each in enumerate(said if page in self._pages else ()):
            may = page.may_say(now)
            try:
                if isinstance(each, HandrailError):
                    raise each
                if stills(each) or (may and number >= max(stops, default=0)):
                    self._take(page, each, now)
                else:
                    self.counts["messages before a stop" if may else "messages too fast"] += 1
            except HandrailError as error:
                self._refuse(page, error)

    def _refuse(self, page: PageSocket, error: HandrailError) -> None:
        """Count a message that makes no sense; whoever drives so drives no more."""
        page.bad += 1
        self.counts["messages that make no sense"] += 1
        if self._lease.drives(page.name):
            self._lose()
        page.say("error", error=str(error))

    def _take(self, page: PageSocket, said: Message, now: float) -> None:
        if isinstance(said, Stop):  # it was passed on first
            page.say("heard", press=said.press)
        elif isinstance(said, Ask) and said.what in LEASE:
            drove = self._lease.holder
            (self._lease.take if said.what == "take" else self._lease.give)(page.name)
            if self._lease.holder != drove:
                self._lose()
            self._tell_all()
        elif not self._lease.drives(page.name):
            self.counts["input of pages that do not drive"] += 1
        elif isinstance(said, Drive):
            self._drive(page, said, now)
        elif isinstance(said, Ask) and said.what == "stop" and page.echo <= self._stopped:  # not yet seen
            page.say("error", error="release: expected of a page that saw the robot stopped; press it again")
        else:
            kind = Kind.STILL if stills(said) else Kind.ASK
            kind = Kind.ANSWER if isinstance(said, CardAnswer) else kind
            if kind is not Kind.ASK or Kind.STAGE in self._kept:
                self._pipe.send_surely(kind, said)

    def _drive(self, page: PageSocket, said: Drive, now: float) -> None:
        """Pass an input on; who answers an old picture cannot steer, only let go."""
        if said.echo > now or said.seq <= page.sequence:
            raise HandrailError("drive: expected a time that this server has said, and seq to count up")
        page.sequence = said.seq
        page.answered(said.echo, now)
        self.hear()  # which pictures there have been meanwhile, also while this server stood still
        newer = next((stamp for stamp in self._stamps if stamp > said.echo), now)
        is_late = now - newer > MOST_LATE
        if is_late != page.is_late:
            page.is_late = is_late
            self._tell(page)
        self.counts["input that came too late"] += is_late
        forward = replace(said, on=said.on and not is_late), now, page.round_trip
        if stills(said):
            self._pipe.send_surely(Kind.DRIVE, forward, (Kind.DRIVE,))
        elif not is_late:
            self._pipe.send(Kind.DRIVE, forward)

    def _lose(self) -> None:
        """Tell the recording that nobody drives now: who does next has to begin anew."""
        self._pipe.send_surely(Kind.LOST, instead_of=(Kind.ASK,))

    def _tell_all(self) -> None:
        for page in self._pages:
            self._tell(page)

    def _tell(self, page: PageSocket) -> None:
        """Tell a page whether it drives, and who else is there; a card is for the driver alone."""
        driving = self._lease.drives(page.name)
        page.say(
            "you",
            driving=driving,
            free=self._lease.is_free_for(page.name),
            pages=len(self._pages),
            asked=bool(driving and self._lease.asking),
            asking=self._lease.asking == page.name,
            late=driving and page.is_late,
        )
        if driving and Kind.CARD in self._kept:
            page.offer(Kind.CARD, self._kept[Kind.CARD])


def _parsed(message: str | bytes) -> Message | HandrailError:
    try:
        return parse(message)
    except HandrailError as error:
        return error
