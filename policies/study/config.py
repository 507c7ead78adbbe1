"""Settings of `handrail-study`; light to import."""

from dataclasses import dataclass
from pathlib import Path

from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.flags import check_file
from handrail.controllers.errors import HandrailError


@dataclass(frozen=True)
class StudyConfig(ExecutionConfig):
    """Collect, train, evaluate and compare: teleop modes × tasks × draws, from one design."""

    preset: str = "quick"
    """Which study: quick, answer, amount, parts, errors, pictures, takeover, or a file of your own that
    ends in .toml (see policies/study/presets)."""
    output: str = "outputs/study"
    """Folder of datasets, policies, evaluations and report; what is done there is not done again."""
    page: str = ""
    """Also write tables and figures into this Markdown file (.md), between marks."""
    report_only: bool = False
    """Only write the report of what is done so far."""
    plan: bool = False
    """Only say what the study declares and what it can detect; nothing is run."""
    only: str = ""
    """Only the jobs of this cell, TASK/MODE/DRAW such as reach/ee/3: the same data and the same rollouts."""

    @property
    def folder(self) -> Path:
        """The study's folder."""
        return Path(self.output).expanduser().absolute()

    def check(self) -> None:
        """Check the settings."""
        self.check_execution()
        if self.folder.exists() and not self.folder.is_dir():
            raise HandrailError(f"--output {self.output}: expected a folder, found a file")
        if self.report_only and not any((self.folder / name).is_dir() for name in ("begun", "done")):
            raise HandrailError(f"--report_only: expected a study in --output {self.output}, found none")
        check_file("--page", self.page, ".md")
