"""What `handrail-study-session` does, verb by verb."""

import time
import webbrowser
from collections.abc import Callable

from handrail.collect.cockpit.cards import Cards
from handrail.collect.cockpit.process import ServerProcess
from handrail.collect.user_study.conduct import Conductor, Ending
from handrail.collect.user_study.config import StudySessionConfig
from handrail.collect.user_study.design import UserStudy
from handrail.collect.user_study.driving import Driving
from handrail.collect.user_study.erase import erase
from handrail.collect.user_study.exports import export
from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.status import status
from handrail.controllers.interrupts import Interrupts
from handrail.datasets.presentation.terminal import Terminal

_FAREWELL = 1.0  # in which the page shows its last card [s]
Say = Callable[[str], None]


def study_session(config: StudySessionConfig) -> int:
    """Do what the command line says; return the exit code.

    Raises:
        HandrailError: a setting or the study's file is wrong, or a file is damaged.
    """
    folder, say = StudyFolder(config.folder), Terminal(stderr=True).print
    if config.verb == "new":
        say(f"Written: {folder.write_example()}")
        say(f"Change it, then: handrail-study-session run {folder.root} P001")
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
    again = f"; go on: handrail-study-session run {folder.root} {who.name}"
    say(f"{who.name}: {ending}" + (again if ending is Ending.PAUSED else f"; tables in {folder.exports}"))
    return 0
