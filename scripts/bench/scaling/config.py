"""Settings of the bench `scaling`; light to import."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from handrail.collect.execution.config import MOST_WORKERS, ExecutionConfig
from handrail.collect.flags import check_names, one_of
from handrail.collect.operators.modes import MODES
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import AtLeastOne, Count
from handrail.datasets.lists import Names
from handrail.scripts.bench.report import ReportConfig


@dataclass(frozen=True)
class ScalingConfig(ReportConfig):
    """Measure how many episodes a second some workers record, against one, and that the rows are the same."""

    task: Annotated[str, one_of(TASKS)] = "reach"
    """What is recorded."""
    mode: Annotated[str, one_of(MODES)] = "ee"
    """In which teleop mode."""
    cameras: Names = ""
    """With which cameras: wrist, scene or both; none by default."""
    episodes: AtLeastOne = 60
    """Episodes of each recording."""
    workers: Names = "1,2"
    """Numbers of workers, each a recording of its own; the first is what the others are compared with."""
    ray: str = ""
    """One recording more, on a Ray cluster: auto, or its address (see docs/cluster.md)."""
    folder: str = ""
    """Where the recordings lie meanwhile, the system's folder for such files by default; with --ray, one that
    all computers of the cluster see."""
    seed: Count = 0
    """Of the recordings."""

    @property
    def places(self) -> tuple[ExecutionConfig, ...]:
        """Where it is recorded, one after the other."""
        words = [word.strip() for word in self.workers.split(",")]
        if not all(word.isdecimal() and 1 <= int(word) <= MOST_WORKERS for word in words):
            words = f"expected whole numbers from 1 to {MOST_WORKERS}, such as 1,2"
            raise HandrailError(f"--workers {self.workers}: {words}")
        shared = (ExecutionConfig(ray=self.ray),) if self.ray else ()
        return (*(ExecutionConfig(workers=int(word)) for word in words), *shared)

    def check(self) -> None:
        """Check the settings."""
        super().check()
        check_names("task", "--task", (self.task,), TASKS)
        check_names("mode", "--mode", (self.mode,), MODES)
        for place in self.places:
            place.check_execution()
        if self.folder and not Path(self.folder).expanduser().is_dir():
            raise HandrailError(f"--folder {self.folder}: expected a folder, found none")
