"""Reading a study's design from a TOML file, and checking it whole."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import draccus

from handrail.controllers.entries import Entry, is_name, is_table
from handrail.controllers.errors import unknown_name
from handrail.controllers.fields import check_fields
from handrail.controllers.strict_toml import read_toml
from handrail.policies.study.design.design import (
    Beside,
    Factors,
    Flat,
    Pictures,
    Robustness,
    StudyDesign,
    TaskDesign,
)
from handrail.policies.study.design.settings import check_jobs

PRESETS = Path(__file__).parent / "presets"
_NAME = Entry("no name: a study is called after its file", lambda _: False, needed=False)
_DIGEST = Entry("no digest: it follows from the rest", lambda _: False, needed=False)
_TASKS = Entry("a table of tasks", lambda value: is_table(value) and all(map(is_name, value)))
_PARTS = {
    "flat": Flat,
    "factors": Factors,
    "beside": Beside,
    "pictures": Pictures,
    "robustness": Robustness,
}


def design_names() -> list[str]:
    """Return the studies that come with Handrail."""
    return sorted(path.stem for path in PRESETS.glob("*.toml"))


def load_design(name: str) -> StudyDesign:
    """Return a study by the name of a preset or the path of a TOML file."""
    path = Path(name).expanduser() if name.endswith(".toml") else PRESETS / f"{name}.toml"
    if not path.is_file():
        raise unknown_name("study", name, [*design_names(), "a file that ends in .toml"])
    content, where = read_toml(path, "study"), f"study {name}"
    check_fields(content, StudyDesign, where, name=_NAME, digest=_DIGEST, tasks=_TASKS)
    for task, entries in content["tasks"].items():
        check_fields(entries, TaskDesign, f"{where}: [tasks.{task}]")
    for part, kind in _PARTS.items():
        if part in content:
            check_fields(content[part], kind, f"{where}: [{part}]")
    own = {"name": path.stem, "digest": digest_of(content)}
    design = draccus.decode(StudyDesign, {**content, **own})
    design.check()
    check_jobs(design)
    return design


def digest_of(content: Mapping[str, Any]) -> str:
    """Return a digest of what a design's file says, whatever its order, spaces and comments."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
