"""The channels that a person and a policy drive now, and where the policy's plan leads."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from handrail.collect.cockpit.ahead import base_ahead, hands_ahead
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.sources import PERSON, POLICY, Intents, Preview
from handrail.controllers.robot.model import Pose, RobotModel

_POINTS = 8  # of a plan that are shown, at most
_HELD = 0.6  # how long an intent of a policy that plans no further is taken to last [s]


def of_person(intent: Intent) -> Intent:
    """Return what the person asks for, on what is theirs; a plain intent is theirs altogether."""
    return _part(intent, PERSON) or replace(intent, mask=np.zeros_like(intent.mask))


def drivers(intent: Intent | None, model: RobotModel, tools: Sequence[Pose], q: FloatArray) -> dict[str, Any]:
    """Return the channels that each drives, by index, who has each gripper, where the policy's plan leads.

    The policy's plan is the points of each hand, (k, 3), and of the base's x, y, yaw, (k, 3) [m, rad]; empty
    where it leads nowhere.

    Args:
        intent: the newest; None while the robot brakes, whoever drove it.
        model: of the robot.
        tools: where the hands are.
        q: of the robot, (n,) [m, rad].
    """
    parts = {name: intent and _part(intent, name) for name in (PERSON, POLICY)}
    said: dict[str, Any] = {
        name: np.flatnonzero(part.mask).tolist() if part else [] for name, part in parts.items()
    }
    alone = (PERSON,) * len(tools) if intent else ()
    owners = intent.of_grippers if isinstance(intent, Intents) else alone
    hands, base = _leads(intent, model, tools, q)
    return said | {"grippers": list(owners), "leads": hands, "lead_base": base}


def _part(intent: Intent, name: str) -> Intent | None:
    """Return what a source asks for where it has a weight."""
    if not isinstance(intent, Intents):
        return intent if name == PERSON else None
    source = intent.source(name)
    return source and replace(source.intent, mask=source.share() > 0.0)


def _leads(
    intent: Intent | None, model: RobotModel, tools: Sequence[Pose], q: FloatArray
) -> tuple[list[list[list[float]]], list[list[float]]]:
    """Return where the policy's rows lead, one after the other: `x ← x + Δt û`, joints along q."""
    hands: list[list[list[float]]] = [[] for _ in tools]
    base: list[list[float]] = []
    source = intent.source(POLICY) if isinstance(intent, Intents) else None
    channels = Channels.of(model.description)
    if source is None:
        return hands, base
    plan = source.predict
    rows = plan.values if isinstance(plan, Preview) else source.intent.values[None]
    lasts = np.diff(plan.times) if isinstance(plan, Preview) else np.array([_HELD])
    lasts = np.append(lasts, lasts[-1:]) if len(lasts) < len(rows) else lasts
    free = np.broadcast_to(np.asarray(source.weight) > 0.0, rows.shape[1:])  # of the person
    tools, joints = list(tools), len(channels.base)
    for part in np.array_split(np.arange(len(rows)), min(_POINTS, len(rows))):
        step = replace(source.intent, values=lasts[part] @ rows[part], mask=free)
        moved, stand = hands_ahead(model, step, tools, q, 1.0), base_ahead(model, step, q, 1.0)
        q = q + np.where(free, step.values, 0.0)[channels.joint_slice]
        if stand is not None:
            q[:joints] = stand
            base.append(np.round(stand, 3).tolist())
        for number, pose in enumerate(moved):
            if pose is not None:
                tools[number] = pose
                hands[number].append(np.round(pose.position, 3).tolist())
    return hands, base
