"""Laws: what is said once gets through a full pipe, in order and whole; the rest is dropped and counted."""

from contextlib import suppress

import pytest

from handrail.collect.cockpit.pipe import (
    ANSWER,
    ASK,
    DRIVE,
    FRAME,
    LARGEST,
    LOST,
    PICTURE,
    STAGE,
    STILL,
    STOP,
    Pipe,
)
from handrail.controllers.errors import HandrailError


@pytest.fixture
def ends():
    both = [Pipe(end) for end in Pipe.pair()]
    yield both
    for each in both:
        each.close()


def fill(pipe, kind=DRIVE):
    while pipe.send(kind, b"x" * 300):
        pass


def test_a_long_message_arrives_whole(ends):
    ours, theirs = ends
    data = bytes(range(256)) * 4000
    assert ours.send(PICTURE, data)
    found = []
    while not found:
        found = theirs.receive()
        ours.flush()
    assert found == [(PICTURE, data)]


def test_what_is_said_once_waits_for_room(ends):
    ours, theirs = ends
    fill(ours)
    ours.send_surely(ASK, b"first")
    ours.send_surely(ASK, b"second")
    assert not ours.flush()
    inputs = len(theirs.receive())
    assert inputs
    assert ours.flush()
    assert theirs.receive() == [(ASK, b"first"), (ASK, b"second")]
    assert ours.dropped == {DRIVE: 1}


def test_no_newer_input_overtakes_what_waits(ends):
    ours, theirs = ends
    fill(ours)
    ours.send_surely(LOST, b"")
    theirs.receive()
    assert ours.send(DRIVE, b"newer")
    assert theirs.receive() == [(LOST, b""), (DRIVE, b"newer")]


def test_a_stop_takes_the_place_of_what_waits(ends):
    ours, theirs = ends
    fill(ours)
    for number in range(500):
        ours.send_surely(ASK, b"%d" % number)
    assert ours.dropped[ASK] > 0
    for _ in range(500):
        ours.send_surely(LOST, b"", (LOST, ASK))
        ours.send_surely(STOP, b"", (STOP, ASK))
    theirs.receive()
    assert ours.flush()
    assert theirs.receive() == [(STOP, b""), (LOST, b"")]


def test_what_takes_motion_away_is_never_dropped(ends):
    ours, theirs = ends
    fill(ours)
    for number in range(500):
        ours.send_surely(ANSWER, b"%d" % number)
    taking = [(STOP, b""), (LOST, b""), (STILL, b"success"), (STILL, b"quit"), (DRIVE, b"let go")]
    for _ in range(2):
        for kind, data in reversed(taking):
            ours.send_surely(kind, data)
    theirs.receive()
    while not ours.flush():
        pass
    found = [each for each in theirs.receive() if each[0] != ANSWER]
    assert found[0] == (STOP, b"")
    assert sorted(found) == sorted(taking)


def test_frames_that_clog_one_way_leave_the_other_free(ends):
    recording, web = ends
    fill(recording, FRAME)
    web.send_surely(STOP, b"", (STOP, ASK))
    assert recording.receive() == [(STOP, b"")]


def test_the_newest_scene_replaces_one_that_waits(ends):
    ours, theirs = ends
    fill(ours, FRAME)
    for number in range(100):
        ours.send_surely(STAGE, b"%d" % number * 50_000, (STAGE,))
    found = []
    while not ours.flush() or not found:
        found += [data for kind, data in theirs.receive() if kind == STAGE]
    assert found == [b"99" * 50_000]


def test_what_is_too_large_is_dropped_and_ends_nothing(ends):
    ours, theirs = ends
    assert not ours.send(PICTURE, b"x" * (LARGEST + 1))
    assert ours.send(DRIVE, b"x")
    assert theirs.receive() == [(DRIVE, b"x")]


def test_an_end_that_is_gone_is_told(ends):
    ours, theirs = ends
    theirs.send(DRIVE, b"last")
    theirs.close()
    with suppress(HandrailError):
        ours.send(FRAME, b"")
    assert ours.receive() == [(DRIVE, b"last")]
    with pytest.raises(HandrailError, match="gone"):
        ours.receive()
