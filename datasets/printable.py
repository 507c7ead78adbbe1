"""Text of strangers, made safe to print: what steers a terminal or hides becomes visible."""

import unicodedata

_UNSEEN = ("Cc", "Cf", "Cs", "Zl", "Zp")  # controls, right-to-left, half characters, line ends
_JOINERS = "\u200c\u200d"  # several scripts need them to be read


def printable(text: str, keep: str = "") -> str:
    r"""Return a text in which escape codes, line breaks and changes of direction are written out: `\x1b`.

    Args:
        text: anything.
        keep: characters that stay as they are, such as a line break.
    """
    if text.isprintable():
        return text
    return "".join(each if _is_seen(each, keep) else each.encode("unicode_escape").decode() for each in text)


def _is_seen(character: str, keep: str) -> bool:
    return character in keep or character in _JOINERS or unicodedata.category(character) not in _UNSEEN
