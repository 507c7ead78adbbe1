"""What the documents say is true: commands parse, links lead somewhere, tables are complete."""

import importlib
import re
import warnings
from dataclasses import fields, is_dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

import pytest
from pages import BENCH_CONFIGS, COMMAND_CONFIGS, CONFIGS, DOCUMENTS, PAGES, RESULTS, commands, text
from places import ROOT, sources

from handrail.collect.commands.record import record
from handrail.collect.config import DatasetConfig, RecordConfig, SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_env, session_features
from handrail.collect.session.perturbations import DEFAULTS
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.interface.command import Status
from handrail.datasets.format.metadata import is_extra
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.reading.reader import read_episodes
from handrail.datasets.recording.frames import SHARED_COLUMNS
from handrail.policies.imitation.evaluation.config import PROTECTIONS
from handrail.scripts import cli
from handrail.scripts.bench.goal_reaching.config import BASELINES, PROFILES

FLOORS = ("controllers", "datasets", "collect", "policies")
FILE = re.compile(rf"`((?:{'|'.join(FLOORS)}|scripts|tests|docs)/[\w/.]+)`")


def test_every_command_is_known_and_shown():
    assert {words[0] for words in commands("handrail-", PAGES)} == COMMAND_CONFIGS.keys()
    assert {words[0] for words in commands("bench ")} == BENCH_CONFIGS.keys() - {"bench soak"}  # make soak


@pytest.mark.parametrize("words", [*commands("handrail-"), *commands("bench ")], ids=" ".join)
def test_commands_parse(words):
    config = cli.parse(CONFIGS[words[0]], words[0], words[1:])
    if isinstance(config, SessionConfig):
        config.check()


def test_no_command_of_a_page_for_users_overwrites_our_results():
    assert not [words for words in commands(pages=PAGES) if "docs/results/" in " ".join(words)]


def test_lerobot_s_own_parser_takes_the_training_commands():
    recorded_by_lerobot = {
        word
        for word in chain(*commands("lerobot-record"), *commands("lerobot-rollout"))
        if word.startswith("--dataset.root=")
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import draccus
        from lerobot.configs.train import TrainPipelineConfig
        from lerobot.policies.act import configuration_act  # noqa: F401  (registered by their import)
        from lerobot.policies.diffusion import configuration_diffusion  # noqa: F401

        for _, *words in commands("lerobot-train"):
            policy: Any = draccus.parse(TrainPipelineConfig, args=words).policy
            if not recorded_by_lerobot.intersection(words):  # that has no state of the environment
                assert "ENV" in policy.normalization_mapping, "its state would not be normalised"
                assert not policy.push_to_hub


DATASETS = ("record", "cockpit", "demo", "edit delete", "edit keep", "edit merge", "edit trim", "edit render")
KINDS = {
    **{f"handrail-{name}": "dataset" for name in DATASETS},
    **dict.fromkeys(("lerobot-record", "lerobot-rollout"), "dataset"),
    **dict.fromkeys(("handrail-train", "lerobot-train"), "policy"),
    "handrail-edit split": "datasets",
    "handrail-encoder": "encoder",
    "handrail-compare": "report",
    "handrail-study": "study",
}


def written(words: list[str]) -> str:
    """Return the folder or file that a command writes, "" where it names none."""
    name, *rest = words
    if name.startswith("lerobot-"):
        flag = "--output_dir=" if name == "lerobot-train" else "--dataset.root="
        return next((word.removeprefix(flag) for word in rest if word.startswith(flag)), "")
    if name in ("handrail-record", "handrail-cockpit", "handrail-demo"):
        return rest[0] if rest and not rest[0].startswith("--") else ""
    return rest[rest.index("--output") + 1] if "--output" in rest else ""


def test_no_two_kinds_of_things_have_one_place():
    """The commands of the pages can be pasted in order: no dataset is where another page puts a study."""
    found: dict[str, set[str]] = {}
    for words in commands():
        if words[0] in KINDS and (place := written(words)):
            found.setdefault(place, set()).add(KINDS[words[0]])
    assert set(KINDS.values()) == set(chain(*found.values()))
    assert {place: kinds for place, kinds in found.items() if len(kinds) > 1} == {}


def test_make_targets_exist():
    targets = set(re.findall(r"^([a-z]+):", text("Makefile"), re.MULTILINE))
    assert {words[1] for words in commands("make")} <= targets


def anchors(document: Path) -> set[str]:
    """Return what a link can lead to in a document: its headings, as GitHub calls them."""
    headings = re.findall(r"^#+ (.*)$", document.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS)
def test_links_lead_somewhere_and_files_are_there(document):
    here = ROOT / document
    assert [path for path in FILE.findall(text(document)) if not (ROOT / path).exists()] == []
    for link in ("".join(pair) for pair in re.findall(r"\]\(([^)\s]+)\)|src=\"([^\"]+)\"", text(document))):
        if not link.startswith(("http", "mailto")):
            file, _, anchor = link.partition("#")
            target = here.parent / file if file else here
            assert target.exists(), link
            assert not anchor or anchor in anchors(target), link


def test_every_page_is_reached_from_the_readme():
    assert [page for page in PAGES[1:] if f"({page})" not in text("README.md")] == []
    assert [page for page in RESULTS if f"(results/{Path(page).name})" not in text("docs/results.md")] == []


def test_names_of_the_api_page_can_be_imported():
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \| `(handrail[\w.]+)` \|", text("docs/api.md"), re.MULTILINE)
    told: dict[str, set[str]] = {}
    for names, module in rows:
        told.setdefault(module, set()).update(re.findall(r"\w+", names))
    for module, names in told.items():
        found = importlib.import_module(module)
        assert names <= {*dir(found), *getattr(found, "__all__", ())}, module
        assert names == {*getattr(found, "__all__", names)}, module
    assert {"handrail.controllers", "handrail.collect"} <= told.keys()


def test_rooms_are_all_there():
    for floor in FLOORS:
        (row,) = re.findall(rf"^\| `{floor}/` \| (`.*) \|$", text("docs/architecture.md"), re.MULTILINE)
        rooms = {path.name for path in (ROOT / floor).iterdir() if any(path.rglob("*.py"))}
        assert set(re.findall("`(.*?)`", row)) == rooms


def flags(config: type, prefix: str = "") -> set[str]:
    """Return the flags of a config; a device's and a person's are one row of the table."""
    names = set()
    for entry in fields(config):
        nested = entry.default_factory if is_dataclass(entry.default_factory) else None
        if nested and entry.name in ("human", "cockpit", "teleop", "client", "arbitration"):
            names.add(f"--{entry.name}.*")
        elif nested:
            names |= flags(nested, f"{prefix}{entry.name}.")
        else:
            names.add("FOLDER" if entry.name == "place" else f"--{prefix}{entry.name}")
    return names


def columns() -> set[str]:
    env = build_env(SessionConfig(task="reach"), 20)
    found = {*session_features(env), "observation.images.*"}
    env.close()
    return found


TABLES = {
    ("concepts", "Teleop modes"): lambda: {*MODES},
    ("concepts", "Tasks"): lambda: {*TASKS},
    ("benchmark", "Goal reaching"): lambda: {*BASELINES, *PROFILES},
    ("evaluation", "Protect and disturb"): lambda: {*PROTECTIONS, *DEFAULTS, "none"},
    ("comparison", "Quality metrics"): lambda: {metric.name for metric in METRICS},
    ("recording", "Flags of `handrail-record`"): lambda: flags(RecordConfig),
    ("recording", "Recorded columns"): columns,
    ("takeover", "Recorded columns, and training on them"): lambda: {c.name for c in SHARED_COLUMNS},
    ("recording", "Exit codes"): lambda: set(map(str, (0, cli.FAILED, cli.BAD_INPUT, cli.INTERRUPTED))),
    ("safety", "When the robot brakes"): lambda: {status.value for status in Status},
}


@pytest.mark.parametrize(("page", "heading"), TABLES)
def test_a_table_s_first_column_is_complete(page, heading):
    section = text(f"docs/{page}.md").split(f"\n## {heading}\n")[1].split("\n## ")[0]
    rows = re.findall(r"^\| (`.*?) \|", section, re.MULTILINE)
    named = {name.split(" ")[0] for row in rows for name in re.findall("`(.*?)`", row)}
    assert named == TABLES[page, heading]()


def test_every_column_of_an_episode_s_metadata_is_named(tmp_path):
    config = RecordConfig(task="reach", dataset=DatasetConfig(place=str(tmp_path / "d"), num_episodes=1))
    record(replace(config, physics=False))
    section = text("docs/recording.md").split("\n## Recorded columns\n")[1].split("\n## ")[0]
    (row,) = read_episodes(tmp_path / "d")
    extras = {name for name in row if is_extra(name)}
    assert {"environment", "brakes", "late"} <= extras
    assert extras - {*re.findall("`(.*?)`", section)} == set()


def test_a_status_of_lerobot_record_is_said_by_its_number():
    (said,) = re.findall(r"`status` \((.*?)\)", text("docs/lerobot.md"), re.DOTALL)
    assert re.findall(r"(\d+)\s+`(\w+)`", said) == [(str(n), status.value) for n, status in enumerate(Status)]


@pytest.mark.parametrize("page", ["lerobot", "takeover", "user_study"])
def test_buttons_of_the_cockpit_s_page_are_called_as_on_it(page):
    labels = re.sub(r"<kbd.*?</kbd>|<[^>]*>", "", text("collect/cockpit/page/index.html"))
    named = re.findall(r"(?<!\*)\*([A-Z][\w ]{1,20})\*(?!\*)", text(f"docs/{page}.md"))
    assert named
    assert [name for name in named if name not in labels] == []
    assert not re.search("success, failure (or|and) (discard|again)", text(f"docs/{page}.md"))


def test_the_start_takes_no_minute():
    """The inner loops are compiled when Handrail is installed; the rest takes seconds."""
    page = (ROOT / "collect" / "cockpit" / "page").glob("*.[jh]*")
    said = [path for path in (*page, *sources("collect")) if "about a minute" in path.read_text()]
    assert said == []


def test_every_feature_s_test_exists():
    """`tests/features.md` names one test for each feature of README and pages."""
    tests = ROOT / "tests"
    named = re.findall(r"`([\w/]+\.py)::(\w+)`", (tests / "features.md").read_text())
    assert len(named) > 200
    assert [each for each in named if f"def {each[1]}(" not in (tests / each[0]).read_text()] == []
