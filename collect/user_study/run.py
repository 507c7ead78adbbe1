"""What `handrail-user-study` does, verb by verb."""

import time
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass

from handrail.collect.cockpit.cards import Cards
from handrail.collect.cockpit.process import ServerProcess
from handrail.collect.user_study.conduct import Conductor, Ending
from handrail.collect.user_study.config import StudySessionConfig
from handrail.collect.user_study.design import UserStudy
from handrail.collect.user_study.driving import Driving
from handrail.collect.user_study.exports import export
from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.plan import plan
from handrail.controllers.interrupts import Interrupts
from handrail.datasets.editing.pack import drop_episodes
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.terminal import Terminal

_FAREWELL = 1.0  # in which the page shows its last card [s]
Say = Callable[[str], None]


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


def status(folder: StudyFolder, study: UserStudy) -> Table:
    """Return a table of the participants: what is done, and what comes next."""
    rows = []
    for who in folder.participants():
        steps, left = plan(study, who.slot), folder.left(study, who)
        stands = "being erased" if who.erasing else str(left[0]) if left else "done"
        rows.append((who.name, ", ".join(who.modes), f"{len(steps) - len(left)} of {len(steps)}", stands))
    return Table(("participant", "order", "steps done", "next"), tuple(rows))


def study_session(config: StudySessionConfig) -> int:
    """Do what the command line says; return the exit code."""
    folder, say = StudyFolder(config.folder), Terminal(stderr=True).print
    if config.verb == "new":
        say(f"Written: {folder.write_example()}")
        say(f"Change it, then: handrail-user-study run {folder.root} P001")
        return 0
    if config.verb == "status":
        return _status(folder)
    lock = folder.lock()
    try:
        study = folder.study()
        folder.settle(study)
        if config.verb == "run":
            return _run(config, folder, study, say)
        if config.verb == "erase":
            say(str(erase(folder, study, config.participant)))
        else:
            say("Written: " + ", ".join(map(str, export(folder, study))))
    finally:
        lock.release()
    return 0


def _status(folder: StudyFolder) -> int:
    study = folder.study()
    console = Terminal()
    console.print(f"{study.title} ({study.source})")
    console.print(status(folder, study) if folder.participants() else "nobody has begun")
    return 0


def _run(config: StudySessionConfig, folder: StudyFolder, study: UserStudy, say: Say) -> int:
    who = folder.welcome(config.participant, study)
    folder.freeze()
    if study.demo:
        say(study.source)
    server = ServerProcess(config.cockpit)
    try:
        say(f"Drive at {server.address}")
        if config.cockpit.opens:
            webbrowser.open(server.address)
        with Interrupts() as interrupts, Driving(folder, study, who.name, server, interrupts) as driving:
            ending = Conductor(folder, study, who, Cards(server), driving, say).run()
            time.sleep(_FAREWELL)
    finally:
        server.close()
    if ending is Ending.REFUSED:
        erase(folder, study, who.name)
        say(f"{who.name} does not take part: nothing is kept")
        return 0
    export(folder, study)
    again = f"; go on: handrail-user-study run {folder.root} {who.name}"
    say(f"{who.name}: {ending}" + (again if ending is Ending.PAUSED else f"; tables in {folder.exports}"))
    return 0
