"""Shared by all benches: the flags that say where results go, the JSON, the tables, the part of a page."""

import json
import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import to_builtins

from handrail.collect.flags import check_file
from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import check, check_settings
from handrail.controllers.versions import versions
from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.datasets.storage.strict_json import read_json, write_json

PROGRAM = "python -m handrail.scripts.bench"
SPREAD = ("median_ms", "p95_ms", "p99_ms", "worst_ms")


@dataclass(frozen=True, kw_only=True)
class ReportConfig:
    """Where results go."""

    json: str = ""
    """Write everything measured to this file."""
    page: str = ""
    """Put the results into this Markdown page, between marks; other text stays."""

    def check(self) -> None:
        """Check what can be checked without loading anything heavy."""
        check_settings(self, "--")
        check_file("--json", self.json)
        check_file("--page", self.page, ".md")


def command_line(name: str, config: Any) -> str:
    """Return the command of a bench that gives these settings: the flags that differ from their defaults."""
    words = [*PROGRAM.split(), name]
    for entry in fields(config):
        value = getattr(config, entry.name)
        if isinstance(value, bool) and value != entry.default:
            words.append("--" + ("" if value else "no_") + entry.name)
        elif value != entry.default:
            words += ["--" + entry.name, *map(str, value if isinstance(value, tuple) else (value,))]
    return shlex.join(words)


def report(
    name: str,
    config: ReportConfig,
    tables: Sequence[Table],
    results: dict[str, Any] | None = None,
    parts: Sequence[str] = (),
) -> None:
    """Print tables, write the JSON and the part of the page, and print which files were written.

    Args:
        name: of the bench.
        config: of the run.
        tables: to print.
        results: for the JSON; None where it is written already.
        parts: paragraphs of the page under the command; the tables with their captions when empty.
    """
    console = Terminal()
    console.print(*tables, sep="\n")
    if config.json and results is not None:
        write_json(Path(config.json).expanduser(), results)
    if config.page:
        own = [part for table in tables for part in (markdown_table(table), table.caption)]
        body = [f"`{command_line(name, config)}` wrote this.", *(parts or own)]
        write_part(Path(config.page).expanduser(), name, name, "\n\n".join(dict.fromkeys(filter(None, body))))
    for path in filter(None, (config.json, config.page)):
        console.print(f"Written: {path}")


class Rows[Row]:
    """Rows that were measured, in a file that is whole after each: what it has is not measured again.

    Args:
        path: of the file, in `--json`; without one they are kept in memory.
        head: settings that all rows share; a file of other settings is refused.
        kind: type of a row.
        key: what is different in every row.
        programs: whose versions the file names.
        name: of the rows in the file.
    """

    def __init__(
        self,
        path: str,
        head: Mapping[str, Any],
        kind: type[Row],
        key: Callable[[Row], Any],
        programs: Sequence[str],
        name: str = "rows",
    ) -> None:
        self._flag, self._path = f"--json {path}", Path(path).expanduser()
        self._head, self._kind, self._key, self._name = {**head}, kind, key, name
        self._programs, self._is_kept = programs, bool(path)
        self._rows: dict[Any, Row] = {}
        if path and self._path.exists():
            self._read()

    def __contains__(self, key: object) -> bool:
        return key in self._rows

    def __getitem__(self, key: Any) -> Row:
        return self._rows[key]

    def add(self, row: Row) -> None:
        """Keep a row, on the disk too."""
        self._rows[self._key(row)] = row
        if not self._is_kept:
            return
        head = self._head | {"versions": versions(*self._programs)}
        rows = ",\n".join(json.dumps(to_builtins(self._rows[key])) for key in sorted(self._rows))
        text = f'{json.dumps(head)[:-1]}, "{self._name}": [\n{rows}\n]}}\n'
        with explained(self._flag):
            write_whole(self._path, text.encode())

    def _read(self) -> None:
        try:
            content = read_json(self._path)
            found = {name: content.get(name) for name in self._head}
            if found != self._head:
                words = f"expected {self._head}, got {found}; choose another file"
                raise HandrailError(f"{self._flag}: {words}")
            rows = check(content[self._name], list[self._kind], f"{self._flag}: {self._name}")
            self._rows = {self._key(row): row for row in rows}
        except (OSError, ValueError, AttributeError, LookupError, TypeError) as error:
            raise HandrailError(f"{self._flag}: expected a file of this bench, got {error!r}") from error


def machine(load_before: float) -> dict[str, Any]:
    """Return how many cores there are, and the load before and now."""
    return {"cores": os.cpu_count(), "load_before": load_before, "load_after": os.getloadavg()[0]}


def spread(seconds: Sequence[float], names: Sequence[str] = SPREAD) -> dict[str, float]:
    """Return median, p95, p99 and worst [ms]."""
    return dict(zip(names, np.percentile(1e3 * np.array(seconds), (50, 95, 99, 100)).tolist(), strict=True))
