"""Tables as TOML: the text of a robot's description."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

_WIDE = 100  # characters of a list in one line


def toml_text(tables: Mapping[str, Any], path: str = "") -> str:
    """Return tables as TOML: entries first, then tables, each below its name."""
    inner = {name: value if isinstance(value, list) else [value] for name, value in tables.items()}
    inner = {name: each for name, each in inner.items() if each and isinstance(each[0], dict)}
    text = "".join(f"{name} = {_value(value)}\n" for name, value in tables.items() if name not in inner)
    for name, several in inner.items():
        head = f"[[{path}{name}]]" if isinstance(tables[name], list) else f"[{path}{name}]"
        text += "".join(f"\n{head}\n{toml_text(each, f'{path}{name}.')}" for each in several)
    return text


def _value(value: Any) -> str:
    """Return a value as JSON, which TOML reads too: numbers rounded, a long list of lists one a line."""
    text = json.dumps(value, default=np.ndarray.tolist)
    plain = json.loads(text, parse_float=lambda number: round(float(number), 6) + 0.0)
    text = json.dumps(plain, ensure_ascii=False).replace("\x7f", "\\u007f")
    if len(text) < _WIDE or not isinstance(plain, list) or not isinstance(plain[0], list):
        return text
    return f"[\n    {',\n    '.join(map(_value, plain))},\n]"
