"""Laws of the help: `handrail` lists the commands and takes them as words; help has two layers."""

import re
import sys

import pytest
from command_helpers import command, flags_of
from pages import COMMAND_CONFIGS

from handrail.collect.operators.modes import MODES
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.scripts.__main__ import main
from handrail.scripts.commands import COMMANDS, GROUPS


def said(capsys, monkeypatch, *words):
    """Return what `handrail WORDS` prints."""
    monkeypatch.setattr(sys, "argv", ["handrail", *words])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert not stopped.value.code
    return capsys.readouterr().out


def test_handrail_alone_lists_the_commands_by_what_a_person_wants(capsys, monkeypatch):
    shown = said(capsys, monkeypatch)
    places = [shown.index(f"\n{group}\n") for group in GROUPS]
    assert places == sorted(places)
    for name, each in COMMANDS.items():
        assert f"  {name:10}  {each.help}\n" in shown


def test_commands_are_words_too(capsys, monkeypatch):
    assert said(capsys, monkeypatch, "record", "--version").startswith("handrail record ")
    assert "--episodes" in said(capsys, monkeypatch, "edit", "delete", "--help")


@pytest.mark.parametrize(
    ("name", "first", "advanced"),
    [
        ("record", "--task", "--mask"),
        ("cockpit", "--task", "--mask"),
        ("train", "--steps", "--lr"),
        ("compare", "--by", "--margin"),
    ],
)
def test_help_shows_the_fewer_flags_of_those_that_help_all_shows(name, first, advanced):
    few, every = flags_of(name, "--help"), flags_of(name)
    assert few < every
    assert first in few
    assert advanced in every - few


def texts(name):
    """Return the help of each flag of a command, as far as its first line."""
    shown = command("--help-all", name=name.removeprefix("handrail-")).stdout
    found = re.findall(r"^[│ ] (--[a-z]\S+).*?(?:  +| *│?\n[│ ] {5,})([^│\s].*)$", shown, re.MULTILINE)
    assert len(found) == len(re.findall(r"^[│ ] --[a-z]", shown, re.MULTILINE))
    return dict(found)


@pytest.mark.parametrize("name", COMMAND_CONFIGS)
def test_each_help_begins_as_a_sentence_does(name):
    wrong = {
        flag: said for flag, said in texts(name).items() if not re.match("(?!Who|What|Over|Of )[A-Z]", said)
    }
    assert wrong == {}


def test_each_robot_has_a_help_of_its_own_and_so_has_an_entry_of_ours_that_is_installed():
    assert len({spec.help for spec in ROBOTS.built_in} - {""}) == len(ROBOTS.built_in)
    assert "; rl: " in MODES.help


def test_the_cockpit_s_help_shows_no_flag_that_cannot_matter_there():
    every, meaningless = flags_of("cockpit"), ("--operator", "--noise", "--human.", "--teleop.", "--realtime")
    assert not [flag for flag in every if flag.startswith((*meaningless, "--client.", "--workers", "--ray"))]
    assert "--cockpit.port" in every
