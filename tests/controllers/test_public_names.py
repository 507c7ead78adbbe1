"""Public names: there, known to editors, and loaded only when they are used."""

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

PACKAGES = ("handrail.controllers", "handrail.collect", "handrail.collect.lerobot")
HEAVY = ("casadi", "pinocchio", "coal", "numba", "mujoco", "lerobot", "torch", "rerun")


def shown_to_editors(package):
    """Return name → module of what a package imports for type checkers only."""
    tree = ast.parse(Path(str(import_module(package).__file__)).read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    found = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    return {alias.asname: node.module for node in found for alias in node.names}


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_is_what_editors_are_told(package):
    module, told = import_module(package), shown_to_editors(package)
    assert sorted(told) == module.__all__
    for name, home in told.items():
        assert getattr(module, name) is getattr(import_module(home), name)
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        module.nothing  # noqa: B018


@pytest.mark.parametrize("package", PACKAGES)
def test_importing_a_package_loads_nothing_heavy(package):
    asked = f"import sys, {package}; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
