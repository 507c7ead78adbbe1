"""The law of a session's end: its pages hear of it, and are not there when the next participant begins."""

import json
from types import SimpleNamespace

import pytest
from cockpit_helpers import page, told
from page_recording import started
from user_study_helpers import study_folder

from handrail.collect.cockpit.pipe import Kind
from handrail.collect.user_study import run
from handrail.collect.user_study.config import StudySessionConfig
from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.forms import CONSENT, REFUSED
from handrail.controllers.errors import HandrailError


def answered(socket, item, value):
    """Answer an item of the card that is shown."""
    card = told(socket, "card")["card"]["id"]
    socket.send(json.dumps({"kind": "answer", "card": card, "item": item, "value": value}))


def test_all_pages_hear_that_a_session_is_over(tmp_path):
    study_folder(tmp_path)
    with started("user-study", "run", tmp_path, "P001") as (process, address, _):
        served = SimpleNamespace(address=address)
        with page(served, "of-the-participant") as driver, page(served, "of-the-researcher") as watcher:
            answered(driver, CONSENT, REFUSED)
            while not told(driver, "card")["card"]["answers"]:
                pass
            answered(driver, ":next", True)
            while not (last := told(driver, "card")["card"])["last"]:
                pass
            assert "Nothing is kept" in last["text"][0]  # it is shown before the end
            for each in (driver, watcher):
                assert told(each, "over")["over"] == {"participant": "P001", "trouble": ""}
        assert process.wait(60) == 0


def refuse(folder, who):
    raise HandrailError("the disk is full")


class KeepingServer:
    """Takes note of what pages would be told."""

    def __init__(self):
        self.sent, self.pipe = [], self

    def send_surely(self, kind, value, instead_of=()):
        self.sent.append((kind, value))

    def close(self):
        self.sent.append("closed")


def test_pages_hear_with_which_error_a_session_ended(tmp_path, monkeypatch):
    server = KeepingServer()
    study_folder(tmp_path)
    monkeypatch.setattr(run, "open_server", lambda config, say: server)
    monkeypatch.setattr(StudyFolder, "steps", refuse)
    with pytest.raises(HandrailError, match="the disk is full"):
        run.study_session(StudySessionConfig("run", str(tmp_path), "P001"))
    over = {"participant": "P001", "trouble": "the disk is full"}
    assert server.sent == [(Kind.OVER, over), "closed"]
