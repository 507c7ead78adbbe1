"""Lists on a command line: by comma or space alike."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from tyro.constructors import PrimitiveConstructorSpec


def split_list(words: Sequence[str]) -> tuple[str, ...]:
    """Return the entries of a list; what is in brackets stays together, so does the path of what exists."""
    parts = [part.strip() for word in words for part in _split_word(word)]
    return tuple(part for part in parts if part)


def _split_word(word: str) -> list[str]:
    if "," in word and Path(word).exists():
        return [word]
    depth, parts = 0, [""]
    for letter in word:
        depth += (letter in "[({") - (letter in "])}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def _whole_numbers(words: Sequence[str]) -> tuple[int, ...]:
    return tuple(int(word) for word in split_list(words))


_MANY = "[WORD [WORD …]]"

Words = Annotated[
    tuple[str, ...],
    PrimitiveConstructorSpec[tuple[str, ...]](
        "*", _MANY, split_list, is_instance=lambda value: isinstance(value, tuple), str_from_instance=list
    ),
]
"""A list of words."""

Numbers = Annotated[
    tuple[int, ...],
    PrimitiveConstructorSpec[tuple[int, ...]](
        "*",
        "[INT [INT …]]",
        _whole_numbers,
        is_instance=lambda value: isinstance(value, tuple),
        str_from_instance=lambda numbers: [str(number) for number in numbers],
    ),
]
"""A list of whole numbers."""

Names = Annotated[
    str,
    PrimitiveConstructorSpec[str](
        "*",
        _MANY,
        lambda words: ",".join(split_list(words)),
        is_instance=lambda value: isinstance(value, str),
        str_from_instance=lambda names: [names],
    ),
]
"""A list of names, kept as one text with commas between them."""
