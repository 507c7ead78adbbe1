"""Reading a study's design from a TOML file, and checking it whole."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.strict_toml import read_toml
from handrail.controllers.typed import decoded
from handrail.policies.study.design import (
    StudyDesign,
    check_known,
)
from handrail.policies.study.settings import check_jobs

PRESETS = Path(__file__).parent / "presets"


def load_design(name: str) -> StudyDesign:
    """Return a study by the name of a preset or the path of a TOML file."""
    path = Path(name).expanduser() if name.endswith(".toml") else PRESETS / f"{name}.toml"
    if not path.is_file():
        known = sorted(each.stem for each in PRESETS.glob("*.toml"))
        raise unknown_name("study", name, [*known, "a file that ends in .toml"])
    content, where = read_toml(path, "study"), f"study {name}"
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    own = {"name": path.stem, "digest": hashlib.sha256(text.encode()).hexdigest()[:16]}
    for entry in own.keys() & content.keys():
        raise HandrailError(
            f"{where}: expected no {entry}: it follows from the rest, and from the file's name"
        )
    if isinstance(tasks := content.get("tasks"), Mapping):
        check_known("task", tasks, TASKS)
    design = decoded({**content, **own}, StudyDesign, where)
    design.check()
    check_jobs(design)
    return design
