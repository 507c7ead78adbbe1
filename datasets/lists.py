"""Lists on a command line: by comma or space alike."""

import os
from collections.abc import Callable, Sequence
from typing import Annotated, Any

from tyro.constructors import PrimitiveConstructorSpec


def split_list(words: Sequence[str]) -> tuple[str, ...]:
    """Return the entries of a list; what is in brackets stays together, so does the path of what exists."""
    parts = [part.strip() for word in words for part in _split_word(word)]
    return tuple(part for part in parts if part)


def _split_word(word: str) -> list[str]:
    if "," in word and os.path.exists(word):
        return [word]
    depth, parts = 0, [""]
    for letter in word:
        depth += (letter in "[({") - (letter in "])}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def _listed(
    kind: type, word: str, read: Callable[[list[str]], Any], words: Callable[[Any], list[str]]
) -> PrimitiveConstructorSpec[Any]:
    """Return how a list is read from words, and said in words again; a flag without a word is refused."""

    def checked(given: list[str]) -> Any:
        if given and (kind is str or split_list(given)):  # names of none are "", as by default
            return read(given)
        raise ValueError("expected a list, got nothing")

    return PrimitiveConstructorSpec(
        "*", f"{word} [{word} …]", checked, lambda value: isinstance(value, kind), words
    )


def _whole_numbers(words: Sequence[str]) -> tuple[int, ...]:
    return tuple(int(word) for word in split_list(words))


def _joined(words: Sequence[str]) -> str:
    return ",".join(split_list(words))


Words = Annotated[tuple[str, ...], _listed(tuple, "WORD", split_list, list)]
"""A list of words."""
Numbers = Annotated[
    tuple[int, ...], _listed(tuple, "INT", _whole_numbers, lambda value: list(map(str, value)))
]
"""A list of whole numbers."""
Names = Annotated[str, _listed(str, "WORD", _joined, lambda value: [value])]
"""A list of names, kept as one text with commas between them."""
