"""Laws: a page's message is a small object of known kinds, or it is refused in one line."""

import contextlib
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handrail.collect.cockpit.messages import LARGEST, CardAnswer, Drive, parse
from handrail.collect.operators.person.inputs import Ask
from handrail.controllers.errors import HandrailError

GOOD = {
    "kind": "drive",
    "seq": 3,
    "echo": 1.5,
    "on": True,
    "device": "keyboard",
    "grips": [False],
    "axes": [0, 1.0],
}
GOOD |= {"view": 0.3, "targets": [3.0]}


def said(**changes):
    return json.dumps({**GOOD, **changes})


def answer(**changes):
    return json.dumps({"kind": "answer", "card": "ee/tlx", "item": "mental", "value": 45} | changes)


@pytest.mark.parametrize("value", [45, 4.5, "a text\nof two lines", True, None, ""])
def test_an_answer_is_one_value(value):
    assert parse(answer(value=value)) == CardAnswer("ee/tlx", "mental", value)


def test_a_drive_and_an_ask():
    drive = parse(said())
    assert isinstance(drive, Drive)
    assert (drive.seq, drive.echo) == (3, 1.5)
    assert (drive.on, drive.device, drive.grips, drive.axes) == (True, "keyboard", (False,), (0.0, 1.0))
    assert (drive.view, drive.targets) == (0.3, (3.0,))
    assert parse('{"kind": "ask", "what": "mode", "value": "ee"}') == Ask("mode", "ee")
    assert parse('{"kind": "ask", "what": "lock", "value": [1, 2]}') == Ask("lock", (1, 2))


@pytest.mark.parametrize(
    "text",
    [
        "", "{", "[]", "null", "1e999", "NaN", '"x"', "[" * 100_000, b"\xff\xfe",
        "[" * 2000 + "]" * 2000, '{"kind": []}',
        '{"kind": "ask", "what": ["mode"], "value": 1}', '{"kind": "ask", "what": "fly", "value": true}',
        '{"kind": "ask", "what": "mode", "value": 3}', '{"kind": "ask", "what": "speed", "value": 2.0}',
        '{"kind": "ask", "what": "start", "value": 1}', '{"kind": "ask", "what": "lock", "value": [1.5]}',
        '{"kind": "ask", "what": "mode", "value": "' + "x" * 200 + '"}',
        said(axes=[float("nan")]), said(axes=[2.0]), said(axes=["1"]), said(axes=[True]), said(axes=[0] * 65),
        said(axes={}), said(seq=-1), said(seq=1.0), said(seq=True), said(seq=2**60), said(echo=-1),
        said(on=1), said(device="mouse"), said(device=[]), said(view=1e9), said(grips=None), said(grips=[0]),
        said(grips=False), said(extra=1),
        said(targets=[100.0]), said(targets=None), said(device="\ud800"), said(echo=10**400),
        said(axes=[10**400]), said(view="\ud800"),
        answer(value=[]), answer(value={}), answer(value=float("nan")), answer(value=1e12),
        answer(value=2**70), answer(card=3), answer(item=None), answer(item="x" * 300), answer(more=1),
        answer(value="x" * 5000), answer(value="\ud800"), answer(card="\ud800"),
        '{"kind": "ask", "what": "mode", "value": "\\ud800"}',
        '{"kind": "ask", "what": "mask", "value": [' + "1" * 400 + "]}",
        said() + " " * LARGEST,
    ],
)  # fmt: skip
def test_anything_else_is_refused(text):
    with pytest.raises(HandrailError) as error:
        parse(text)
    assert len(str(error.value)) < 300


@given(st.one_of(st.text(max_size=200), st.binary(max_size=200)))
def test_any_message_gives_an_error_of_ours(text):
    with contextlib.suppress(HandrailError):
        parse(text)
