"""Laws of cards: only who drives sees them and answers, also after a reload; answers are small values."""

import json
import sys
import time

import pytest
from cockpit_helpers import drive, heard, page, server, told

from handrail.collect.cockpit.cards import Cards
from handrail.collect.cockpit.messages import CardAnswer
from handrail.collect.cockpit.pipe import Kind

CARD = {"id": "ee/tlx", "title": "How was it?", "answers": {"mental": 40}}


STOPPING_SERVER = """#!{python}
import select, socket, sys
from handrail.collect.cockpit.pipe import Kind, Pipe

pipe = Pipe(socket.socket(fileno=int(sys.argv[3])))
sys.stdin.read()
pipe.send_surely(Kind.STOP)
pipe.send_surely(Kind.NOTE, {{"address": "http://127.0.0.1:1/", "port": 1}})
select.select([pipe], [], [])  # until the recording goes
"""


def said(**changes):
    return json.dumps({"kind": "answer", "card": "ee/tlx", "item": "mental", "value": 45} | changes)


def test_only_the_page_that_drives_sees_a_card_and_answers(served):
    cards = Cards(served)
    with page(served, "page-number-one") as first, page(served, "page-number-two") as second:
        assert told(first, "you")["driving"]
        cards.show(CARD)
        assert told(first, "card")["card"] == CARD
        with pytest.raises(TimeoutError):
            told(second, "card", 0.5)
        second.send(said(value=99))
        first.send(said(value=45))
        assert [data["value"] for _, data in heard(served, {Kind.ANSWER})] == [45]
        assert not heard(served, {Kind.ANSWER}, patience=0.3)
        first.send(json.dumps({"kind": "ask", "what": "give", "value": True}))
    with page(served, "page-number-one") as again:
        assert told(again, "card")["card"] == CARD


def test_cards_hear_answers_and_leave_out_what_devices_say(served):
    cards = Cards(served)
    with page(served, "page-number-one") as socket:
        told(socket, "you")
        socket.send(drive(1))
        socket.send(said())
        socket.send(json.dumps({"kind": "ask", "what": "start", "value": True}))
        found, until = [], time.monotonic() + 10.0
        while not found and time.monotonic() < until:
            found += cards.hear()
        assert found == [CardAnswer("ee/tlx", "mental", 45)]


def test_a_stop_between_episodes_is_left_for_the_next_one(served):
    cards = Cards(served)
    with page(served, "page-number-one") as socket:
        told(socket, "you")
        socket.send(json.dumps({"kind": "ask", "what": "stop", "value": True}))
        socket.send(said())
        while not cards.hear():
            pass
        cards.hear()
        assert heard(served, {Kind.STOP}) == [(Kind.STOP, None)]
        assert not heard(served, {Kind.STOP}, patience=0.1)


def test_a_stop_that_is_left_outlives_the_web_server():
    """Also one that a study carries over into its next mode."""
    with server() as made:
        cards = Cards(made)
        made.unread.append((Kind.STOP, None))
        made.process.kill()
        made.process.wait()
        cards.hear()
        assert heard(made, {Kind.STOP}) == [(Kind.STOP, None)]
        assert not heard(made, {Kind.STOP}, patience=0.1)


def test_a_stop_that_is_said_while_the_server_starts_is_heard(tmp_path, monkeypatch):
    program = tmp_path / "server"
    program.write_text(STOPPING_SERVER.format(python=sys.executable))
    program.chmod(0o755)
    with monkeypatch.context() as patch:
        patch.setattr(sys, "executable", str(program))
        with server() as made:
            assert heard(made, {Kind.STOP}) == [(Kind.STOP, None)]


def test_a_card_that_nobody_acknowledges_is_shown_again():
    with server() as made, page(made, "page-number-one") as socket:
        cards = Cards(made)
        told(socket, "you")
        for _ in range(2):
            cards.show(CARD)
            told(socket, "card")
            cards.show(CARD)  # at once: not again
            with pytest.raises(TimeoutError):
                told(socket, "card", 0.2)
            time.sleep(0.4)
