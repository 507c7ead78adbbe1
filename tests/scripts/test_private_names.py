"""Tests look at what is public: they survive a change of what is inside."""

import ast
from pathlib import Path

FILES = sorted(Path(__file__).parent.parent.rglob("*.py"))


# of named tuples, of stable-baselines3, and of LeRobot: how LeKiwi turns its wheels, how a rollout goes back
OTHERS = {"_replace", "_asdict", "_n_updates", "_body_to_wheel_raw", "_return_to_initial_position"}


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__") and name not in OTHERS


def private_names(tree: ast.Module) -> list[str]:
    """Return the private names of others that a test reads, imports or patches."""
    nodes = list(ast.walk(tree))
    own = {id(part) for node in nodes if isinstance(node, ast.ClassDef) for part in ast.walk(node)}
    found = []
    for node in nodes:
        match node:
            case ast.Attribute(value=ast.Name(id="self" | "cls")) if id(node) in own:
                pass
            case ast.Attribute(attr=name) if is_private(name):
                found.append(ast.unparse(node))
            case ast.ImportFrom(names=names):
                found += [entry.name for entry in names if is_private(entry.name)]
            case ast.Call(func=ast.Attribute(attr="setattr" | "delattr" | "object"), args=arguments):
                said = [str(part.value) for part in arguments[:2] if isinstance(part, ast.Constant)]
                found += [name for name in said if is_private(name.rpartition(".")[2])]
    return found


def test_no_test_reaches_into_private_names():
    found = {path.stem: private_names(ast.parse(path.read_text())) for path in FILES}
    assert not {name: names for name, names in found.items() if names}
