"""Laws: input of the page that drives reaches the recording, and nobody else's, whatever they send."""

import json
import socket as sockets
import sys
import threading
import time
import urllib.request
import webbrowser
from contextlib import ExitStack, suppress
from http.cookiejar import CookieJar

import pytest
from cockpit_helpers import ask, drive, heard, page, seen, server, show, stage, told
from websockets.exceptions import ConnectionClosed, InvalidMessage, InvalidStatus

from handrail.collect.cockpit.page_socket import REPLACED
from handrail.collect.cockpit.pipe import Kind
from handrail.collect.cockpit.process import MOST_DEATHS, ServerProcess, open_server
from handrail.collect.cockpit_config import CockpitConfig
from handrail.controllers.errors import HandrailError


@pytest.fixture(scope="module")
def guarded(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", str(tmp_path_factory.mktemp("config")))
        with server(host="127.0.0.2") as made:
            yield made


@pytest.fixture(autouse=True)
def quiet(request):
    if "served" in request.fixturenames:
        request.getfixturevalue("served").receive()
    yield
    time.sleep(0.05)


def test_a_page_drives_with_one_clock(served):
    with page(served, "page-number-one") as socket:
        told(socket, "stage")
        stamp = seen(served, socket, 1)
        socket.send(drive(7, stamp, axes=[0.5] * 18))
        ((_, data),) = heard(served, {Kind.DRIVE})
        inputs, received, round_trip = data
        assert inputs["axes"] == [0.5] * 18
        assert 0.0 < round_trip < 5.0
        assert received == pytest.approx(stamp + round_trip, abs=1e-6)
    assert heard(served, {Kind.LOST})


def test_a_page_that_watches_moves_nothing_but_may_stop(served):
    with page(served, "page-number-one") as first, page(served, "page-number-two") as second:
        assert told(first, "you")["driving"]
        assert not told(second, "you")["driving"]
        second.send(drive(1, axes=[1.0] * 18))
        second.send(json.dumps({"kind": "ask", "what": "mode", "value": "direct"}))
        second.send(json.dumps({"kind": "ask", "what": "stop", "value": False}))
        assert not heard(served, {Kind.ASK, Kind.DRIVE}, patience=0.3)
        second.send(json.dumps({"kind": "ask", "what": "stop", "value": True}))
        assert [kind for kind, _ in heard(served, {Kind.ASK, Kind.DRIVE, Kind.STOP})] == [Kind.STOP]
        second.send(json.dumps({"kind": "ask", "what": "take", "value": True}))
        while not told(first, "you")["asked"]:
            pass
        first.send(json.dumps({"kind": "ask", "what": "give", "value": True}))
        while not told(second, "you")["driving"]:
            pass
        assert heard(served, {Kind.LOST})  # whoever drives anew lets go first
        second.send(json.dumps({"kind": "ask", "what": "give", "value": True}))


def test_a_slow_page_gets_what_is_newest(served):
    with page(served, "page-number-one", max_queue=1) as socket:
        told(socket, "stage")
        for number in range(60):
            show(served, n=number, filling="x" * 200_000)
            time.sleep(0.005)
        got = []
        while not got or got[-1] != 1000:
            show(served, n=1000, filling="")  # until there is room in the pipe
            with suppress(TimeoutError):
                got.append(told(socket, "frame", 0.5)["frame"]["n"])
        assert got == sorted(got)
        assert len(set(got)) < 60


def test_a_round_trip_is_the_first_answer_to_a_frame(served):
    with page(served, "page-number-one") as socket:
        stamp = seen(served, socket, 1)
        time.sleep(0.1)
        for sequence in (1, 2):
            socket.send(drive(sequence, stamp))
            time.sleep(0.05)
        (_, first, trip), (_, second, again) = (data for _, data in heard(served, {Kind.DRIVE}, 2))
        assert trip == again == pytest.approx(first - stamp)
        assert second > first


def test_a_message_sent_before_is_refused(served):
    with page(served, "page-number-one") as socket:
        told(socket, "stage")
        socket.send(drive(5))
        assert heard(served, {Kind.DRIVE})
        socket.send(drive(5, axes=[1.0] * 18))
        assert "seq" in told(socket, "error")["error"]
        assert [kind for kind, _ in heard(served, {Kind.DRIVE, Kind.LOST})] == [Kind.LOST]


def test_a_copy_of_the_tab_takes_its_place(served):
    """Two pages of one name would both drive; the older one is let go, and who drives now begins anew."""
    with page(served, "page-number-one") as first, page(served, "page-number-one") as second:
        assert told(second, "you")["driving"]
        with pytest.raises(ConnectionClosed) as closed:
            told(first, "no such thing")
        assert closed.value.rcvd.code == REPLACED
        assert heard(served, {Kind.LOST})
        second.send(drive(1))
        assert heard(served, {Kind.DRIVE})


def test_too_large_a_message_ends_the_connection(served):
    with page(served, "page-number-one") as socket:
        socket.send("x" * 100_000)
        with pytest.raises(ConnectionClosed):
            told(socket, "no such thing")


def test_the_door_is_closed_without_the_token(guarded):
    token = guarded.address.split("#")[1]
    guarded.keep("x.bin", b"mesh")
    for name in ("link.js", "view.js", "meshes/x.bin", "played/x.bin", "three.min.js"):
        assert ask(guarded, f"/{name}")[0] == 403
    assert ask(guarded, "/index.html")[0] == 200
    with pytest.raises(InvalidStatus):
        page(guarded)
    assert ask(guarded, "/login", b"not the token")[0] == 403
    assert ask(guarded, "/login", token.encode(), Origin="https://evil.example")[0] == 403
    status, headers = ask(guarded, "/login", token.encode())
    cookie = headers["set-cookie"].split(";")[0]
    assert status == 200
    assert {"HttpOnly", "Secure", "SameSite=strict"} <= set(headers["set-cookie"].split("; "))
    for name in ("link.js", "meshes/x.bin", "played/x.bin"):
        assert ask(guarded, f"/{name}", Cookie=cookie)[0] == 200
    assert ask(guarded, "/../server.py", Cookie=cookie)[0] in (403, 404)
    assert ask(guarded, "/%2e%2e/server.py", Cookie=cookie)[0] in (403, 404)
    with pytest.raises(InvalidStatus):
        page(guarded, cookie=cookie, origin="https://evil.example")
    with page(guarded, cookie=cookie) as socket:
        assert told(socket, "you")["driving"]


def test_after_five_wrong_tokens_an_answer_comes_a_second_later():
    with server(token=True) as made:
        for _ in range(5):
            assert ask(made, "/login", b"wrong")[0] == 403
        begun = time.monotonic()
        assert ask(made, "/login", b"wrong")[0] == 403
        assert time.monotonic() - begun >= 1.0
        assert ask(made, "/login", made.address.split("#")[1].encode())[0] == 200


def test_the_token_can_be_asked_for_on_this_computer_too():
    with server(token=True) as made:
        assert made.address.startswith("http://127.0.0.1:")
        with pytest.raises(InvalidStatus):
            page(made)
        status, headers = ask(made, "/login", made.address.split("#")[1].encode())
        assert status == 200
        with page(made, cookie=headers["set-cookie"].split(";")[0]) as socket:
            assert told(socket, "you")["driving"]


def test_two_recordings_of_a_computer_let_the_same_browser_in():
    jar, welcome = CookieJar(), []
    with server(token=True) as one, server(token=True) as other:
        for made in (one, other):
            base, token = made.address.split("/#")
            opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(jar))
            opener.open(urllib.request.Request(f"{base}/login", token.encode(), {"Origin": base})).close()
        for made in (one, other):
            with page(made, cookie="; ".join(f"{each.name}={each.value}" for each in jar)) as socket:
                welcome.append(told(socket, "you")["driving"])
    assert welcome == [True, True]


@pytest.mark.parametrize("display", ["", "DISPLAY", "WAYLAND_DISPLAY", "BROWSER"])
def test_a_browser_opens_where_it_can_be_seen_and_nobody_waits_for_it(monkeypatch, display):
    """A text browser takes the terminal, for as long as it runs."""
    opened, goes_on, waited = threading.Event(), threading.Event(), []
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(webbrowser, "open", lambda _: (opened.set(), waited.append(goes_on.wait(20.0))))
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    if display:
        monkeypatch.setenv(display, "some")
    open_server(CockpitConfig(port=0), lambda words: None).close()
    goes_on.set()
    assert opened.wait(20.0 if display else 0.5) == bool(display)
    assert False not in waited


def test_no_port_after_the_last_one_is_tried():
    with ExitStack() as stack:
        with suppress(OSError):  # it is taken already
            stack.enter_context(sockets.create_server(("127.0.0.1", 65535)))
        with pytest.raises(HandrailError, match="port 65535"):
            ServerProcess(CockpitConfig(port=65535, open=False))


def test_the_server_ends_with_the_recording():
    with server() as made:
        process = made.process
        made.pipe.close()
        assert process.wait(10) == 0


def test_a_server_that_dies_is_started_again_at_its_address_and_a_session_outlives_it(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    said = []
    with server(say=said.append, host="127.0.0.2") as made:
        stage(made)
        address, before = made.address, made.process.pid
        cookie = ask(made, "/login", address.split("#")[1].encode())[1]["set-cookie"].split(";")[0]
        made.process.kill()
        made.process.wait()
        assert [kind for kind, _ in heard(made, {Kind.LOST, Kind.NOTE}, 2)] == [Kind.LOST, Kind.NOTE]
        assert (made.address, len(said)) == (address, 1)
        assert made.process.pid != before
        stage(made)
        with asked_again(made, cookie) as socket:
            told(socket, "stage")


def asked_again(served, cookie):
    """Open a socket as a page does whose server is just being started: it asks again."""
    for _ in range(9):
        with suppress(InvalidMessage, ConnectionError):
            return page(served, cookie=cookie)
        time.sleep(0.5)
    return page(served, cookie=cookie)


@pytest.mark.slow
def test_a_server_that_dies_again_and_again_ends_the_recording():
    def die():
        made.process.kill()
        made.process.wait()
        made.receive()

    with server() as made:
        for _ in range(MOST_DEATHS):
            die()
        with pytest.raises(HandrailError, match=r"ended 4 times .* SIGKILL; the saved episodes are whole"):
            die()
