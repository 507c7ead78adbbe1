"""README's commands can be pasted in order, into a fresh folder; with fewer episodes and steps."""

import subprocess
import sys
from pathlib import Path

import pytest
from command_helpers import command
from graphics import graphics_trouble
from readme_commands import NOT_RUN, made_small, readme_commands, small_study, takes_minutes

_DRAW = ("--cameras", "--video")


def run(words: list[str]) -> None:
    """Run one command; it must end well."""
    if words[0].startswith("handrail-"):
        done = command(*words[1:], name=words[0].removeprefix("handrail-").replace("-", "_"))
    else:
        beside = Path(sys.executable).parent / words[0]
        program = [str(beside) if beside.exists() else words[0], *words[1:]]
        done = subprocess.run(program, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"


def fresh(tmp_path, monkeypatch):
    """Go to a folder with nothing but what a clone has beside the code."""
    preset = tmp_path / "policies" / "study" / "design" / "presets" / "quick.toml"
    preset.parent.mkdir(parents=True)
    preset.write_text(small_study())
    monkeypatch.chdir(tmp_path)


def can_run(words: list[str]) -> bool:
    return words[0] not in NOT_RUN and not (set(_DRAW) & set(words) and graphics_trouble())


def test_the_main_path_can_be_pasted_in_order(tmp_path, monkeypatch):
    """Record, look, train, evaluate, compare: what no command before it made is not there."""
    fresh(tmp_path, monkeypatch)
    chosen = [words for words in readme_commands() if can_run(words) and not takes_minutes(words)]
    names = {words[0] for words in chosen}
    needed = {f"handrail-{name}" for name in ("record", "inspect", "replay", "train", "evaluate", "compare")}
    assert needed <= names
    for words in chosen:
        run(made_small(words))
    assert Path("outputs/compare/report.html").is_file()


@pytest.mark.slow
def test_every_command_can_be_pasted_in_order(tmp_path, monkeypatch):
    fresh(tmp_path, monkeypatch)
    for words in readme_commands():
        if can_run(words):
            run(made_small(words))


def test_what_is_not_run_is_no_command_of_ours():
    assert not [name for name in NOT_RUN if name.startswith(("handrail-", "lerobot-"))]
    assert set(NOT_RUN) <= {words[0] for words in readme_commands()}
