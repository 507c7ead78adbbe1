"""Settings of an encoder's training; light to import."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from msgspec import Meta

from handrail.collect.config import SessionConfig
from handrail.collect.execution.config import MOST_WORKERS
from handrail.collect.flags import check_file, one_of
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.typed import AtLeastOne, Count, check_settings
from handrail.datasets.advanced import Advanced
from handrail.datasets.lists import Names


@dataclass(frozen=True)
class EncoderConfig:
    """Train an encoder, which reads from pictures where things are, on drawn scenes.

    The same command goes on with one that was begun.
    """

    output: str = "outputs/encoder.safetensors"
    """File of the encoder."""
    task: Annotated[str, one_of(TASKS)] = "reach"
    """Its scenes."""
    robot: Annotated[str, one_of(ROBOTS)] = "ridgeback_ur10"
    """A robot, or a description file (.toml)."""
    cameras: Names = "front,wrist"
    """Cameras of the robot that it reads."""
    image_size: int | str = 224
    """Size of the pictures [pixels]: of a square's side, or WIDTHxHEIGHT."""
    updates: AtLeastOne = 3000
    """Updates in all."""
    batch_size: Advanced[AtLeastOne] = 32
    """Samples an update."""
    reuse: Advanced[Annotated[float, Meta(gt=0, le=100)]] = 3.0
    """How often a sample is learnt from, on average."""
    lr: Advanced[Annotated[float, Meta(gt=0, le=1)]] = 1e-3
    """Highest learning rate."""
    seed: Count = 0
    """Seed of the scenes and the first weights."""
    device: Advanced[str] = "cpu"
    """Where it learns: cpu, cuda, mps."""
    workers: Advanced[Annotated[int, Meta(ge=0, le=MOST_WORKERS)]] = 1
    """Processes that draw scenes; 0 draws them in between."""
    threads: Advanced[AtLeastOne] = 1
    """PyTorch's."""
    overwrite: Advanced[bool] = False
    """Begin anew, whatever is there."""

    @property
    def file(self) -> Path:
        """Where the encoder will be."""
        return Path(self.output).expanduser()

    @property
    def session(self) -> SessionConfig:
        """The session that draws its scenes and pictures."""
        seen = {"cameras": self.cameras, "image_size": self.image_size}
        return SessionConfig(task=self.task, robot=self.robot, **seen)

    def check(self) -> None:
        """Check what can be checked without loading anything heavy."""
        check_settings(self, "--")
        check_file("--output", self.output, ".safetensors")
        self.session.check()
        if not self.session.camera_names:
            raise HandrailError("--cameras: expected a camera or more, got none")
