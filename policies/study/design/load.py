"""Reading a study's design from a TOML file, and checking it whole."""

from pathlib import Path
from typing import Any

import draccus

from handrail.controllers.errors import HandrailError, message_of, unknown_name
from handrail.controllers.strict_toml import read_toml
from handrail.policies.study.design.check import check_design
from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.design.settings import check_jobs

PRESETS = Path(__file__).parent / "presets"


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
    content = read_toml(path, "study")
    check_design(content, f"study {name}")
    design = _design(path.stem, content)
    design.check()
    check_jobs(design)
    return design


def _design(name: str, content: dict[str, Any]) -> StudyDesign:
    from draccus.utils import DecodingError, ParsingError

    try:
        return draccus.decode(StudyDesign, {"name": name, **content})
    except (DecodingError, ParsingError, TypeError, ValueError) as error:
        raise HandrailError(f"study {name}: {message_of(error)}") from error
