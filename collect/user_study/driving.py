"""Practice and trials of one participant in the cockpit; trials are recorded."""

from typing import Self

from handrail.collect.cockpit.cockpit import Cockpit
from handrail.collect.cockpit.pipe import STOP
from handrail.collect.cockpit.process import ServerProcess
from handrail.collect.commands.recording import Recording, come_first, open_writer
from handrail.collect.operators.modes import TeleopMode
from handrail.collect.session.build import build_env, build_modes
from handrail.collect.session.outcome import Outcome
from handrail.collect.user_study.design import ALLOWED, UserStudy
from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.plan import Step, trial_seed
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interrupts import Interrupts
from handrail.datasets.recording.writer import EpisodeWriter


class Driving:
    """Runs the episodes of a participant; in a `with`, which closes dataset and scene.

    Args:
        folder: of the study.
        study: it.
        name: of the participant.
        server: of the page.
        interrupts: that wait until an episode is saved.
    """

    def __init__(
        self, folder: StudyFolder, study: UserStudy, name: str, server: ServerProcess, interrupts: Interrupts
    ) -> None:
        self._folder, self._study, self._name = folder, study, name
        self._server, self._interrupts = server, interrupts
        self._env: HandrailEnv | None = None
        self._writer: EpisodeWriter | None = None
        self._refuses = frozenset(ALLOWED) - frozenset(study.allow) | {"practice"}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def prepare(self, mode: str, task: str) -> None:
        """Make a task in a mode ready: the scene, the controller, the dataset."""
        self.close()
        come_first()
        config = self._study.recording(mode, task, self._folder.dataset(mode, task))
        # render: the page draws the robot's meshes
        env = self._env = build_env(config, self._study.fps, render=True)
        seed = trial_seed(self._study, task, 0)  # a scene that no trial has
        env.reset(seed=seed)
        self._writer = open_writer(config, env)
        modes = build_modes(config, env)
        self._mode, self.task = modes[mode], env.task_description
        offered = self._study.modes if "mode" in self._study.allow else (mode,)
        modes = {name: modes[name] for name in offered}
        before: Cockpit | None = getattr(self, "_cockpit", None)
        if before and before.is_stopped:
            self._server.unread.append((STOP, b""))  # a STOP holds until somebody releases it
        self._cockpit = Cockpit(env.model, modes, mode, self._server, self._refuses)
        self._recording = Recording(config, env, self._writer, [self._cockpit])
        self._recording.warm_up(seed)

    @property
    def help(self) -> str:
        """What the mode is, in one line."""
        return self._mode.help

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the channels that the operator owns, whatever they attend to."""
        assert self._env is not None
        return _owned(self._mode, Channels.of(self._env.model.description))

    def run(self, step: Step, seed: int) -> Outcome:
        """Run a trial, or one of practice, and return how it went."""
        self._cockpit.practise(step.kind == "practice")
        self._recording.columns |= {"participant": self._name, "trial": step.trial}
        return self._recording.episode(seed, self._interrupts)

    def close(self) -> None:
        """Close the dataset and the scene; safe to call twice."""
        writer, env, self._writer, self._env = self._writer, self._env, None, None
        if writer:
            writer.close()
        if env:
            env.close()


def _owned(mode: TeleopMode, channels: Channels) -> tuple[str, ...]:
    mask = channels.mask(*mode.groups("hand")) | channels.mask(*mode.groups("base"))
    return tuple(name for name, own in zip(channels.names, mask, strict=True) if own)
