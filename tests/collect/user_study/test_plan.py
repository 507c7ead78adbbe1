"""Laws of the order of conditions: every place and every neighbour equally often, for any number of them."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from handrail.collect.user_study.design import UserStudy
from handrail.collect.user_study.plan import order, orders, plan, practice_seed, trial_seed, williams


@pytest.mark.parametrize("n", range(2, 9))
def test_a_williams_design_is_balanced(n):
    sequences = williams(n)
    repeats = len(sequences) // n
    assert len(sequences) == (2 * n if n % 2 else n)
    assert all(sorted(sequence) == list(range(n)) for sequence in sequences)
    for place in range(n):
        assert set(Counter(sequence[place] for sequence in sequences).values()) == {repeats}
    after = Counter(pair for sequence in sequences for pair in pairwise(sequence))
    assert len(after) == n * (n - 1)
    assert set(after.values()) == {repeats}


@pytest.mark.parametrize("n", range(2, 9))
def test_the_first_participants_already_have_each_condition_in_each_place(n):
    names = tuple("abcdefgh"[:n])
    for seed in range(5):
        rows = [order(names, row, np.random.default_rng(seed)) for row in range(2 * n)]
        for square in (rows[:n], rows[n:]):
            assert all(len({row[place] for row in square}) == n for place in range(n))


MODES = ("ee", "direct", "switching", "base+ee")
TASKS = ("reach", "pick_place", "drawer", "tray")


def study(modes=3, tasks=2, seed=0):
    return UserStudy("t", "c", MODES[:modes], TASKS[:tasks], seed=seed, forms=("tlx", "sus"))


@pytest.mark.parametrize(("modes", "tasks"), [(1, 2), (2, 2), (3, 2), (3, 3), (4, 2), (4, 4)])
def test_orders_of_modes_and_tasks_are_crossed(modes, tasks):
    made = study(modes, tasks)
    rows = len(williams(modes)) * len(williams(tasks))
    assert len({orders(made, slot) for slot in range(rows)}) == rows
    assert [orders(made, slot) for slot in range(rows)] == [orders(made, slot + rows) for slot in range(rows)]


def test_the_same_seed_and_slot_give_the_same_orders_and_another_seed_others():
    assert orders(study(), 4) == orders(study(), 4)
    assert len({orders(study(seed=seed), 0) for seed in range(20)}) > 3


def test_a_plan_has_every_trial_and_form_once():
    steps = list(plan(study(), MODES[:3], TASKS[:2]))
    keys = [step.key for step in steps]
    assert len(set(keys)) == len(keys)
    assert sum(step.kind == "trial" for step in steps) == 3 * 2 * 3
    for mode in MODES[:3]:
        last = max(index for index, step in enumerate(steps) if step.condition == mode)
        assert [step.form for step in steps[last - 2 : last + 1]] == ["tlx", "tlx_pairs", "sus"]


def test_trials_are_the_same_scenes_for_all_and_practice_has_others():
    made = study()
    trials = {trial_seed(made, task, trial) for task in TASKS[:2] for trial in range(1, 4)}
    practice = {
        practice_seed(made, mode, task, n) for mode in MODES[:3] for task in TASKS[:2] for n in range(6)
    }
    assert len(trials) == 6
    assert len(practice) == 36
    assert not trials & practice
