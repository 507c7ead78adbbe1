"""Settings of the reinforcement-learning baseline's training; light to import."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated

from msgspec import Meta

from handrail.controllers.errors import HandrailError, check_installed
from handrail.controllers.typed import AtLeastOne, Count, Fraction, NonNegative, check_settings
from handrail.datasets.lists import Numbers

_FREE_ON_RESUME = ("output_dir", "steps", "learning_rate", "save_every", "final_goals", "average", "resume")
_Share = Annotated[float, Meta(gt=0, le=1)]


@dataclass(frozen=True)
class TrainRlConfig:
    """Train the reinforcement-learning baseline: a soft actor-critic drives the base, the arm follows."""

    output_dir: str = "outputs/rl"
    """Folder for checkpoints, TensorBoard curves and the actor."""
    steps: AtLeastOne = 500_000
    """Environment steps, those before a resume included."""
    start_from: str = ""
    """Folder of another run whose last networks this one begins with; its transitions are not taken."""
    seed: Count = 0
    """Seed of the goals, the networks and the exploration."""
    learning_rate: _Share = 1e-4
    """Learning rate of actor, critics and entropy temperature; may be another one after a resume."""
    tau: _Share = 0.001
    """Share of the critics that enters their targets at every update."""
    batch_size: AtLeastOne = 256
    """Transitions an update."""
    random_steps: Count = 10_000
    """Steps with random actions before the first update."""
    train_freq: AtLeastOne = 1
    """Environment steps between updates."""
    layers: Numbers = (512, 512, 256)
    """Hidden layers of actor and critics."""
    temperature: Annotated[float, Meta(gt=0, le=1e12)] = 1.0
    """Weight of the entropy in the beginning; then tuned automatically."""
    failure_cost: NonNegative = 0.0
    """Subtracted from the reward when an episode is given up; without it, giving up early can pay."""
    physics: bool = True
    """Train in MuJoCo physics; without it an ideal robot that does what it is told."""
    repeat_missed: Fraction = 0.0
    """Share of the episodes that try again a goal that was missed before."""
    save_every: AtLeastOne = 20_000
    """Steps between checkpoints, each with an evaluation."""
    goals: AtLeastOne = 50
    """Goals of these evaluations, always the same."""
    final_goals: AtLeastOne = 300
    """Goals of the last evaluation, on which nothing is chosen."""
    average: AtLeastOne = 1
    """The actor at the end is the mean of so many last evaluated ones: steadier than any of them."""
    resume: bool = False
    """Go on from the last checkpoint in the folder."""

    @property
    def folder(self) -> Path:
        """The folder of the run."""
        return Path(self.output_dir).expanduser()

    @property
    def tensorboard(self) -> str:
        """The folder of TensorBoard's curves."""
        return str(self.folder / "tensorboard")

    def check(self) -> None:
        """Check the settings."""
        check_installed("bench rl", ("stable_baselines3", "tensorboard"), "rl")
        check_settings(self, "--")
        if not self.layers or min(self.layers) < 1:
            raise HandrailError(f"--layers {self.layers}: expected sizes of 1 or more")

    def check_continues(self, earlier: "TrainRlConfig") -> None:
        """Check that a run can go on with these settings."""
        for entry in fields(self):
            now, then = getattr(self, entry.name), getattr(earlier, entry.name)
            if entry.name not in _FREE_ON_RESUME and now != then:
                raise HandrailError(f"--resume with --{entry.name} {now}: expected {then} as the run began")
