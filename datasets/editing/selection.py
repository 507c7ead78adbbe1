"""Which episodes a command line means: `3`, `0-4`, `failed`, `succeeded`; and the parts of a split."""

import re
from collections.abc import Mapping, Sequence

from handrail.controllers.errors import HandrailError

_RANGE = re.compile(r"(\d{1,9})(?:-(\d{1,9}))?")
_WORDS = {"failed": False, "succeeded": True}
_ROUNDING = 1e-9


def chosen_episodes(flag: str, words: Sequence[str], successes: Sequence[bool | None]) -> list[int]:
    """Return the episodes that are meant, in order, each once.

    Args:
        flag: That the words are of, for the error.
        words: Numbers, ranges, `failed` or `succeeded`.
        successes: Of every episode of the dataset; None where that is not known.

    Raises:
        HandrailError: A word is something else, or there is no such episode.
    """
    found: set[int] = set()
    for word in words:
        match = _RANGE.fullmatch(word)
        if word in _WORDS:
            found |= {number for number, success in enumerate(successes) if success is _WORDS[word]}
        elif match:
            first, last = int(match[1]), int(match[2] or match[1])
            if not first <= last < len(successes):
                raise HandrailError(f"{flag} {word}: expected episodes from 0 to {len(successes) - 1}")
            found |= set(range(first, last + 1))
        else:
            raise HandrailError(f"{flag} {word}: expected a number, a range such as 0-4, failed or succeeded")
    return sorted(found)


def split_parts(words: Sequence[str], successes: Sequence[bool | None]) -> Mapping[str, list[int]]:
    """Return the episodes of each part.

    Args:
        words: `NAME=SHARE` each, or `NAME=EPISODE` with more episodes after it.
        successes: As for `chosen_episodes`.

    Raises:
        HandrailError: A part has no name or no episode, a name or an episode is there twice, or shares add up
            to more than 1.
    """
    given = _by_name(words)
    shares = {name: float(said[0]) for name, said in given.items() if _is_share(said)}
    if shares and len(shares) < len(given):
        raise HandrailError("--parts: expected shares or episodes for all of them, got both")
    parts = _shared(shares, len(successes)) if shares else {}
    for name, said in given.items():
        if not shares:
            parts[name] = chosen_episodes(f"--parts {name}", said, successes)
        if not parts[name]:
            raise HandrailError(f"--parts {name}: expected an episode or more of {len(successes)}, got none")
    everything = [number for numbers in parts.values() for number in numbers]
    twice = next((number for number in everything if everything.count(number) > 1), None)
    if twice is not None:
        raise HandrailError(f"--parts: expected each episode in one part, got episode {twice} in two")
    return parts


def _by_name(words: Sequence[str]) -> dict[str, list[str]]:
    given: dict[str, list[str]] = {}
    name = ""
    for word in words:
        before, equals, after = word.rpartition("=")
        if equals:
            name = before
            if not re.fullmatch(r"\w[\w.-]*", name) or name in given:
                raise HandrailError(
                    f"--parts {word}: expected a name of its own, as in {name or 'train'}=0.8"
                )
            given[name] = [after]
        elif name:
            given[name].append(word)
        else:
            raise HandrailError(f"--parts {word}: expected NAME=SHARE or NAME=EPISODES")
    return given


def _is_share(said: Sequence[str]) -> bool:
    return len(said) == 1 and re.fullmatch(r"[01]?\.\d{1,9}|1\.", said[0]) is not None


def _shared(shares: Mapping[str, float], count: int) -> dict[str, list[int]]:
    """Return the episodes of each part, one part after the other."""
    if sum(shares.values()) > 1.0 + _ROUNDING:
        raise HandrailError(f"--parts: expected shares up to 1 together, got {sum(shares.values()):g}")
    parts, total = {}, 0.0
    for name, share in shares.items():
        begin, total = round(total * count), total + share
        parts[name] = list(range(begin, round(total * count)))
    return parts
