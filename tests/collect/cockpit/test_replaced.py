"""Laws: a page that comes back is heard, whatever became of its old connection; one of a name drives."""

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from cockpit_helpers import ask_for, connected, drive

from handrail.collect.cockpit import page_socket
from handrail.collect.cockpit.hub import MOST_PAGES, Hub
from handrail.collect.cockpit.page_socket import REPLACED
from handrail.collect.cockpit.pipe import Kind

NAME = "page-number-one"
TURNS = 30  # of the loop, for all to come to rest


class LiveSocket:
    """A page's socket as the web server has it: nothing goes out of a dead network, no close either."""

    def __init__(self, is_dead=False):
        self._come, self._takes, self.closed = asyncio.Queue(), asyncio.Event(), None
        if not is_dead:
            self.revive()

    def revive(self):
        self._takes.set()

    def say(self, text):
        self._come.put_nowait({"type": "websocket.receive", "text": text})

    async def accept(self):
        pass

    async def receive(self):
        return await self._come.get()

    async def send_text(self, text):
        await self._takes.wait()

    async def close(self, code=1000):
        await self._takes.wait()
        self.closed = self.closed or code
        self._come.put_nowait({"type": "websocket.disconnect"})


class House:
    """A hub with its pages, and what reaches the recording."""

    def __init__(self):
        self._recording, web = ends = connected()
        self._recording.send(Kind.STAGE, {})
        self._ends, self._tasks, self.hub = ends, [], Hub(web)
        self.hub.hear()

    async def comes(self, name=NAME, is_dead=False):
        socket = LiveSocket(is_dead)
        self._tasks.append(asyncio.create_task(self.hub.serve(socket, name)))
        await rest()
        return socket

    async def heard(self):
        await rest()
        return self._recording.receive()

    async def close(self):
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for end in self._ends:
            end.close()


async def rest():
    for _ in range(TURNS):
        await asyncio.sleep(0)


def in_house(law) -> Any:
    """Run a law in a loop of its own: a browser that is open has one in this thread."""

    def run():
        async def all_of_it():
            house = House()
            try:
                await law(house)
            finally:
                await house.close()

        with ThreadPoolExecutor(1) as pool:
            pool.submit(asyncio.run, all_of_it()).result()

    run.__name__, run.__doc__ = law.__name__, law.__doc__
    return run


def kinds(messages):
    return [kind for kind, _ in messages]


@in_house
async def test_stop_of_a_page_that_comes_back_is_heard_though_its_old_network_is_dead(house):
    await house.comes("driving-page")
    await house.comes(is_dead=True)
    again = await house.comes()
    again.say(ask_for("stop", press=7))
    assert Kind.STOP in kinds(await house.heard())


@in_house
async def test_of_many_connections_of_one_page_the_newest_drives_alone(house):
    """Also when the network of the older ones comes back."""
    pages = [await house.comes(is_dead=True) for _ in range(3)] + [await house.comes()]
    await house.heard()
    for number, page in enumerate(pages):
        page.revive()
        await rest()
        page.say(drive(number, axes=[0.1 * number] * 18))
    inputs = [data[0]["axes"][0] for kind, data in await house.heard() if kind is Kind.DRIVE]
    assert inputs == [pytest.approx(0.3)]
    assert [page.closed for page in pages] == [REPLACED] * 3 + [None]


@in_house
async def test_a_page_that_was_replaced_only_stops(house):
    """What was on its way to the old connection is no input of the new one."""
    old, new = await house.comes(is_dead=True), await house.comes()
    await house.heard()
    for said in (drive(1), ask_for("success"), ask_for("give"), ask_for("stop")):
        old.say(said)
    assert kinds(await house.heard()) == [Kind.STOP]
    new.say(drive(1))
    assert kinds(await house.heard()) == [Kind.DRIVE]


@in_house
async def test_a_page_that_says_too_much_nonsense_is_cut_off(house):
    page = await house.comes()
    for _ in range(49):
        page.say("nonsense")
    await asyncio.sleep(0.7)
    assert page.closed is None
    page.say("nonsense")
    await asyncio.sleep(0.7)  # in which it may still say STOP
    assert page.closed == 1008


@in_house
async def test_a_page_comes_back_to_a_full_house(house):
    """Its own place is free for it."""
    for number in range(MOST_PAGES):
        await house.comes(f"page-number-{number}", is_dead=True)
    assert (await house.comes("page-without-a-place")).closed == 1013
    again = await house.comes("page-number-9")
    again.say(ask_for("stop"))
    assert Kind.STOP in kinds(await house.heard())


def test_a_driver_that_takes_nothing_leaves_its_place(monkeypatch):
    """Its connection may last for a quarter of an hour more; a STOP that comes by it counts."""

    @in_house
    async def law(house):
        dead = await house.comes(is_dead=True)
        until = time.monotonic() + 10.0
        while Kind.LOST not in kinds(await house.heard()):
            assert time.monotonic() < until
            await asyncio.sleep(0.001)
        dead.say(drive(1))
        dead.say(ask_for("stop"))
        assert kinds(await house.heard()) == [Kind.STOP]

    monkeypatch.setattr(page_socket, "SLOW", 0.01)
    law()
