"""Laws: what is said once gets through a full pipe, in order and whole; the rest is dropped and counted."""

import pytest

from handrail.collect.cockpit.pipe import LARGEST, Kind
from handrail.controllers.errors import HandrailError


def fill(pipe, kind=Kind.DRIVE):
    while pipe.send(kind, b"x" * 300):
        pass


def test_a_long_message_arrives_whole(ends):
    ours, theirs = ends
    data = bytes(range(256)) * 4000
    assert ours.send(Kind.PICTURE, data)
    found = []
    while not found:
        found = theirs.receive()
        ours.flush()
    assert found == [(Kind.PICTURE, data)]


def test_messages_said_once_wait_for_room(ends):
    ours, theirs = ends
    fill(ours)
    ours.send_surely(Kind.ASK, b"first")
    ours.send_surely(Kind.ASK, b"second")
    assert not ours.flush()
    inputs = len(theirs.receive())
    assert inputs
    assert ours.flush()
    assert theirs.receive() == [(Kind.ASK, b"first"), (Kind.ASK, b"second")]
    assert ours.dropped == {Kind.DRIVE: 1}


def test_no_newer_input_overtakes_what_waits(ends):
    ours, theirs = ends
    fill(ours)
    ours.send_surely(Kind.LOST, None)
    theirs.receive()
    assert ours.send(Kind.DRIVE, b"newer")
    assert theirs.receive() == [(Kind.LOST, None), (Kind.DRIVE, b"newer")]


def test_a_stop_takes_the_place_of_what_waits(ends):
    ours, theirs = ends
    fill(ours)
    for number in range(500):
        ours.send_surely(Kind.ASK, b"%d" % number)
    assert ours.dropped[Kind.ASK] > 0
    for _ in range(500):
        ours.send_surely(Kind.LOST, None, (Kind.LOST, Kind.ASK))
        ours.send_surely(Kind.STOP, None, (Kind.STOP, Kind.ASK))
    theirs.receive()
    assert ours.flush()
    assert theirs.receive() == [(Kind.STOP, None), (Kind.LOST, None)]


def test_messages_that_take_motion_away_are_never_dropped(ends):
    ours, theirs = ends
    fill(ours)
    for number in range(500):
        ours.send_surely(Kind.ANSWER, b"%d" % number)
    taking = [
        (Kind.STOP, None),
        (Kind.LOST, None),
        (Kind.STILL, b"success"),
        (Kind.STILL, b"quit"),
        (Kind.DRIVE, b"let go"),
    ]
    for _ in range(2):
        for kind, data in reversed(taking):
            ours.send_surely(kind, data)
    theirs.receive()
    while not ours.flush():
        pass
    found = [each for each in theirs.receive() if each[0] != Kind.ANSWER]
    assert found[0] == (Kind.STOP, None)
    assert sorted(found) == sorted(taking)


def test_frames_that_clog_one_way_leave_the_other_free(ends):
    recording, web = ends
    fill(recording, Kind.FRAME)
    web.send_surely(Kind.STOP, None, (Kind.STOP, Kind.ASK))
    assert recording.receive() == [(Kind.STOP, None)]


def test_the_newest_scene_replaces_one_that_waits(ends):
    ours, theirs = ends
    fill(ours, Kind.FRAME)
    for number in range(100):
        ours.send_surely(Kind.STAGE, b"%d" % number * 50_000, (Kind.STAGE,))
    found = []
    while not ours.flush() or not found:
        found += [data for kind, data in theirs.receive() if kind == Kind.STAGE]
    assert found == [b"99" * 50_000]


def test_too_large_messages_are_dropped_and_end_nothing(ends):
    ours, theirs = ends
    assert not ours.send(Kind.PICTURE, b"x" * (LARGEST + 1))
    assert ours.send(Kind.DRIVE, b"x")
    assert theirs.receive() == [(Kind.DRIVE, b"x")]


def test_an_end_that_is_gone_is_told(ends):
    ours, theirs = ends
    theirs.send(Kind.DRIVE, b"last")
    theirs.close()
    assert ours.send(Kind.FRAME, b"")
    assert ours.receive() == [(Kind.DRIVE, b"last")]
    with pytest.raises(HandrailError, match="gone"):
        ours.receive()


def test_the_last_words_of_an_end_that_is_gone_are_heard_whatever_it_left_unread(ends):
    """The system tells the reset of the connection before them."""
    ours, theirs = ends
    for _ in range(3):
        ours.send(Kind.FRAME, b"")
    theirs.send_surely(Kind.STOP)
    theirs.close()
    assert ours.receive() == [(Kind.STOP, None)]
    for _ in range(2):
        with pytest.raises(HandrailError, match="gone"):
            ours.receive()
