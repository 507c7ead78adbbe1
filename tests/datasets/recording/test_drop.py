"""Episodes that are dropped are gone; the others are whole, in their order, and may be added to."""

import pytest
from canned import copied
from datasets_helpers import open_with_lerobot, record, record_one, resume, tree

from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.merge import drop_episodes
from handrail.datasets.format.layout import Layout
from handrail.datasets.reading.check import check_report
from handrail.datasets.reading.reader import read_episodes, read_frames


@pytest.fixture
def recorded(tmp_path):
    return copied(tmp_path / "d", record, 5)


def odd(columns):
    return columns["seed"] % 2 == 1


def test_what_is_left_is_whole_and_moves_up(tmp_path):
    recorded = copied(tmp_path / "d", record, 5, cameras=True)
    before = {row["seed"]: read_frames(recorded, row["episode_index"]) for row in read_episodes(recorded)}
    assert drop_episodes(recorded, odd) == 2
    with resume(recorded, cameras=True) as writer:  # it goes on
        assert writer.repaired.clean
        assert record_one(writer, cameras=True) == 3
    rows = read_episodes(recorded)
    assert [row["seed"] for row in rows] == [0, 2, 4, 3]
    assert not check_report(recorded)
    start = 0
    for number, row in enumerate(rows[:3]):
        frames, old = read_frames(recorded, number), before[row["seed"]]
        assert (row["episode_index"], row["dataset_from_index"]) == (number, start)
        for name in set(old) - {"index", "episode_index", "task_index"}:
            assert (frames[name] == old[name]).all(), name
        start += row["length"]
    assert open_with_lerobot(recorded).num_episodes == 4
    assert not [path for path in recorded.parent.iterdir() if path != recorded]


def test_nothing_to_drop_changes_nothing(recorded):
    before = tree(recorded)
    assert drop_episodes(recorded, lambda columns: False) == 0
    assert tree(recorded) == before


def test_without_episodes_there_is_no_dataset(recorded):
    assert drop_episodes(recorded, lambda columns: True) == 5
    assert not list(recorded.parent.iterdir())


def test_what_was_set_aside_is_not_passed_over(recorded):
    Layout(recorded).damaged.mkdir()
    with pytest.raises(HandrailError, match=r"in \.damaged are episodes that were set aside"):
        drop_episodes(recorded, odd)
    assert len(read_episodes(recorded)) == 5


def test_a_dataset_in_use_is_left_alone(recorded):
    with resume(recorded, cameras=False), pytest.raises(HandrailError, match="is being written by another"):
        drop_episodes(recorded, odd)
    assert len(read_episodes(recorded)) == 5
