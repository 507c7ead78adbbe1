"""Settings of the reinforcement-learning baseline's training; light to import."""

from dataclasses import dataclass, fields
from pathlib import Path

from handrail.collect.flags import check_whole
from handrail.controllers.errors import HandrailError
from handrail.datasets.lists import Numbers
from handrail.policies.imitation.config import check_installed

_FREE_ON_RESUME = (
    *("output_dir", "steps", "learning_rate", "save_every", "final_goals", "average"),
    *("threads", "resume", "overwrite"),
)
_COUNTS = (
    *("steps", "batch_size", "buffer_size", "train_freq", "gradient_steps", "save_every"),
    *("goals", "final_goals", "average", "threads"),
)
_RANGES = (
    (("action_change", "action_size", "failure_cost"), lambda value: value >= 0.0, "0 or more"),
    (("gamma", "tau", "learning_rate"), lambda value: 0.0 < value <= 1.0, "a number in (0, 1]"),
    (("repeat_missed",), lambda value: 0.0 <= value <= 1.0, "a share from 0 to 1"),
    (("temperature", "reward_scale"), lambda value: value > 0.0, "a positive number"),
)


@dataclass(frozen=True)
class TrainRlConfig:
    """Train the reinforcement-learning baseline: a soft actor-critic drives the base, the arm follows."""

    output_dir: str = "outputs/rl"
    """Folder for checkpoints, TensorBoard curves and the actor."""
    steps: int = 500_000
    """Environment steps, those before a resume included."""
    start_from: str = ""
    """Folder of another run whose last networks this one begins with; its transitions are not taken."""
    seed: int = 0
    """Of the goals, the networks and the exploration."""
    learning_rate: float = 1e-4
    """Of actor, critics and entropy temperature; may be another one after a resume."""
    gamma: float = 0.99
    """Discount of the reward a step."""
    tau: float = 0.001
    """Share of the critics that enters their targets at every update."""
    batch_size: int = 256
    """Transitions an update."""
    buffer_size: int = 100_000
    """Transitions kept."""
    random_steps: int = 10_000
    """Steps with random actions before the first update."""
    train_freq: int = 1
    """Environment steps between updates."""
    gradient_steps: int = 1
    """Updates each time."""
    layers: Numbers = (512, 512, 256)
    """Hidden layers of actor and critics."""
    temperature: float = 1.0
    """Of the entropy in the beginning; then tuned automatically."""
    action_change: float = 0.05
    """Weight of the squared change of the action in the reward."""
    action_size: float = 0.05
    """Weight of the squared action in the reward."""
    failure_cost: float = 0.0
    """Subtracted from the reward when an episode is given up; without it, giving up early can pay."""
    physics: bool = True
    """Train in MuJoCo physics; without it an ideal robot that does what it is told."""
    reward_scale: float = 1.0
    """Factor of the whole reward."""
    repeat_missed: float = 0.0
    """Share of the episodes that try again a goal that was missed before."""
    save_every: int = 20_000
    """Steps between checkpoints, each with an evaluation."""
    goals: int = 50
    """Goals of these evaluations, always the same."""
    final_goals: int = 300
    """Goals of the last evaluation, on which nothing is chosen."""
    average: int = 1
    """The actor at the end is the mean of so many last evaluated ones: steadier than any of them."""
    threads: int = 1
    """Of PyTorch."""
    resume: bool = False
    """Go on from the last checkpoint in the folder."""
    overwrite: bool = False
    """Remove the run that is there."""

    @property
    def folder(self) -> Path:
        """The folder of the run."""
        return Path(self.output_dir).expanduser()

    def check(self) -> None:
        """Check the settings."""
        check_installed("bench rl", ("stable_baselines3", "tensorboard"), extra="rl")
        check_whole(self, **dict.fromkeys(_COUNTS, 1), seed=0, random_steps=0)
        for names, fits, expected in _RANGES:
            for name in names:
                if not fits(getattr(self, name)):
                    raise HandrailError(f"--{name} {getattr(self, name)}: expected {expected}")
        if not self.layers or min(self.layers) < 1:
            raise HandrailError(f"--layers {self.layers}: expected sizes of 1 or more")
        if self.resume and self.overwrite:
            raise HandrailError("--resume and --overwrite: expected one of them, got both")

    def check_continues(self, earlier: "TrainRlConfig") -> None:
        """Check that a run can go on with these settings."""
        for entry in fields(self):
            now, then = getattr(self, entry.name), getattr(earlier, entry.name)
            if entry.name not in _FREE_ON_RESUME and now != then:
                raise HandrailError(f"--resume with --{entry.name} {now}: expected {then} as the run began")
