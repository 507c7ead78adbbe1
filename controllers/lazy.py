"""Public names of a package that are loaded when they are first used, so that importing it is quick."""

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def lazily(package: str, file: str) -> tuple[list[str], Callable[[str], Any]]:
    """Return the `__all__` and the `__getattr__` (PEP 562) of a package.

    Its public names are those that its `if TYPE_CHECKING:` imports: one list for type checkers and for us.

    Args:
        package: its name.
        file: its `__init__.py`.
    """
    [block] = [each for each in ast.parse(Path(file).read_text()).body if isinstance(each, ast.If)]
    imports = [each for each in block.body if isinstance(each, ast.ImportFrom)]
    modules = {name.name: str(each.module) for each in imports for name in each.names}

    def find(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(modules[name]), name)

    return sorted(modules), find
