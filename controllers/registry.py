"""Things of one kind by name: built in, of an installed package, or `module:name` of the command line."""

import importlib
import logging
import re
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib import metadata
from typing import Any

from handrail.controllers.errors import HandrailError, restated, unknown_name

_REFERENCE = re.compile(r"[\w.]+:[^\W\d]\w*")  # `mask:0011` is none


@dataclass(frozen=True)
class Buildable:
    """An entry that is a name, how to build what it names, and a line of help."""

    name: str  # as on the command line, in a mode and in the dataset
    build: Callable[..., Any] | str  # or where that is, `module:name`
    help: str  # one line


def fitting[Spec: Any](specs: Mapping[str, Spec], hands: int) -> dict[str, Spec]:
    """Return those of some specs that a robot with so many hands can do, by name, if they can be imported."""
    return {name: spec for name, spec in importable(specs) if spec.hands <= hands}


def importable[Spec: Any](
    specs: Mapping[str, Spec], load: Callable[[Spec], object] = lambda spec: None
) -> Iterator[tuple[str, Spec]]:
    """Yield specs with their names; one that an installed package lacks is left out with a warning.

    Args:
        specs: by name.
        load: imports what a spec needs besides; raises a `HandrailError` where that fails.
    """
    for name in specs:
        try:
            load(spec := specs[name])
        except HandrailError as error:
            logging.getLogger(__name__).warning("%s; it is left out", error)
        else:
            yield name, spec


class Registry[Spec: Any](Mapping[str, Spec]):
    """Specs by name: what comes with Handrail, then what installed packages add by entry points.

    So the places of Handrail's own do not depend on what is installed.

    Their group is `handrail.<thing>s`; they are imported when they are asked for. The names in this mapping
    are safe, whoever says them. `find` also imports `module:name`: ask it for names that the command line or
    a program says, and for those of a file once `admit` let them pass.

    Args:
        thing: in one word: for messages, the flag and the entry points.
        kind: of the specs.
        built_in: what comes with Handrail; each has a name and, where a flag takes it, a line of help.
    """

    def __init__(self, thing: str, kind: type[Spec], built_in: Iterable[Spec]) -> None:
        self._thing, self._kind = thing, kind
        self._built_in = {spec.name: spec for spec in built_in}

    @property
    def built_in(self) -> tuple[Spec, ...]:
        """The entries that come with Handrail."""
        return tuple(self._built_in.values())

    def __iter__(self) -> Iterator[str]:
        return iter({**self._built_in, **self._installed()})

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __contains__(self, name: object) -> bool:
        return name in self._built_in or name in self._installed()

    def __getitem__(self, name: str) -> Spec:
        return self._built_in[name] if name in self._built_in else self._spec(name, self._installed()[name])

    @property
    def help(self) -> str:
        """All names in one line; those that come with Handrail with their lines of help."""
        others = {name for name, value in self._installed().items() if not value.startswith("handrail.")}
        others -= self._built_in.keys()
        return "; ".join(name if name in others else f"{name}: {self[name].help}" for name in self)

    def accepts(self, name: str) -> bool:
        """Return whether the command line may say a name: there is one, or it is a `module:name`."""
        return name in self or _REFERENCE.fullmatch(name) is not None

    def check(self, name: str) -> None:
        """Check a name of the command line, without importing anything."""
        if not self.accepts(name):
            raise unknown_name(self._thing, name, self)

    def admit(self, name: str, said: Collection[str] = ()) -> None:
        """Check a name that a file says: a stranger's file must not choose what is imported.

        Args:
            name: in the file.
            said: the names on the command line, which may be imported.
        """
        if _REFERENCE.fullmatch(name) and name not in self and name not in said:
            raise HandrailError(
                f"{self._thing} {name}: a file may not choose what is imported; "
                f"expected an installed {self._thing}, or --{self._thing} {name} if you trust that module"
            )

    def find(self, name: str) -> Spec:
        """Return a spec by its name, or by `module:name`, which is imported and becomes its name."""
        self.check(name)
        return self[name] if name in self else self._spec(name, name)

    def _installed(self) -> dict[str, str]:
        entries = _entry_points(tuple(sys.path)).select(group=f"handrail.{self._thing}s")
        own_first = sorted(entries, key=lambda entry: not entry.value.startswith("handrail."))
        found = dict[str, str]()
        for entry in own_first:
            found.setdefault(entry.name, entry.value)
        return found

    def _spec(self, name: str, reference: str) -> Spec:
        spec = resolved(reference, f"{self._thing} {name}")
        if not isinstance(spec, self._kind):
            raise HandrailError(
                f"{self._thing} {name}: expected a {self._kind.__name__}, got a {type(spec).__name__}"
            )
        return replace(spec, name=name)  # pyright: ignore[reportArgumentType]  (a dataclass)


def resolved(value: Callable[..., Any] | str, where: str = "") -> Any:
    """Return what is meant: `module:name` is imported now, anything else is itself."""
    if not isinstance(value, str):
        return value
    module, _, name = value.partition(":")
    with restated(f"{where or value}: cannot import it"):  # whatever another package's code raises
        return getattr(importlib.import_module(module), name)


@cache
def _entry_points(path: tuple[str, ...]) -> metadata.EntryPoints:
    """Return the entry points of all packages on the path; reading them takes a tenth of a second."""
    return metadata.entry_points()
