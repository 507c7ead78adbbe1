"""The folder of a user study: whose it is, and which dataset is of which task and condition."""

from dataclasses import dataclass
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.people.scores import DEMO, PEOPLE, Score, read_scores
from handrail.datasets.storage.strict_json import load_json


@dataclass(frozen=True)
class PeopleFolder:
    """What lies in the folder.

    Attributes:
        root: of the study.
        demo: whether the participants are synthetic.
        datasets: folders, by task and condition (a teleop mode).
        scores: what the forms gave; none before the first was filled in.
    """

    root: Path
    demo: bool
    datasets: dict[tuple[str, str], Path]
    scores: tuple[Score, ...]

    @property
    def source(self) -> str:
        """Where the numbers come from: `PEOPLE` or `DEMO`."""
        return DEMO if self.demo else PEOPLE

    @property
    def note(self) -> str:
        """What is said above every table; "" where people took part."""
        return DEMO if self.demo else ""


def read_study(root: Path) -> PeopleFolder:
    """Read what a study's folder holds."""
    described = load_json(root / "study.json", "the study.json of a user study")
    demo = described.get("demo", False) if isinstance(described, dict) else None
    if not isinstance(demo, bool):
        raise HandrailError(f"{str(root / 'study.json')!r}: expected demo to be true or false, got {demo!r}")
    infos = sorted(root.glob("data/*/*/meta/info.json"))
    datasets = {(info.parents[2].name, info.parents[1].name): info.parents[1] for info in infos}
    if not datasets:
        raise HandrailError(f"study {str(root)!r}: expected datasets in data/TASK/MODE, found none yet")
    scores = read_scores(root / "exports" / "scores.csv")
    conditions = {condition for _, condition in datasets}
    for score in scores:
        if score.condition not in conditions:
            raise HandrailError(
                f"{str(root / 'exports' / 'scores.csv')!r}: unknown condition {score.condition!r}:"
                f" expected one of {', '.join(sorted(conditions))}"
            )
    demo |= any(score.source == DEMO for score in scores)
    return PeopleFolder(root, demo, datasets, scores)
