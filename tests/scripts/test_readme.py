"""The commands of README and the pages can be pasted in order into a fresh folder; here with less of all."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from command_helpers import command
from graphics import graphics_trouble
from pages import PAGES, commands, text
from places import ROOT

READ_ON = ("recording", "large_datasets", "training", "evaluation", "comparison")
MAIN = ("README.md", *(f"docs/{name}.md" for name in READ_ON))
SMALL = {  # what a command gets, given on the page or not
    "handrail-demo": "--episodes 1",
    "handrail-record": "--dataset.num_episodes 2",
    "handrail-train": "--steps 4 --batch_size 4 --device cpu",
    "handrail-encoder": "--updates 2 --batch_size 2",
    "handrail-evaluate": "--episodes 2 --time_limit 1 --workers 1",
    "bench operators": "--episodes 1 --workers 1",
    "bench goal_reaching": "--goals 2 --workers 1",
    "bench cases": "--seconds 1",
    "bench speed": "--updates 10 --solves 1 --tasks reach --degrees 9 --pairs 0 --horizons 10 --peers daqp",
    "bench rl": "--steps 60 --random_steps 20 --save_every 30 --goals 1 --final_goals 1 --layers 8",
    "lerobot-train": "--steps 4 --batch_size 4 --num_workers 0",
}
WHERE_GIVEN = {"handrail-train": "--episodes 1 --minutes 0.1", "handrail-study": "--workers 2"}
PRESET = "policies/study/presets/quick.toml"
STUDIES = {each.stem for each in (ROOT / "policies/study/presets").glob("*.toml")}
LESS_STUDY = {"rollouts": "2", "persons": "1", "episodes": "2", "minutes": "0.3", "steps": "4"}
NOT_RUN = {
    "make": "sets up and tests this very clone",
    ".": "makes the environment that the test runs in the shell's own",
    "python": "runs the examples, which have a test of their own",
    "pip": "needs the network",
    "apt-get": "needs the network and the administrator",
    "tensorboard": "runs until Ctrl-C",
}


def made_small(words: list[str]) -> list[str]:
    """Return a command with fewer episodes, steps and the like, and studies by a small design."""
    name, *words = [PRESET if word in STUDIES else word for word in words]
    for given, flags in ((False, SMALL), (True, WHERE_GIVEN)):
        pairs = flags.get(name, "").split()
        for flag, value in zip(pairs[::2], pairs[1::2], strict=True):
            there = [place for place, word in enumerate(words) if word.split("=")[0] == flag]
            if there and "=" in words[there[0]]:
                words[there[0]] = f"{flag}={value}"
            elif there:
                words[there[0] + 1] = value
            elif not given:
                words += [f"{flag}={value}"] if name.startswith("lerobot-") else [flag, value]
    return [name, *words]


def run(words: list[str]) -> None:
    """Run one command; it must end well."""
    name, *rest = made_small(words)
    if name.startswith(("handrail-", "bench ")):
        done = command(*rest, name=name.removeprefix("handrail-"))
    else:
        beside = Path(sys.executable).parent / name
        program = [str(beside) if beside.exists() else name, *rest]
        done = subprocess.run(program, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"


def commands_of(pages) -> list[list[str]]:
    """Return the commands of some pages that can be run here, each once: a page may repeat another's."""
    drawn = {"--cameras", "--video"} if graphics_trouble() else set()
    found = []
    for words in commands("", pages, "sh"):
        if words[0] not in NOT_RUN and not drawn.intersection(words) and words not in found:
            found.append(words)
    return found


@pytest.fixture
def _fresh(tmp_path, monkeypatch):
    """A folder with nothing but a design of a study, with less of everything."""
    design = text(PRESET)
    for name, value in LESS_STUDY.items():
        design = re.sub(rf"^{name} = .*", f"{name} = {value}", design, flags=re.MULTILINE)
    (tmp_path / PRESET).parent.mkdir(parents=True)
    (tmp_path / PRESET).write_text(design)
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("_fresh")
def test_the_readme_s_commands_can_be_pasted_in_order():
    """Record, look, train, evaluate, compare: what no command before it made is not there."""
    chosen = commands_of(["README.md"])
    needed = {f"handrail-{name}" for name in ("record", "inspect", "train", "evaluate", "compare")}
    assert needed == {words[0] for words in chosen}
    for words in chosen:
        run(words)
    assert Path("outputs/compare/report.html").is_file()


@pytest.mark.slow
@pytest.mark.usefixtures("_fresh")
def test_every_command_can_be_pasted_in_order():
    for words in commands_of((*MAIN, *PAGES)):
        run(words)


def test_a_line_is_one_command():
    lines = commands("", PAGES, "sh")
    assert not [words for words in lines if {"&&", "||", "|", ";", "&", ">"} & set(words)]


def test_the_readme_s_python_runs_and_the_base_makes_way(capsys):
    (source,) = re.findall(r"^```python\n(.*?)^```", text("README.md"), re.DOTALL | re.MULTILINE)
    exec(compile(source, "README.md", "exec"), {})
    shown = re.fullmatch(r"base \[\S+ +(\S+)\], hand .*, ok\n", capsys.readouterr().out)
    assert shown is not None
    assert float(shown[1]) < -0.2  # it went round the pillar
