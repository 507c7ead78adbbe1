"""What `handrail-fit-operator` asks for; light to import."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from handrail.collect.flags import check_json, check_whole
from handrail.controllers.errors import HandrailError
from handrail.datasets.lists import Words


@dataclass(frozen=True)
class FitOperatorConfig:
    """Fit the scripted operator to recorded people, and say how far they are from its defaults."""

    datasets: Annotated[tyro.conf.Positional[Words], tyro.conf.arg(metavar="FOLDER [FOLDER …]")]
    """Folders of datasets of handrail-record or handrail-cockpit."""
    participant: str = ""
    """Only the episodes of this participant; everyone's when empty."""
    device: str = ""
    """Only what was steered with this device: keyboard, gamepad, …; every device when empty."""
    episodes: int = 30
    """Use at most so many episodes, evenly chosen: more take longer."""
    draws: int = 150
    """Scripted operators that are tried in each round."""
    output: str = ""
    """Also write everything to this .json file."""
    seed: int = 0
    """Of the scripted operators: the same seed gives the same fit."""

    def check(self) -> None:
        """Check what can be checked without reading anything.

        Raises:
            HandrailError: one setting is wrong.
        """
        if not self.datasets:
            raise HandrailError("dataset: expected one folder or more, before the flags; got none")
        check_whole(self, episodes=1, draws=50, seed=0)
        if self.output and not self.output.endswith(".json"):
            raise HandrailError(f"--output {self.output}: expected a file that ends in .json")
        check_json(self.output, "--output")
