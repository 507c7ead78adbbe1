"""How an operator holds a drawer open with one hand and takes a cube out of it with the other."""

from dataclasses import replace
from functools import partial

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.drawer import BACK, way_to_handle
from handrail.collect.operators.scripted.phases import ScriptPhase, from_phase, turns
from handrail.collect.operators.scripted.pick_place import PickPlaceScript
from handrail.collect.world.tasks.drawer import handle, inward, opened
from handrail.collect.world.tasks.pick_place import grasp_rotation

_PULL, _ENOUGH = 0.38, 0.28  # how far the operator means to open it, and has to [m]
_ASIDE = 0.04  # hand beside the handle's middle [m]
_APART = 0.4  # of the hands while they are steered as a pair [m]
_CLEAR = np.array([0.0, 0.0, 0.30])  # above the cube [m]


class FetchScript(PickPlaceScript):
    """Pull, hold, take out, let go for `handrail/Fetch-v0`; a script."""

    def replan(self, view: View, name: str) -> list[ScriptPhase] | None:
        """Begin again where the drawer did not come along; look where the cube is once it is open."""
        if name == "above":  # the drawer may have moved a little
            return from_phase(self._take(view), "descend")
        if name == "pull":
            return self._take(view) if opened(view.task) > _ENOUGH else self.plan(view)
        stayed = view.task.pose("cube").position[2] < view.task.object("cabinet").top
        return self._take(view) if name == "out" and stayed else None

    def plan(self, view: View) -> list[ScriptPhase]:
        """Return the way to the handle and how to pull it; the other hand comes along beside."""
        into, tool = inward(view.task.object("cabinet").rotation), view.task.tool
        across = tool.position - view.task.tools[1 - view.task.hand].position
        aside = np.array([-into[1], into[0], 0.0]) * np.sign(into[0] * across[1] - into[1] * across[0])
        bar = handle(view.task) + opened(view.task) * into + _ASIDE * aside  # it closes again
        way, beside = way_to_handle(self._model, view, bar, 0.015), 0.5 * _APART * aside
        at = partial(ScriptPhase.at, rotation=way[0].hand.rotation, base=way[0].base, apart=_APART)
        stage = at("stage", bar - BACK * into - beside, distance=0.03, angle=0.10)
        pull = at("pull", bar - _PULL * into - beside, distance=0.03, angle=3.2, pace=0.5, dwell=0.8)
        return [stage, *turns(False, 0.0, way), replace(pull, gripper=1.0, other=0.0)]

    def _take(self, view: View) -> list[ScriptPhase]:
        """Return how the other hand takes the cube out, and the first one lets go."""
        task, base = view.task, view.state.q[:3]
        cube, other, tool = task.pose("cube"), task.tools[1 - task.hand], task.tool
        down = grasp_rotation(other.rotation, cube.rotation)
        _, descend, grasp, _ = self._pick(view, cube.position, down, base)
        at = partial(ScriptPhase.at, rotation=down, base=base)
        up = np.array([*other.position[:2], cube.position[2] + _CLEAR[2]])
        rise = at("rise", up, distance=0.05, angle=0.4)
        above = at("above", cube.position + _CLEAR, distance=0.03, angle=0.10, dwell=0.6)
        out = replace(above, name="out", dwell=0.0, angle=0.3, gripper=1.0, pace=0.6)
        into = inward(task.object("cabinet").rotation)
        free = partial(ScriptPhase.at, rotation=tool.rotation, base=base, angle=3.2)
        release = free("release", tool.position, distance=1.0, dwell=0.8)
        leave = free("leave", tool.position - BACK * into, distance=0.03, pace=0.5)
        return [*turns(True, 1.0, [rise, above, descend, grasp, out]), *turns(False, 1.0, [release, leave])]
