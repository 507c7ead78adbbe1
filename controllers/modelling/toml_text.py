"""Tables as TOML: the text of a robot's description."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

_WIDE = 100  # characters of a list in one line


def toml_text(tables: Mapping[str, Any]) -> str:
    """Return tables as TOML: entries first, then tables, each below its name."""
    return "\n".join(_lines(tables, "")) + "\n"


def _lines(table: Mapping[str, Any], path: str) -> list[str]:
    lines = [f"{name} = {_value(value)}" for name, value in table.items() if not _tables(value)]
    for name, value in table.items():
        for each in _tables(value):
            head = f"{path}{name}"
            lines += [
                "",
                f"[[{head}]]" if isinstance(value, list) else f"[{head}]",
                *_lines(each, f"{head}."),
            ]
    return lines


def _tables(value: Any) -> list[Mapping[str, Any]]:
    if isinstance(value, Mapping):
        return [value]
    return value if isinstance(value, list) and value and isinstance(value[0], Mapping) else []


def _value(value: Any) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float | np.floating):
        return repr(round(float(value), 6) + 0.0)
    parts = [_value(each) for each in value]
    text = ", ".join(parts)
    nested = any(isinstance(each, list | tuple) for each in value)
    return f"[\n    {',\n    '.join(parts)},\n]" if nested and len(text) > _WIDE else f"[{text}]"
