"""One rollout of a trained policy through the one session loop."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import Operator
from handrail.collect.session.build import build_controller, build_env
from handrail.collect.session.disturbances import DelayedOperator, OtherPictures, Pusher
from handrail.collect.session.outcome import Outcome
from handrail.collect.session.perturbations import Perturbation
from handrail.collect.session.session import Observer, Session
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.baselines.unprotected import unprotected_controller
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.controller import Controller
from handrail.datasets.recording.frames import Frame
from handrail.policies.imitation.evaluation.conditions import PolicyCondition, own_protection
from handrail.policies.imitation.evaluation.policy_operator import PolicyOperator
from handrail.policies.imitation.interface.compute import threads
from handrail.policies.imitation.interface.trained import TrainedPolicy, repeatable

Load = Callable[[Path], TrainedPolicy]
Row = dict[str, Any]
_STAND_IN = {"mpc": "joints", "filter": "direct_filtered"}  # the mode whose controller it is
_LATELY = 5.0  # [s]
_STILL = 0.05  # extent of the tool's way in that time, at the scale of the robot's world [m]


class RolloutProgress:
    """Watches a rollout: the furthest stage of the task that it came to, and whether it stood still.

    Attributes:
        told: `distances` of the tool to where it is to go, one a second [m], of several the nearest, or of
            the middle between them; and when it touched something first, `first_contact` [s]; what there is.
    """

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note that an episode begins."""
        self._env, self._frames = env, 0
        self.told: dict[str, Any] = {"distances": []}
        self._furthest, self._stage = -1, -1
        self._tools: deque[FloatArray] = deque(maxlen=max(2, round(_LATELY * env.fps)))

    def see(self, frame: Frame) -> None:
        """Look at the truth of this moment."""
        state, task = self._env.task_state(), self._env.task
        if self._frames % round(self._env.fps) == 0 and (aim := task.aim(state)):
            places = [state.tool.position]
            if len(state.tools) > 1:  # the hands do it in turn, or with it between them
                places = [*(tool.position for tool in state.tools), state.pair.position]
            least = np.linalg.norm(np.array(places) - aim.position, axis=1).min()
            self.told["distances"].append(round(float(least), 3))
        if frame.contacts:
            self.told.setdefault("first_contact", round(self._frames / self._env.fps, 6))
        self._frames += 1
        self._tools.append(np.concatenate([tool.position for tool in state.tools]))
        if task.stages:
            self._stage = task.stages.index(task.stage(state))
            self._furthest = max(self._furthest, self._stage)

    def failed(self, outcome: Outcome) -> dict[str, str]:
        """Return of a failure the furthest `stage`, if the task has stages, and how it `ended`.

        `dropped`: what it had in hand; `stalled`: the tools stayed within 5 cm for the last 5 s; `moving`.
        """
        task = self._env.task
        named = {"stage": task.stages[self._furthest]} if task.stages else {}
        if outcome.failure_reason == "dropped" or self._fell_back:
            return named | {"ended": "dropped"}
        extent = float(np.linalg.norm(np.ptp(np.array(self._tools), axis=0)))
        still = extent < _STILL * self._env.model.description.world.scale
        return named | {"ended": "stalled" if still else "moving"}

    @property
    def _fell_back(self) -> bool:
        """Whether what had been lifted is in the hand no more."""
        stages = self._env.task.stages
        return "carry" in stages and self._stage < stages.index("carry") <= self._furthest


def run_rollout(
    condition: PolicyCondition,
    seed: int,
    load: Load,
    observers: Sequence[Observer] = (),
    render: tuple[int, int] | bool = False,
) -> Row:
    """Run a policy once and return how it went, as an evaluation file has it.

    Args:
        condition: policy, and what protects and disturbs it.
        seed: of the episode.
        load: reads the policy of a folder.
        observers: shown every moment.
        render: height and width of good-looking pictures that the environment draws [px], if it does.
    """
    checkpoint, perturbation = condition.checkpoint, condition.perturbation
    meta = checkpoint.meta
    config = _session_config(condition)
    env = _env(config, meta.fps, perturbation, render)
    controller = _controller(condition.protection, meta.intent_mode, meta.environment, env)
    policy = _policy(checkpoint.folder, checkpoint.digest, load)
    with threads(1), repeatable(seed):
        operator = PolicyOperator(policy, checkpoint, env)
        shown: Operator = operator
        if perturbation.blank or perturbation.swap:
            other = replace(perturbation, swap=0)
            shown = OtherPictures(
                operator, _env(config, meta.fps, other, False) if perturbation.swap else None
            )
        late = DelayedOperator(shown, perturbation.delay)
        pushers = (Pusher(perturbation.push),) if perturbation.push else ()
        progress = RolloutProgress()
        session = Session(env, controller, late, (*observers, progress), disturbances=pushers)
        outcome = session.run(seed)
    failed = {} if outcome.success else progress.failed(outcome)
    return _row(outcome, operator.malformed) | progress.told | failed


def _session_config(condition: PolicyCondition) -> SessionConfig:
    checkpoint = condition.checkpoint
    shapes = set(checkpoint.pictures.values()) or {(128, 128)}
    if len(shapes) > 1:
        words = "expected pictures of one size"
        raise HandrailError(f"{checkpoint.folder}: {words}, got {checkpoint.pictures}")
    height, width = shapes.pop()
    return SessionConfig(
        task=checkpoint.meta.environment,
        robot=checkpoint.meta.robot,
        moving_obstacles=checkpoint.movers,
        cameras=",".join(checkpoint.pictures),
        image_size=f"{width}x{height}",
        time_limit=condition.time_limit,
        hand=checkpoint.meta.hand,
    )


@lru_cache(maxsize=8)
def _env(
    config: SessionConfig, fps: int, perturbation: Perturbation, render: tuple[int, int] | bool
) -> HandrailEnv:
    """Return an environment, built once a process."""
    return build_env(config, fps, render, perturbation.shift, moved=perturbation.camera)


@lru_cache(maxsize=8)
def _controller(protection: str, mode: str, task: str, env: HandrailEnv) -> Controller:
    """Return what stands between a policy and the robot, built once a process.

    An intent under its mode's own protection gets that mode's very controller. Otherwise `mpc` is the masked
    MPC with the objectives that the task brings, `filter` the multi-step safety filter. `none` keeps the
    limits of the joints and nothing else: joint velocities are clipped, a partial intent is completed by
    damped least squares.
    """
    if mode and protection == own_protection(mode):
        return build_controller(MODES.find(mode), env.model, env.fps, task)
    if protection == "none":
        complete = unprotected_controller if mode else DirectController
        return complete(env.model, 1.0 / env.fps)
    return build_controller(MODES[_STAND_IN[protection]], env.model, env.fps, task)


@lru_cache(maxsize=4)
def _policy(folder: Path, digest: str, load: Load) -> TrainedPolicy:
    """Return a policy, read once a process."""
    return load(folder)


def _row(outcome: Outcome, malformed: int) -> Row:
    period = outcome.seconds / outcome.frames
    row: Row = {
        "seed": outcome.seed,
        "success": outcome.success,
        "contacts": outcome.contact_onsets,
        "contact_time": round(period * outcome.contact_periods, 6),
        "length": round(outcome.seconds, 6),
        "brakes": outcome.brakes,
        "malformed": malformed,
        "failure_reason": outcome.failure_reason,
    }
    if np.isfinite(outcome.smallest_distance):
        row["smallest_distance"] = outcome.smallest_distance
    if outcome.success:
        row["time_to_success"] = row["length"]
    parts = {"policy": "operator", "controller": "controller", "environment": "environment"}
    timing = {name: 1e3 * outcome.spent[part] / outcome.frames for name, part in parts.items()}
    return row | {"timing": {name: round(value, 3) for name, value in timing.items()}}
