"""The house: a room is a folder of few files, imports go downwards by the full name, arrows go one way."""

import ast
import re
from collections import Counter

import networkx
import pytest
from places import FLOORS, ROOT, sources

MOST_FILES = 20
MOST_LINES = 300
NAMED = re.compile(rf"handrail\.(?:{'|'.join(FLOORS)})[\w.]*(?::\w+)?")  # of a registry
FORBIDDEN = {
    "controllers": {"mujoco", "gymnasium", "torch", "lerobot", "rerun", "datasets"},
    "datasets": {"mujoco", "gymnasium", "torch", "rerun"},
}


def names_in(path) -> tuple[set[str], set[str]]:
    """Return the full names that a file imports, wherever in it, and the modules that its texts name."""
    imported, named = set(), set()
    for node in ast.walk(ast.parse(path.read_text())):
        match node:
            case ast.Import(names=names):
                imported |= {alias.name for alias in names}
            case ast.ImportFrom(module=str(module), names=names, level=0):
                imported |= {module} | {f"{module}.{alias.name}" for alias in names}
            case ast.ImportFrom():
                raise AssertionError(f"{path}: relative import")
            case ast.Constant(value=str(text)) if NAMED.fullmatch(text):
                named.add(text.partition(":")[0])
    return imported, named


FILES = {path.relative_to(ROOT): names_in(path) for floor in FLOORS for path in sources(floor)}


def test_rooms_are_small():
    sizes = Counter(path.parent for path in FILES if path.name != "__init__.py")
    assert not {room: size for room, size in sizes.items() if size > MOST_FILES}


def test_files_are_short():
    lines = {
        path: len((ROOT / path).read_text().splitlines()) for path in [*FILES, *ROOT.glob("tests/**/*.py")]
    }
    assert not {path: count for path, count in lines.items() if count > MOST_LINES}


def test_no_cycle_between_rooms():
    rooms = {".".join(("handrail", *path.with_suffix("").parts)): path.parent for path in FILES}
    arrows = networkx.DiGraph()
    for path, (imported, _) in FILES.items():
        targets = {rooms[name] for name in imported if name in rooms and path.name != "__init__.py"}
        arrows.add_edges_from((path.parent, target) for target in targets - {path.parent})
    assert arrows
    assert not list(networkx.simple_cycles(arrows))


@pytest.mark.parametrize("floor", FLOORS)
def test_imports_go_downwards_and_by_the_full_name(floor):
    allowed = FLOORS[: FLOORS.index(floor) + 1]
    for path, (imported, named) in FILES.items():
        for name in imported | named if path.parts[0] == floor else ():
            first, *parts = name.split(".")
            if first == "handrail" and parts:
                assert parts[0] in allowed, f"{path}: names {name} from a floor above"
                assert "bench" not in parts or "bench" in path.parts, f"{path}: names {name}"
            assert first not in {*FLOORS, "tests"} - {"datasets"}, f"{path}: import handrail.{name}"
            assert first not in FORBIDDEN.get(floor, ()), f"{path}: {name} does not belong on this floor"
