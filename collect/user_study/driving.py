"""Practice and trials of one participant in the cockpit; trials are recorded."""

from contextlib import ExitStack, closing
from dataclasses import dataclass
from typing import Self

from handrail.collect.cockpit.cockpit import Cockpit
from handrail.collect.cockpit.pipe import Kind
from handrail.collect.cockpit.process import ServerProcess
from handrail.collect.commands.recording import Recording, come_first, open_writer
from handrail.collect.operators.person.person import Person, Phase
from handrail.collect.session.build import build_env, build_modes
from handrail.collect.session.outcome import Outcome
from handrail.collect.user_study.design import ALLOWED
from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.plan import Step, trial_seed
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interrupts import Interrupts


@dataclass(frozen=True)
class Briefing:
    """A participant's task in a mode, in words, and the channels that they own, whatever they attend to."""

    task: str
    help: str
    channels: tuple[str, ...]


class Driving:
    """Runs the episodes of a participant; in a `with`, which closes dataset and scene."""

    def __init__(self, folder: StudyFolder, name: str, server: ServerProcess, interrupts: Interrupts) -> None:
        self._folder, self._name = folder, name
        self._server, self._interrupts = server, interrupts
        self._open = ExitStack()  # dataset and scene of the task in the mode
        self._cockpit: Cockpit | None = None
        self._recording: Recording | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def prepare(self, mode: str, task: str) -> Briefing:
        """Make a task in a mode ready: the scene, the controller, the dataset."""
        self._open.close()
        come_first()
        study = self._folder.study
        config = study.recording(mode, task, self._folder.dataset(mode, task))
        # render: the page draws the robot's meshes
        env = self._open.enter_context(closing(build_env(config, study.fps, render=True)))
        seed = trial_seed(study, task, 0)  # a scene that no trial has
        env.reset(seed=seed)
        writer = self._open.enter_context(closing(open_writer(config, env)))
        modes, channels = build_modes(config, env), Channels.of(env.model.description)
        offered = study.modes if "mode" in study.allow else (mode,)
        if self._cockpit and self._cockpit.person.phase is Phase.STOPPED:
            self._server.unread.append((Kind.STOP, None))  # a STOP holds until somebody releases it
        refuses = frozenset(ALLOWED) - frozenset(study.allow) | {"practice"}
        if "mask" in refuses:
            refuses |= {"lock"}  # it changes the mask, too
        person = Person(env.model, {name: modes[name] for name in offered}, mode)
        person.again = {"mode": modes[mode], "locked": ()}
        self._cockpit = Cockpit(person, self._server, refuses)
        self._recording = Recording(config, env, self._cockpit)
        self._recording.into(writer)
        self._recording.warm_up(seed)
        self._cockpit.begin(env, seed)  # the card that comes says keys: of this robot and task
        hand = env.model.hand.name
        mask = channels.mask(*modes[mode].owned("hand", hand), *modes[mode].owned("base", hand))
        owned = tuple(name for name, own in zip(channels.names, mask, strict=True) if own)
        return Briefing(env.task.description, modes[mode].help, owned)

    def run(self, step: Step, seed: int) -> Outcome:
        """Run a trial, or one of practice, and return how it went."""
        assert self._cockpit
        assert self._recording
        self._cockpit.person.practises = step.kind == "practice"
        self._recording.columns |= {"participant": self._name, "trial": step.trial}
        return self._recording.episode(seed, self._interrupts)
