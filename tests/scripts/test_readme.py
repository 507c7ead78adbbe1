"""The commands of README and the pages can be pasted in order into a fresh folder; here with less of all."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from command_helpers import command
from graphics import graphics_trouble
from places import ROOT
from readme_commands import MAIN, NOT_RUN, PAGES, made_small, page_commands, small_study, takes_minutes

_DRAW = ("--cameras", "--video")


def run(words: list[str]) -> None:
    """Run one command; it must end well."""
    if words[0].startswith(("handrail-", "bench ")):
        done = command(*words[1:], name=words[0].removeprefix("handrail-"))
    else:
        beside = Path(sys.executable).parent / words[0]
        program = [str(beside) if beside.exists() else words[0], *words[1:]]
        done = subprocess.run(program, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"


def fresh(tmp_path, monkeypatch):
    """Go to a folder with nothing but what a clone has beside the code."""
    preset = tmp_path / "policies" / "study" / "presets" / "quick.toml"
    preset.parent.mkdir(parents=True)
    preset.write_text(small_study())
    monkeypatch.chdir(tmp_path)


def can_run(words: list[str]) -> bool:
    return words[0] not in NOT_RUN and not (set(_DRAW) & set(words) and graphics_trouble())


def commands_of(pages):
    """Return the commands of some pages that can be run here, each once: a page may repeat another's."""
    found = []
    for words in (words for page in pages for words in page_commands(page)):
        if can_run(words) and words not in found:
            found.append(words)
    return found


def test_the_main_path_can_be_pasted_in_order(tmp_path, monkeypatch):
    """Record, look, train, evaluate, compare: what no command before it made is not there."""
    fresh(tmp_path, monkeypatch)
    chosen = [words for words in commands_of(MAIN) if not takes_minutes(words)]
    needed = {f"handrail-{name}" for name in ("record", "inspect", "replay", "train", "evaluate", "compare")}
    assert needed <= {words[0] for words in chosen}
    for words in chosen:
        run(made_small(words))
    assert Path("outputs/compare/report.html").is_file()


@pytest.mark.slow
def test_every_command_can_be_pasted_in_order(tmp_path, monkeypatch):
    fresh(tmp_path, monkeypatch)
    for words in commands_of(PAGES):
        run(made_small(words))


def test_what_is_not_run_is_no_command_of_ours():
    assert not [name for name in NOT_RUN if name.startswith(("handrail-", "lerobot-"))]
    assert set(NOT_RUN) <= {words[0] for page in PAGES for words in page_commands(page)}


def test_every_page_with_commands_is_pasted():
    pages = {str(path.relative_to(ROOT)) for path in (ROOT / "docs").glob("*.md")} | {"README.md"}
    assert {page for page in pages if page_commands(page)} == set(PAGES)


def test_a_line_is_one_command():
    lines = [words for page in PAGES for words in page_commands(page)]
    assert not [words for words in lines if {"&&", "||", "|", ";", "&", ">"} & set(words)]


def test_the_readme_s_python_runs_and_the_base_makes_way(capsys):
    readme = (ROOT / "README.md").read_text()
    (source,) = re.findall(r"^```python\n(.*?)^```", readme, re.DOTALL | re.MULTILINE)
    exec(compile(source, "README.md", "exec"), {})
    shown = re.fullmatch(r"base \[\S+ +(\S+)\], hand .*, ok\n", capsys.readouterr().out)
    assert shown is not None
    assert float(shown[1]) < -0.2  # it went round the pillar
