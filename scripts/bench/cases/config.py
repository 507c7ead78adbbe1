"""Settings of the showcase; light to import."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from handrail.controllers.errors import HandrailError, unknown_name

CASES = ("a", "b", "c")


@dataclass(frozen=True)
class ShowcaseConfig:
    """Run one of the paper's three cases: a: steer the hand; b: steer the base; c: circle, the hand held."""

    case: tyro.conf.Positional[str]
    """Which: a, b or c."""
    output: str = "outputs/showcase"
    """Folder for the video, the figure and the JSON."""
    seconds: float = 0.0
    """How long [s]; the case's own length when 0."""
    video: bool = True
    """Whether to make the video (needs OpenGL)."""

    @property
    def folder(self) -> Path:
        """The folder to write to."""
        return Path(self.output).expanduser()

    def check(self) -> None:
        """Check what can be checked without loading anything heavy."""
        if self.case not in CASES:
            raise unknown_name("case", self.case, CASES)
        if self.seconds != 0 and not 0.5 <= self.seconds <= 120.0:
            raise HandrailError(
                f"--seconds {self.seconds}: expected 0.5 to 120, or 0 for the case's own length"
            )
        if self.folder.exists() and not self.folder.is_dir():
            raise HandrailError(f"--output {self.output}: expected a folder, found a file")
