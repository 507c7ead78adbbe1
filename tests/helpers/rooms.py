"""Rooms (folders) and the arrows between them, from the imports."""

import ast
import functools
import re
from pathlib import Path

import networkx
from places import ROOT

FLOORS = ("controllers", "datasets", "collect", "policies", "scripts")  # from the ground up
NAMED = re.compile(rf"handrail\.(?:{'|'.join(FLOORS)})[\w.]*(?::\w+)?")


def sources(floor: str) -> list[Path]:
    """Return the Python files of a floor."""
    return sorted(path for path in (ROOT / floor).rglob("*.py") if "__pycache__" not in path.parts)


def imported(path: Path) -> set[str]:
    """Return the full names of all modules that a file imports, wherever in the file."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names |= {node.module or ""} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def named(path: Path) -> set[str]:
    """Return the modules that texts of a file name, as `module:name` of a registry."""
    texts = [node.value for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Constant)]
    return {text.partition(":")[0] for text in texts if isinstance(text, str) and NAMED.fullmatch(text)}


@functools.cache
def rooms() -> dict[str, list[Path]]:
    """Return the files of every room; what lies at a floor's root is a room of the floor's name."""
    found: dict[str, list[Path]] = {}
    for floor in FLOORS:
        for path in sources(floor):
            if path.name != "__init__.py":
                found.setdefault(".".join(path.parent.relative_to(ROOT).parts), []).append(path)
    return found


@functools.cache
def arrows() -> networkx.DiGraph:
    """Return the graph of rooms: an arrow from a room to each that it imports."""
    graph = networkx.DiGraph()
    modules = {
        ".".join(("handrail", *path.relative_to(ROOT).with_suffix("").parts)): room
        for room, files in rooms().items()
        for path in files
    }
    graph.add_nodes_from(set(modules.values()))
    for room, files in rooms().items():
        targets = {modules[name] for path in files for name in imported(path) if name in modules}
        graph.add_edges_from((room, target) for target in targets - {room})
    return graph
