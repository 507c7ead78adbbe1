"""Erasing a participant: their answers, their trials, and their rows in the tables."""

from dataclasses import dataclass

from handrail.collect.user_study.design import UserStudy
from handrail.collect.user_study.exports import export
from handrail.collect.user_study.folder import StudyFolder
from handrail.datasets.recording.drop import drop_episodes


@dataclass(frozen=True)
class Erased:
    """What went.

    Attributes:
        name: of the participant.
        answers: how many.
        practice: how many trials of practice.
        trials: episodes by dataset.
    """

    name: str
    answers: int
    practice: int
    trials: dict[str, int]

    def __str__(self) -> str:
        trials = ", ".join(f"{count} of {place}" for place, count in self.trials.items() if count)
        return (
            f"erased {self.name}: {self.answers} answers, {self.practice} trials of practice,"
            f" episodes: {trials or 'none'}; their row of the design is free again"
        )


def erase(folder: StudyFolder, study: UserStudy, name: str) -> Erased:
    """Remove a participant for good; the caller holds the study's lock.

    Their files go last: cut short at any moment, the same command finishes it, and they cannot go on before.

    Raises:
        HandrailError: there is no such participant, or a dataset is damaged or in use.
    """
    who = folder.participant(name)
    who.begin_erasing()
    trials = {}
    for mode in study.modes:
        for task in study.tasks:
            root = folder.dataset(mode, task)
            place = str(root.relative_to(folder.root))
            if (root / "meta" / "handrail.json").exists():
                trials[place] = drop_episodes(root, lambda columns: columns.get("participant") == name)
    export(folder, study)
    answers = sum(len(form.get("items", {})) for form in who.forms.values())
    folder.forget(name)
    return Erased(name, answers, len(who.practice), trials)
