"""Which designs a study's folder was run with: a file that is changed after the first results shows."""

from collections.abc import Sequence
from datetime import UTC, datetime

from handrail.controllers.errors import unknown_name
from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.design.jobs import StudyJob, StudyLayout
from handrail.policies.study.design.progress import read_json, write_json


def note_design(layout: StudyLayout, design: StudyDesign) -> None:
    """Note that the folder is run with a design, unless it was the last one already.

    Raises:
        OSError: the disk does not take it.
    """
    known = designs(layout)
    if not known or known[-1]["digest"] != design.digest:
        entry = {"digest": design.digest, "since": datetime.now(UTC).isoformat(timespec="seconds")}
        write_json(layout.designs, {"designs": [*known, entry]})


def designs(layout: StudyLayout) -> list[dict[str, str]]:
    """Return the designs that the folder was run with, the first one first: `digest`, `since`."""
    found = read_json(layout.designs).get("designs", [])
    listed = found if isinstance(found, list) else []
    return [each for each in listed if isinstance(each, dict) and {"digest", "since"} <= each.keys()]


def check_cell(name: str, jobs: Sequence[StudyJob]) -> None:
    """Check that a study has a cell of a name; none is all."""
    cells = dict.fromkeys(job.cell.name for job in jobs)
    if name and name not in cells:
        raise unknown_name("cell of the study", name, cells)
