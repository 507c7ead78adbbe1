"""The house as its imports draw it: rooms (folders) and the arrows between them.

python tests/helpers/rooms.py    draw it anew in docs/architecture.md
"""

import ast
import functools
import re
from pathlib import Path

import networkx
from places import ROOT

FLOORS = ("controllers", "datasets", "collect", "policies", "scripts")  # from the ground up
PAGE = ROOT / "docs" / "architecture.md"
NAMED = re.compile(rf"handrail\.(?:{'|'.join(FLOORS)})[\w.]*(?::\w+)?")
_DRAWING = re.compile(r"```mermaid\n.*?```", re.DOTALL)


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


def drawing() -> str:
    """Return the graph as a Mermaid drawing, a box a floor, without the arrows that others imply."""
    graph = networkx.transitive_reduction(arrows())
    lines = ["```mermaid", "flowchart BT"]
    for floor in FLOORS:
        lines.append(f"  subgraph {floor}")
        lines += [f"    {_node(room)}" for room in sorted(graph) if room.split(".")[0] == floor]
        lines.append("  end")
    lines += [f"  {_name(room)} --> {_name(target)}" for room, target in sorted(graph.edges)]
    return "\n".join([*lines, "```"])


def _name(room: str) -> str:
    return room.replace(".", "_") if "." in room else f"{room}_root"


def _node(room: str) -> str:
    return f"{_name(room)}[{room.partition('.')[2] or 'root'}]"


def main() -> None:
    """Draw the house anew in its page."""
    PAGE.write_text(_DRAWING.sub(drawing().replace("\\", r"\\"), PAGE.read_text(), count=1))


def drawn() -> str:
    """Return the drawing in the page."""
    found = _DRAWING.search(PAGE.read_text())
    return found[0] if found else ""


if __name__ == "__main__":
    main()
