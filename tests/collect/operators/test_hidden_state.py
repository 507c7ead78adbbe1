"""What a scripted operator has in mind: declared to the last attribute; nothing drawn decides where to."""

from collections import deque
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from collect_helpers import environment
from device_helpers import MODEL, PERIOD, at
from hidden_helpers import declared, hidden_table, parts_of

from handrail.collect.operators.human.hidden import Hidden
from handrail.collect.operators.human.human import HumanSettings
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import View
from handrail.collect.operators.scripts.base_placement import standing_pose
from handrail.collect.operators.scripts.scripted import scripted_operator
from handrail.collect.tasks.catalogue import TASKS
from handrail.controllers.robot.inverse_kinematics import arm_configuration

PAGE = Path(__file__).parents[3] / "docs" / "concepts.md"
CLASSES = {"reach": "Reach", "pick_place": "PickPlace", "drawer": "Drawer", "tray": "Tray"}
RUNS = [("reach", mode) for mode in MODES] + [(task, "switching") for task in CLASSES if task != "reach"]


@cache
def beginning(task, scene=0):
    with environment(CLASSES[task]) as env:
        env.reset(seed=scene)
        return View(env.state(), env.task_state())


def begun(task, mode, person=0, seed=0, scene=0):
    human = HumanSettings().person(np.random.default_rng(person))
    operator = scripted_operator(MODEL, MODES[mode], TASKS.find(task), human)
    operator.reset(beginning(task, scene), np.random.default_rng(seed))
    return operator


def print_of(value):
    """Return what tells a value from another; of what is built once, such as a model, only its kind."""
    if isinstance(value, np.ndarray):
        return value.shape, value.tobytes()
    if isinstance(value, list | tuple | deque):
        return tuple(map(print_of, value))
    if isinstance(value, Mapping):
        return tuple((key, print_of(each)) for key, each in value.items())
    if is_dataclass(value):
        return tuple(print_of(getattr(value, entry.name)) for entry in fields(value))
    if type(value).__module__.startswith("handrail.collect.operators") and not hasattr(type(value), "HIDDEN"):
        return tuple((name, print_of(each)) for name, each in vars(value).items())
    return value if isinstance(value, float | str | bytes | None) else type(value)


def state_of(operator):
    """Return the prints of all attributes of all parts, by class and name."""
    parts = parts_of(operator)
    return {(type(part), name): print_of(value) for part in parts for name, value in vars(part).items()}


def differing(one, other):
    return {key for key in one.keys() | other.keys() if one.get(key) != other.get(key)}


def pieces(keys, operator) -> dict[tuple[type, str], Hidden | None]:
    kinds = {type(part): declared(part) for part in parts_of(operator)}
    return {(kind, name): kinds[kind].get(name) for kind, name in keys}


@cache
def lived(task, mode):
    """Return an operator after ten seconds, in which the robot gets to the goal, and what has changed."""
    operator, view = begun(task, mode), beginning(task)
    q, v, changed, last = view.state.q.copy(), np.zeros(MODEL.size), set(), state_of(operator)
    for step in range(round(10.0 / PERIOD)):
        operator.act(at(view, q, v, step * PERIOD))
        now = state_of(operator)
        changed |= differing(last, now)
        last = now
        q = q + 0.002 * np.sin(step + np.arange(MODEL.size))  # whatever the operator asks for
        if step == 100 and view.task.goal:  # done
            stand = standing_pose(MODEL, view.state.q, view.task.goal)
            q = arm_configuration(MODEL, np.append(stand, q[3:]), view.task.goal)[0]
    return operator, changed


@pytest.mark.parametrize(("task", "mode"), RUNS)
def test_everything_that_an_operator_remembers_is_declared(task, mode):
    operator, changed = lived(task, mode)
    known = pieces(changed, operator)
    assert not [f"{kind.__name__}.{name}" for (kind, name), piece in known.items() if piece is None]


def test_nothing_is_declared_that_is_not_there():
    """Every piece is of attributes that exist, and one of them changes, or is another in another episode."""
    there, moved = set(), set()
    for run in RUNS:
        operator, changed = lived(*run)
        for part in parts_of(operator):
            assert declared(part).keys() <= vars(part).keys()
            there |= {piece for piece in declared(part).values() if piece.drawn != "once a recording"}
        other = differing(state_of(begun(*run)), state_of(begun(*run, seed=1, scene=1)))
        moved |= set(pieces(changed | other, operator).values())
    assert there <= moved


@pytest.mark.parametrize("mode", sorted(MODES))
def test_chance_has_a_say_only_where_that_is_declared(mode):
    """Nothing that is drawn as an episode begins, and stays, decides where the operator goes."""
    first = begun("reach", mode)
    other_seed, other_person = begun("reach", mode, seed=1), begun("reach", mode, person=1)
    drawn = set(pieces(differing(state_of(first), state_of(other_seed)), first).values())
    assert {piece.drawn for piece in drawn if piece} == {"as an episode begins", "all the time"}
    assert None not in drawn
    stays = [piece.what for piece in drawn if piece and piece.drawn == "as an episode begins"]
    assert stays == ["how they are today: the same numbers again"]
    persons = pieces(differing(state_of(first), state_of(other_person)), first).values()
    assert "once a recording" in {piece.drawn for piece in persons if piece}


def test_the_page_lists_what_is_hidden():
    """Paste what is missing from the message into docs/concepts.md."""
    assert hidden_table({mode: begun("reach", mode) for mode in MODES}) in PAGE.read_text()
