"""What a user study consists of; light to import. `example.toml` explains every entry."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from handrail.collect.cockpit_config import CockpitConfig
from handrail.collect.config import DatasetConfig, RecordConfig

DEMO_NOTE = "demo data: no people took part"
FORMS = ("tlx", "tlx_raw", "sus", "questions")
WHEN = ("condition", "start", "end")
KINDS = ("likert", "number", "choice", "text")
ALLOWED = ("mode", "mask", "undo", "discard", "restart", "success")


@dataclass(frozen=True)
class Practice:
    """How long is practised before the trials of a task in a mode.

    Attributes:
        successes: in a row, after which the trials begin.
        most: trials of practice, after which they begin anyway; 0 for no practice.
    """

    successes: int = 2
    most: int = 6


@dataclass(frozen=True)
class Question:
    """A question of one's own.

    Attributes:
        name: in the tables.
        text: the question.
        kind: `likert`, `number`, `choice` or `text`.
        when: after each `condition`, at the `start` or at the `end`.
        points: of a likert scale, from 1.
        low: what its first point says.
        high: what its last point says.
        least: smallest number.
        most: largest number.
        choices: of a choice.
    """

    name: str
    text: str
    kind: str
    when: str = "condition"
    points: int = 7
    low: str = ""
    high: str = ""
    least: float = 0.0
    most: float = 100.0
    choices: tuple[str, ...] = ()


@dataclass(frozen=True)
class UserStudy:
    """A whole user study; a mode is a condition of it.

    Attributes:
        title: for participants.
        consent: what they read first.
        modes: teleop modes, the conditions.
        tasks: done in each.
        trials: of each task in each mode, recorded.
        practice: before these.
        forms: after each condition.
        questions: of one's own.
        instructions: what is said of a mode, instead of its one line of help.
        allow: what a participant may do beside driving: some of `ALLOWED`.
        thanks: said at the end.
        robot: that is driven.
        fps: recording rate [Hz].
        cameras: to record.
        image_size: of the pictures [pixels].
        time_limit: of a trial [s]; the task's own when 0.
        seed: of scenes and orders.
        demo: whether participants are synthetic, which every table says then.
    """

    title: str
    consent: str
    modes: tuple[str, ...]
    tasks: tuple[str, ...]
    trials: int = 3
    practice: Practice = field(default_factory=Practice)
    forms: tuple[str, ...] = ("tlx", "sus")
    questions: tuple[Question, ...] = ()
    instructions: Mapping[str, str] = field(default_factory=dict)
    allow: tuple[str, ...] = ()
    thanks: str = "Thank you for taking part."
    robot: str = "ridgeback_ur10"
    fps: int = 20
    cameras: tuple[str, ...] = ()
    image_size: int = 128
    time_limit: float = 0.0
    seed: int = 0
    demo: bool = False

    @property
    def source(self) -> str:
        """Who the data are of, as every table says."""
        return DEMO_NOTE if self.demo else "people"

    def recording(
        self, mode: str, task: str, folder: Path, cockpit: CockpitConfig | None = None
    ) -> RecordConfig:
        """Return the settings with which a task is recorded in a mode.

        Args:
            mode: the condition.
            task: that is done.
            folder: of the dataset; what is there already is added to.
            cockpit: where the page is.
        """
        return RecordConfig(
            task=task,
            mode=mode,
            operator="browser",
            robot=self.robot,
            cameras=",".join(self.cameras),
            image_size=self.image_size,
            time_limit=self.time_limit,
            seed=self.seed,
            dataset=DatasetConfig(place=str(folder), repo_id="handrail/user_study", fps=self.fps),
            resume=(folder / "meta" / "handrail.json").exists(),
            cockpit=cockpit or CockpitConfig(),
        )
