"""What the documents say is true: commands parse, links lead somewhere, tables are complete."""

import importlib
import re
import shlex
import tomllib
import warnings
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import pytest
from command_helpers import command
from configs import BENCH_CONFIGS, CONFIGS
from places import ROOT
from readme_commands import joined

from handrail.collect.config import (
    RecordConfig,
    SessionConfig,
)
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_env, session_features
from handrail.collect.session.perturbations import DEFAULTS
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.interface.command import Status
from handrail.datasets.quality.catalogue import METRICS
from handrail.policies.imitation.evaluation.config import PROTECTIONS
from handrail.scripts import cli
from handrail.scripts.bench.goal_reaching.catalogue import BASELINES
from handrail.scripts.bench.goal_reaching.config import PROFILES

PAGES = ("README.md", *sorted(str(path.relative_to(ROOT)) for path in (ROOT / "docs").glob("*.md")))
RESULTS = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "docs" / "results").glob("*.md"))
DOCUMENTS = (*PAGES, "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", *RESULTS)
LONGEST_README = 150  # lines
ROOMS = "controllers|datasets|collect|policies|scripts|tests|docs"


def text(document: str) -> str:
    return (ROOT / document).read_text()


def command_lines(document: str) -> Sequence[str]:
    """Return the lines of the shell blocks, continued lines joined, comments left out."""
    blocks = re.findall(r"^```(?:sh|bash|console)\n(.*?)^```", text(document), flags=re.DOTALL | re.MULTILINE)
    return "\n".join(blocks).replace("\\\n", " ").splitlines()


def commands(prefix: str, documents: Sequence[str] = DOCUMENTS) -> list[list[str]]:
    lines = [
        joined(shlex.split(line, comments=True)) for document in documents for line in command_lines(document)
    ]
    return [words for words in lines if words and words[0].startswith(prefix)]


def section(page: str, heading: str) -> str:
    return text(f"docs/{page}.md").split(f"\n## {heading}\n")[1].split("\n## ")[0]


def table(page: str, heading: str) -> set[str]:
    """Return the code words of the first column of a page's tables under a heading."""
    return {
        name
        for row in re.findall(r"^\| (`.*?) \|", section(page, heading), re.MULTILINE)
        for name in re.findall("`(.*?)`", row)
    }


def test_every_command_is_known_and_shown():
    assert {words[0] for words in commands("handrail-", PAGES)} == set(CONFIGS)
    assert {words[0] for words in commands("bench ")} == set(BENCH_CONFIGS) - {"bench soak"}  # make soak


@pytest.mark.parametrize("words", [*commands("handrail-"), *commands("bench ")], ids=" ".join)
def test_commands_parse(words):
    config = cli.parse((CONFIGS | BENCH_CONFIGS)[words[0]], words[0], words[1:])
    if isinstance(config, SessionConfig):
        config.check()


def test_lerobot_s_own_parser_takes_the_training_commands():
    training = [words[1:] for words in commands("lerobot-train")]
    kinds = {word for words in training for word in words if word.startswith("--policy.type=")}
    assert kinds == {"--policy.type=act", "--policy.type=diffusion"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import draccus
        from lerobot.configs.train import TrainPipelineConfig
        from lerobot.policies.act import configuration_act  # noqa: F401  (registered by their import)
        from lerobot.policies.diffusion import configuration_diffusion  # noqa: F401

        policies: list[Any] = [
            draccus.parse(TrainPipelineConfig, args=arguments).policy for arguments in training
        ]
    recorded = chain.from_iterable(commands("lerobot-record"))
    own = {word for word in recorded if word.startswith("--dataset.root=")}
    for arguments, policy in zip(training, policies, strict=True):
        if own.intersection(arguments):
            continue  # what LeRobot records has no state of the environment
        assert "ENV" in policy.normalization_mapping, "the environment's state would not be normalised"
        assert not policy.push_to_hub


def test_make_targets_exist():
    targets = set(re.findall(r"^([a-z]+):", text("Makefile"), re.MULTILINE))
    assert {"setup", "demo", "test", "check", "format"} <= targets
    assert {words[1] for words in commands("make")} <= targets
    assert {words[1] for words in commands("make", ["README.md"])} == {"demo", "test"}


def anchors(document: Path) -> set[str]:
    """Return what a link can lead to in a document: its headings, as GitHub calls them."""
    headings = re.findall(r"^#+ (.*)$", document.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS)
def test_links_lead_somewhere(document):
    here = ROOT / document
    links = re.findall(r"\]\(([^)\s]+)\)|src=\"([^\"]+)\"", text(document))
    for link in ("".join(pair) for pair in links):
        if not link.startswith(("http", "mailto")):
            file, _, anchor = link.partition("#")
            target = here.parent / file if file else here
            assert target.exists(), link
            assert not anchor or anchor in anchors(target), link


def test_every_page_is_reached_from_the_readme():
    for page in PAGES[1:]:
        assert f"({page})" in text("README.md"), page
    for page in RESULTS:
        assert f"(results/{Path(page).name})" in text("docs/results.md"), page


def test_the_readme_is_short():
    assert len(text("README.md").splitlines()) <= LONGEST_README


@pytest.mark.parametrize("document", [*PAGES, "CONTRIBUTING.md", "SECURITY.md"])
def test_operators_are_they(document):
    assert not re.search(r"\b(he|him|his|himself)\b", text(document), re.IGNORECASE)


def test_names_of_the_api_page_can_be_imported():
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \| `(handrail[\w.]+)` \|", text("docs/api.md"), re.MULTILINE)
    assert len(rows) >= 8
    for names, module in rows:
        for name in re.findall(r"\w+", names):
            assert hasattr(importlib.import_module(module), name), f"{module}.{name}"


@pytest.mark.parametrize("document", DOCUMENTS)
def test_files_that_are_named_are_there(document):
    named = re.findall(rf"`((?:{ROOMS})/[\w/.]+)`", text(document))
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_rooms_are_all_there():
    floors = ("controllers", "datasets", "collect", "policies")
    for floor in floors:
        (row,) = re.findall(rf"^\| `{floor}/` \| (`.*) \|$", section("architecture", "Rooms"), re.MULTILINE)
        rooms = {path.name for path in (ROOT / floor).iterdir() if any(path.rglob("*.py"))}
        assert set(re.findall("`(.*?)`", row)) == rooms


def test_modes_tasks_and_cameras_are_all_there():
    from handrail.collect.config import CAMERAS

    assert table("concepts", "Teleop modes") == set(MODES)
    assert table("concepts", "Tasks") == set(TASKS)
    assert all(f"`{camera}`" in text("docs/recording.md") for camera in CAMERAS)


def test_controllers_and_profiles_of_the_benchmark_are_all_there():
    assert table("benchmark", "Goal reaching") == set(BASELINES) | set(PROFILES)
    shown = command("--help", name="bench goal_reaching").stdout
    assert all(re.search(rf"\b{name}\b", shown) for name in (*BASELINES, *PROFILES))


def test_protections_and_perturbations_are_all_there():
    assert table("evaluation", "Protect and disturb") == {*PROTECTIONS, *DEFAULTS, "none"}


def test_metrics_are_all_there():
    assert table("comparison", "Quality metrics") == {metric.name for metric in METRICS}


def flags(config: type, prefix: str = "") -> set[str]:
    names = set()
    for entry in fields(config):
        nested = entry.default_factory if is_dataclass(entry.default_factory) else None
        flag = "FOLDER" if entry.name == "place" else f"--{prefix}{entry.name}"
        names |= flags(nested, f"{prefix}{entry.name}.") if nested else {flag}
    return names


def test_flags_are_all_there():
    shown = {name.split(" ")[0] for name in table("recording", "Flags of `handrail-record`")}
    groups = re.compile(r"--(human|cockpit|teleop|client)\..*")
    assert shown == {groups.sub(r"--\1.*", name) for name in flags(RecordConfig)}


def test_columns_are_all_there():
    env = build_env(SessionConfig(task="reach"), 20)
    columns = {*session_features(env), "observation.images.*"}
    env.close()
    assert table("recording", "What is recorded") == columns


def test_exit_codes_and_statuses_are_all_there():
    codes = {"0", str(cli.FAILED), str(cli.BAD_INPUT), str(cli.INTERRUPTED)}
    assert table("recording", "Exit codes") == codes
    assert table("safety", "When the robot brakes") == {status.value for status in Status}


def test_the_version_is_in_the_changelog():
    version = tomllib.loads(text("pyproject.toml"))["project"]["version"]
    assert f"\n## {version}" in text("CHANGELOG.md")
