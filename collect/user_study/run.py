"""The verbs of `handrail-user-study`."""

import shlex
import sys
from collections.abc import Callable

from handrail.collect.cockpit.cards import Cards
from handrail.collect.cockpit.cockpit import NEEDED
from handrail.collect.cockpit.pipe import Kind
from handrail.collect.cockpit.process import open_server
from handrail.collect.user_study.conduct import Conductor, Ending
from handrail.collect.user_study.config import StudySessionConfig
from handrail.collect.user_study.driving import Driving
from handrail.collect.user_study.exports import export
from handrail.collect.user_study.folder import StudyFolder
from handrail.controllers.errors import check_installed
from handrail.controllers.interrupts import Interrupts
from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.editing.merge import drop_episodes
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.terminal import Terminal


def study_session(config: StudySessionConfig) -> int:
    """Do what the command line says; return the exit code."""
    folder, say = StudyFolder(config.folder), Terminal(stderr=True).print
    if config.verb == "new":
        say(f"Written: {folder.write_example()}")
        say(f"Change it, then: handrail-user-study run {shlex.quote(str(folder.root))} P001")
        return 0
    study = folder.study  # there is one, before anything is made in the folder
    if config.verb == "status":
        console = Terminal()
        console.print(f"{study.title} ({study.source})")
        console.print(status(folder) if folder.participants() else "nobody has begun")
        return 0
    with folder.lock():
        folder.settle()
        if config.verb == "run":
            _run(config, folder, say)
        elif config.verb == "erase":
            say(erase(folder, config.participant))
        else:
            say("Written: " + ", ".join(map(str, export(folder))))
    return 0


def status(folder: StudyFolder) -> Table:
    """Return a table of the participants: what is done, and what comes next."""
    rows = []
    for who in folder.participants().values():
        steps, left, session = folder.steps(who), folder.left(who), who.session
        stands = "being erased" if session.erasing else str(left[0]) if left else "done"
        rows.append((who.name, ", ".join(session.modes), f"{len(steps) - len(left)} of {len(steps)}", stands))
    return Table(("participant", "order", "steps done", "next"), tuple(rows))


def erase(folder: StudyFolder, name: str) -> str:
    """Remove a participant for good and return what went, in words; the caller holds the study's lock.

    Their files go last: cut short at any moment, the same command finishes it, and they cannot go on before.
    """
    who, trials = folder.participant(name), []
    who.keep(erasing=True)
    for _, _, root in folder.conditions:
        if any(root.glob("meta/*")):
            count = drop_episodes(root, lambda columns: columns.get("participant") == name)
            trials += [f"{count} of {root.relative_to(folder.root)}"] if count else []
    export(folder)
    answers = sum(len(form.items) for form in who.forms.values())
    folder.forget(name)
    return (
        f"erased {name}: {answers} answers, {len(who.session.practice)} trials of practice,"
        f" episodes: {', '.join(trials) or 'none'}; their row of the design is free again"
    )


def _run(config: StudySessionConfig, folder: StudyFolder, say: Callable[[str], None]) -> None:
    check_installed(*NEEDED)
    who = folder.welcome(config.participant)
    if folder.study.demo:
        say(folder.study.source)
    was, now = folder.frozen.versions, versions(*SIMULATION)
    if changed := [f"{name} {now[name]} (was {was.get(name)})" for name in now if now[name] != was.get(name)]:
        say(f"other versions than at the study's beginning: {', '.join(changed)}")
    server = open_server(config.cockpit, say)
    try:
        with Interrupts() as interrupts, Driving(folder, who.name, server, interrupts) as driving:
            ending = Conductor(folder, who, Cards(server), driving, say).run()
            if ending is Ending.REFUSED:
                erase(folder, who.name)
    finally:  # a page that goes on trying would take the next participant's session
        over = {"participant": who.name, "trouble": str(sys.exception() or "")}
        server.pipe.send_surely(Kind.OVER, over)
        server.close()
        export(folder)
    if ending is Ending.REFUSED:
        say(f"{who.name} does not take part: nothing is kept")
        return
    again = f"; go on: handrail-user-study run {shlex.quote(str(folder.root))} {who.name}"
    say(f"{who.name}: {ending}" + (again if ending is Ending.PAUSED else f"; tables in {folder.exports}"))
