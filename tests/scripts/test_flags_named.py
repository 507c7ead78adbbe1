"""Neither a message nor a page names a flag that does not exist: every `--flag` is one of a command."""

import ast
import re
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import pytest
from command_helpers import command
from configs import BENCH_CONFIGS, CONFIGS
from lerobot.configs.dataset import DatasetRecordConfig
from lerobot.configs.default import EvalConfig
from lerobot.envs.configs import EnvConfig
from lerobot.robots import RobotConfig
from lerobot.teleoperators import TeleoperatorConfig
from places import ROOT

import handrail.collect.lerobot  # noqa: F401  (registers our plugins)

FLAG = re.compile(r"(?<![\w(-])--[a-z][\w.]*(?:-[a-z]\w*)*")
STYLE = ("var(--", 'style="')  # of a page: what begins with "--" there is a colour
OTHERS = {  # flags of other programs, by the word that the same text must say
    "lerobot-dataset-viz": {"--repo-id", "--root", "--episode-index", "--save", "--output-dir"},
    "lerobot-edit-dataset": {
        "--repo_id",
        "--root",
        "--new_root",
        "--operation.type",
        "--operation.episode_indices",
    },
    "lerobot.robots.lekiwi.lekiwi_host": {"--host.connection_time_s"},
    "--robot.type=lekiwi_client": {"--robot.remote_ip", "--robot.cameras"},
    "--client.*": {"--client"},  # all of these
    "--client.…": {"--client"},  # one of them
    "`--flag`": {"--flag"},
    "--config_path=": {"--config_path"},  # what LeRobot's training is given
    "accelerate launch": {"--multi_gpu"},
    "ray start": {"--head", "--port", "--address", "--disable-usage-stats"},
}
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
FOREIGN = {ROOT / "collect/session/viewer.py", ROOT / "scripts/bench/latency/measure.py"}
FOREIGN |= {ROOT / "scripts/bench/soak/child.py", ROOT / "scripts/bench/soak/notes.py"}
type Function = ast.FunctionDef | ast.AsyncFunctionDef | ast.Module


def flags_of(name: str) -> set[str]:
    """Return the flags of a command, from its own help."""
    shown = command("--help-all", name=name.removeprefix("handrail-")).stdout
    rows = re.findall(r"^[│ ] ((?:-[\w.-]+(?:, )?)+)", shown, re.MULTILINE)
    return {flag for row in rows for flag in row.split(", ") if flag.startswith("--")}


@pytest.fixture(scope="module")
def known() -> set[str]:
    own = map(flags_of, [*CONFIGS, *BENCH_CONFIGS])
    return {"--version", "--help-all"}.union(*own) | flags_of_lerobot()


def flags_of_lerobot() -> set[str]:
    """Return those of LeRobot's commands that are about our plugins, or that these have to agree with."""
    kinds = {"robot": RobotConfig, "teleop": TeleoperatorConfig, "env": EnvConfig}
    flags = {f"--{part}.{name}" for part in kinds for name in ("type", "discover_packages_path")}
    for part, kind in kinds.items():
        chosen = [each for name, each in kind.get_known_choices().items() if name.startswith("handrail")]
        flags |= {f"--{part}.{entry.name}" for each in chosen for entry in fields(each)}
    flags |= {f"--dataset.{entry.name}" for entry in fields(DatasetRecordConfig)}
    return flags | {f"--eval.{entry.name}" for entry in fields(EvalConfig)}


def texts() -> Iterator[tuple[str, ast.expr, Function]]:
    """Yield every text in the source, whole, with where it is and the function around it.

    Some files speak to other programs, such as Chromium, in the flags of those.
    """
    for floor in ("controllers", "datasets", "collect", "policies", "scripts"):
        for path in sorted(set((ROOT / floor).rglob("*.py")) - FOREIGN):
            tree = ast.parse(path.read_text())
            parts = {id(part) for node in ast.walk(tree) for part in pieces(node)}
            for function, node in with_functions(tree, tree):
                if isinstance(node, ast.Constant | ast.JoinedStr) and id(node) not in parts:
                    yield f"{path.relative_to(ROOT)}:{node.lineno}", node, function


def pieces(node: ast.AST) -> list[ast.expr]:
    return node.values if isinstance(node, ast.JoinedStr) else []


def with_functions(node: ast.AST, function: Function) -> Iterator[tuple[Function, ast.AST]]:
    for child in ast.iter_child_nodes(node):
        inside = child if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef) else function
        yield inside, child
        yield from with_functions(child, inside)


def versions(node: ast.expr, function: Function) -> list[str]:
    """Return what a text says; an f-string whose flag comes from a loop, once for each turn of it."""
    if isinstance(node, ast.Constant):
        return [node.value] if isinstance(node.value, str) else []
    assert isinstance(node, ast.JoinedStr)
    said = [""]
    for part in node.values:
        if isinstance(part, ast.Constant):
            said = [text + str(part.value) for text in said]
        elif isinstance(part, ast.FormattedValue):
            flagged = any(re.search(r"--[\w.]*$", text) for text in said)
            choices = turns(node, part.value, function) if flagged else ["…"]
            said = [text + choice for text in said for choice in choices]
    return said


def turns(node: ast.expr, value: ast.expr, function: Function) -> list[str]:
    """Return the words that a name takes in the innermost loop around it; "…" for the name of a setting."""
    if (isinstance(value, ast.Attribute) and value.attr == "name") or names_a_setting(value, function):
        return ["…"]
    if isinstance(value, ast.Attribute) and value.attr == "_thing":  # of a registry whose names files may say
        return ["task", "mode", "operator", "robot"]
    words: list[str] = []
    for around in ast.walk(function):  # from the outside in
        if any(inner is node for inner in ast.walk(around)):
            for loop in [around] if isinstance(around, ast.For) else getattr(around, "generators", []):
                words = values_of(value, loop) or words
    assert words, f"{ast.unparse(function)}\n\n{ast.unparse(value)}: cannot tell which flags this is"
    return words


def values_of(value: ast.expr, loop: ast.For | ast.comprehension) -> list[str]:
    """Return what a name is in each turn of a loop over literals."""
    targets = loop.target.elts if isinstance(loop.target, ast.Tuple) else [loop.target]
    rows = loop.iter.elts if isinstance(loop.iter, ast.Tuple) else []
    for place, target in enumerate(targets):
        if ast.unparse(target) == ast.unparse(value):
            return [(row.elts[place] if isinstance(row, ast.Tuple) else row).value for row in rows]  # pyright: ignore
    return []


def names_a_setting(value: ast.expr, function: Function) -> bool:
    """Return whether the function looks a setting up by that name: then there is one, and its flag."""
    calls = [node for node in ast.walk(function) if isinstance(node, ast.Call)]
    return any(
        ast.unparse(call.func) == "getattr" and ast.unparse(call.args[1]) == ast.unparse(value)
        for call in calls
    )


def flags_in(text: str) -> set[str]:
    styled = any(mark in text for mark in STYLE)
    return (
        set()
        if styled
        else {flag.rstrip(".") for flag in FLAG.findall(text)}
        - {"--human", "--cockpit", "--teleop", "--client", "--dataset"}
    )  # --human.*


def foreign(text: str) -> set[str]:
    return {flag for program, flags in OTHERS.items() if program in text for flag in flags}


def test_every_flag_that_a_text_names_exists(known):
    assert {"--dataset.root", "--success_only", "--no_resume"} <= known
    named, wrong = 0, []
    for place, node, function in texts():
        for text in versions(node, function):
            found = flags_in(text)
            named += len(found)
            wrong += [f"{place}: {flag}" for flag in sorted(found - known - foreign(text))]
    assert named > 100
    assert not wrong, "\n".join(wrong)


def spans(page: Path) -> list[str]:
    """Return what a page shows as code in its sentences; commands in blocks are parsed by another test."""
    prose = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
    return re.findall(r"`([^`\n]+)`", prose)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_flag_that_a_page_names_exists(page, known):
    wrong = {flag for span in spans(page) for flag in flags_in(span) - known - foreign(span)}
    assert wrong == set()


def test_the_law_sees_a_flag_that_is_made_up_in_a_loop():
    source = (
        'def check():\n for name, least in (("steps", 1), ("success", 2)):\n  fail(f"--{name} {least}: no")'
    )
    tree = ast.parse(source)
    ((node, function),) = [(n, f) for f, n in with_functions(tree, tree) if isinstance(n, ast.JoinedStr)]
    assert versions(node, function) == ["--steps …: no", "--success …: no"]
