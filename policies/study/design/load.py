"""Reading a study's design from a TOML file, and checking it whole."""

from pathlib import Path

import draccus

from handrail.controllers.entries import Entry, is_name, is_table
from handrail.controllers.errors import unknown_name
from handrail.controllers.fields import check_fields
from handrail.controllers.strict_toml import read_toml
from handrail.policies.study.design.design import Robustness, StudyDesign, Sweep, TaskDesign
from handrail.policies.study.design.settings import check_jobs

PRESETS = Path(__file__).parent / "presets"
_NAME = Entry("no name: a study is called after its file", lambda _: False, needed=False)
_TASKS = Entry("a table of tasks", lambda value: is_table(value) and all(map(is_name, value)))


def design_names() -> list[str]:
    """Return the studies that come with Handrail."""
    return sorted(path.stem for path in PRESETS.glob("*.toml"))


def load_design(name: str) -> StudyDesign:
    """Return a study by the name of a preset or the path of a TOML file.

    Raises:
        HandrailError: there is none, or something in it is wrong.
    """
    path = Path(name).expanduser() if name.endswith(".toml") else PRESETS / f"{name}.toml"
    if not path.is_file():
        raise unknown_name("study", name, [*design_names(), "a file that ends in .toml"])
    content, where = read_toml(path, "study"), f"study {name}"
    check_fields(content, StudyDesign, where, name=_NAME, tasks=_TASKS)
    for task, entries in content["tasks"].items():
        check_fields(entries, TaskDesign, f"{where}: [tasks.{task}]")
    for part, kind in (("robustness", Robustness), ("sweep", Sweep)):
        if part in content:
            check_fields(content[part], kind, f"{where}: [{part}]")
    design = draccus.decode(StudyDesign, {"name": path.stem, **content})
    design.check()
    check_jobs(design)
    return design
