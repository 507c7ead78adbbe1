"""Neither a message nor a page names a flag that does not exist: every `--flag` is one of a command."""

import ast
import re
from collections.abc import Iterator
from dataclasses import fields

import pytest
from command_helpers import flags_of
from lerobot.configs.dataset import DatasetRecordConfig
from lerobot.configs.default import EvalConfig
from lerobot.envs.configs import EnvConfig
from lerobot.robots import RobotConfig
from lerobot.rollout.configs import DAggerStrategyConfig
from lerobot.teleoperators import TeleoperatorConfig
from pages import CONFIGS, PAGES, text
from places import FLOORS, ROOT, sources

import handrail.collect.lerobot.plugins  # noqa: F401

FLAG = re.compile(r"(?<![\w(-])--[a-z][\w.]*(?:-[a-z]\w*)*")
STYLE = ("var(--", 'style="')  # of a page: what begins with "--" there is a colour
OTHERS = {  # flags of other programs, by the word that the same text must say
    "--strategy.": "--strategy.type --strategy.smooth_handover --strategy.record_autonomous "
    "--strategy.keyboard.pause_resume --strategy.keyboard.correction",
    "lerobot-dataset-viz": "--repo-id --root --episode-index --save --output-dir",
    "lerobot-edit-dataset": "--repo_id --root --new_root --operation.type --operation.episode_indices",
    "lerobot.robots.lekiwi.lekiwi_host": "--host.connection_time_s",
    "--robot.type=lekiwi_client": "--robot.remote_ip --robot.cameras",
    "`--flag`": "--flag",
    "--config_path=": "--config_path",  # what LeRobot's training is given
    "accelerate launch": "--multi_gpu",
    "ray start": "--head --port --address --disable-usage-stats",
}
GROUPS = {"--human", "--arbitration", "--cockpit", "--teleop", "--client", "--dataset"}  # of flags: --human.*
# what starts Chromium, builds a wheel and the like
FOREIGN = {
    "controllers/core/building.py",
    "collect/session/viewer.py",
    "scripts/bench/latency/measure.py",
}
FOREIGN |= {"scripts/bench/soak/child.py", "scripts/bench/soak/notes.py"}


@pytest.fixture(scope="module")
def known() -> set[str]:
    """Our commands' flags, and LeRobot's about our plugins or that these have to agree with."""
    found = {"--version", "--help-all", *GROUPS}.union(*map(flags_of, CONFIGS))
    for part, kind in {"robot": RobotConfig, "teleop": TeleoperatorConfig, "env": EnvConfig}.items():
        found |= {f"--{part}.type", f"--{part}.discover_packages_path"}
        chosen = [each for name, each in kind.get_known_choices().items() if name.startswith("handrail")]
        found |= {f"--{part}.{entry.name}" for each in chosen for entry in fields(each)}
    found |= {f"--dataset.{entry.name}" for entry in fields(DatasetRecordConfig)}
    found |= {"--strategy.type", *(f"--strategy.{entry.name}" for entry in fields(DAggerStrategyConfig))}
    return found | {f"--eval.{entry.name}" for entry in fields(EvalConfig)}


def unknown(said: str, known: set[str]) -> set[str]:
    """Return the flags that a text names and that no program it speaks of has."""
    if any(mark in said for mark in STYLE):
        return set()
    others = {flag for program, flags in OTHERS.items() if program in said for flag in flags.split()}
    return {flag.rstrip(".") for flag in FLAG.findall(said)} - known - others


def texts(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the line and the words of every text; an f-string is whole, with … for its values."""
    formatted = [node for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)]
    inside = {id(part) for node in formatted for part in node.values}
    for node in formatted:
        parts = [part.value if isinstance(part, ast.Constant) else "…" for part in node.values]
        yield node.lineno, "".join(map(str, parts))
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inside:
            yield node.lineno, node.value


def test_every_flag_that_a_text_names_exists(known):
    assert unknown("--dataset.root --success_only --no_such", known) == {"--no_such"}
    wrong = []
    for path in (path for floor in FLOORS for path in sources(floor)):
        if (place := str(path.relative_to(ROOT))) not in FOREIGN:
            for line, said in texts(ast.parse(path.read_text())):
                wrong += [f"{place}:{line}: {flag}" for flag in unknown(said, known)]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("page", PAGES)
def test_every_flag_that_a_page_names_exists(page, known):
    """In code of its sentences; commands in blocks are parsed by another test."""
    prose = re.sub(r"^```.*?^```", "", text(page), flags=re.DOTALL | re.MULTILINE)
    assert set().union(*(unknown(span, known) for span in re.findall(r"`([^`\n]+)`", prose))) == set()
