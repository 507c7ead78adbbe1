"""Settings of a comparison; light to import."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import Count, Positive, check_settings
from handrail.datasets.advanced import Advanced
from handrail.datasets.lists import Words
from handrail.datasets.reading.columns import ColumnNames
from handrail.datasets.storage.atomic import check_room


@dataclass(frozen=True)
class CompareConfig:
    """Compare LeRobot datasets, or the teleop modes in one, and write a report."""

    datasets: Annotated[tyro.conf.Positional[Words], tyro.conf.arg(metavar="FOLDER [FOLDER …]")] = ()
    """Folders of LeRobot v3.0 datasets, whoever recorded them; with --study, of scripted operators."""
    output: str = "outputs/compare"
    """Folder for report.html, report.json, episodes.csv and differences.csv."""
    by: str = ""
    """Split each dataset by this column of its episodes' metadata: mode, operator, success, …"""
    labels: Words = ()
    """A name for each dataset; the folders' names when empty."""
    baseline: str = ""
    """The dataset that the others are compared with; the first when empty."""
    evaluations: Words = ()
    """JSON files of what policies trained on the datasets did."""
    success_only: bool = False
    """Measure quality on episodes that did not fail."""
    margin: Advanced[Positive] = 0.1
    """Distance to keep, for the time within it [m]."""
    pictures: Advanced[bool] = True
    """Show first pictures of the cameras."""
    seed: Advanced[Count] = 0
    """Seed of the resampling: the same seed gives the same report."""
    verify: Advanced[bool] = False
    """Read every file of the datasets anew, not only those that have changed since they were checked."""
    study: str = ""
    """The folder of a user study: its conditions are compared, paired by participant."""
    columns: Advanced[ColumnNames] = field(default_factory=ColumnNames)

    @property
    def folder(self) -> Path:
        """The folder of the report."""
        return Path(self.output).expanduser()

    def check(self) -> None:
        """Check what can be checked without reading anything."""
        if self.study:
            self._check_study()
        elif not self.datasets:
            raise HandrailError("dataset: expected one folder or more, before the flags; got none")
        check_settings(self, "--")
        check_room(f"--output {self.output}", self.folder)

    def _check_study(self) -> None:
        """Check that nothing is asked for that a comparison of people does not have."""
        for name in ("by", "labels", "evaluations", "success_only"):
            if getattr(self, name):
                raise HandrailError(f"--{name}: expected it without --study, got both")
