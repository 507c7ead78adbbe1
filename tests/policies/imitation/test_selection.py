"""Which episodes a policy is trained on: filters keep what they say, and budgets count what they cost."""

import itertools

import pytest
from training_helpers import FPS

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.training.selection import select

ROWS = [
    {"episode_index": i, "length": 20 * (1 + i % 3), "mode": ("ee", "joints")[i % 2], "success": i % 4 != 1}
    for i in range(40)
]


def chosen(**settings):
    selection = select(ROWS, FPS, TrainConfig(**settings))
    return [row["episode_index"] for row in selection.rows], selection


def test_filters_keep_what_they_say():
    assert chosen()[0] == list(range(40))
    assert chosen(mode="joints")[0] == list(range(1, 40, 2))
    kept, selection = chosen(mode="joints", success_only=True)
    assert kept == list(range(3, 40, 4))
    assert selection.attempts == 20
    assert selection.operator_time == sum(row["length"] for row in ROWS[1::2]) / FPS


@pytest.mark.parametrize("success_only", [False, True])
def test_more_episodes_or_minutes_only_add(success_only):
    rising = [chosen(success_only=success_only, episodes=n) for n in range(1, 31)]
    rising_time = [chosen(success_only=success_only, minutes=m / 60) for m in range(9, 80, 5)]
    for way in (rising, rising_time):
        for (fewer, _), (more, _) in itertools.pairwise(way):
            assert set(fewer) <= set(more)
    assert [len(kept) for kept, _ in rising] == list(range(1, 31))


def test_operator_time_counts_the_failed_attempts_that_were_needed():
    for draw in range(20):
        kept, selection = chosen(success_only=True, episodes=5, draw=draw)
        seconds = sum(ROWS[index]["length"] for index in kept) / FPS
        failed = selection.attempts - 5
        assert seconds + failed * 1.0 <= selection.operator_time <= seconds + failed * 3.0
        within = chosen(success_only=True, minutes=selection.operator_time / 60, draw=draw)[0]
        assert set(kept) <= set(within)
    assert chosen(episodes=5, draw=0)[0] != chosen(episodes=5, draw=1)[0]


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"episodes": 41}, "at most the 40"),
        ({"minutes": 60.0}, "at most the 1.3"),
        ({"minutes": 0.001}, "no episode left"),
        ({"mode": "base"}, "expected one of ee, joints"),
    ],
)
def test_too_much_is_refused(settings, said):
    with pytest.raises(HandrailError, match=said):
        chosen(**settings)
