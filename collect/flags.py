"""What settings of several commands have in common: names from a list, a page to write."""

from pathlib import Path

from handrail.controllers.errors import HandrailError, unknown_name


def names(given: str, everything: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names in a comma-separated list, or everything where it says `all`."""
    if given.strip() == "all":
        return everything
    return tuple(name.strip() for name in given.split(",") if name.strip())


def check_names(thing: str, flag: str, chosen: tuple[str, ...], choices: tuple[str, ...]) -> None:
    """Check that names were chosen, that each may be, and each is there once.

    Raises:
        HandrailError: it is not so.
    """
    if not chosen:
        raise HandrailError(f"{flag}: expected all, or some of {', '.join(choices)}; got none")
    for name in chosen:
        if name not in choices:
            raise unknown_name(thing, name, ("all", *choices))
    if len(set(chosen)) != len(chosen):
        raise HandrailError(f"{flag} {','.join(chosen)}: expected each {thing} once")


def check_page(page: str) -> None:
    """Check that a Markdown page can be written, if one is asked for.

    Raises:
        HandrailError: it cannot.
    """
    path = Path(page).expanduser()
    if page and not (path.suffix == ".md" and path.absolute().parent.is_dir()):
        raise HandrailError(f"--page {page}: expected a .md file in an existing folder")
