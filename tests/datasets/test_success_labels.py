"""Success survives LeRobot's own tools, and is read from any dataset that says it frame by frame."""

import warnings

import numpy as np
import pytest
from command_helpers import command
from datasets_helpers import open_with_lerobot
from training_helpers import features, frame, tiny

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.groups import load_groups
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.quality.summary import summarize
from handrail.datasets.reading.reader import read_episodes
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.policies.imitation.training.source import read_source

SUCCESSES = (True, False, True, False, True)
OUTCOME = {"next.success": Feature("bool"), "next.done": Feature("bool")}


def write(root, columns=True, outcome=OUTCOME, said=SUCCESSES):
    """Write episodes whose frames say how they ended, and whose lines of metadata may say so too."""
    rng = np.random.default_rng(0)
    with EpisodeWriter.create(
        root, Manifest("handrail/test", 20, "ridgeback_ur10", features() | outcome)
    ) as writer:
        for number, success in enumerate(SUCCESSES):
            for index in range(8):
                last = index == 7
                shown = {"next.success": last and success, "next.done": last}
                writer.add_frame(frame(rng) | {key: shown[key] for key in outcome}, "reach")
            writer.save_episode({"seed": number} | ({"success": said[number]} if columns else {}))
    return root


@pytest.fixture(scope="module")
def edited(tmp_path_factory):
    """What LeRobot's own tools leave of a dataset: without its second episode, and its last three."""
    folder = tmp_path_factory.mktemp("edited")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from lerobot.datasets.dataset_tools import delete_episodes, split_dataset

        dataset = open_with_lerobot(write(folder / "whole"))
        delete_episodes(dataset, [1], output_dir=folder / "deleted", repo_id="handrail/deleted")
        split_dataset(dataset, {"end": [2, 3, 4]}, output_dir=folder / "split")
    return {folder / "deleted": [True, True, False, True], folder / "split" / "end": [True, False, True]}


def test_lerobot_s_tools_lose_the_column_and_not_the_label(edited, tmp_path):
    for root, successes in edited.items():
        assert not any("success" in row for row in read_episodes(root))
        assert [episode.success for episode in summarize(root)] == successes
        shown = command("--dataset.root", root, name="inspect").stdout
        assert f"{len(successes)} episodes, {sum(successes)} succeeded" in shown
        chosen = read_source(tiny(root, tmp_path, success_only=True)).selection
        assert [row["episode_index"] for row in chosen.rows] == np.flatnonzero(successes).tolist()
        groups = {group.label: group for group in load_groups([root], by="success")}
        assert {label: len(group.episodes) for label, group in groups.items()} == {
            "True": sum(successes),
            "False": len(successes) - sum(successes),
        }
        assert len(groups["True"].successful().episodes) == sum(successes)


def test_an_episode_that_says_so_itself_is_believed(tmp_path):
    other = [not success for success in SUCCESSES]
    root = write(tmp_path / "set", said=other)
    assert [episode.success for episode in summarize(root)] == other
    silent = write(tmp_path / "silent", columns=False)
    assert [episode.success for episode in summarize(silent)] == list(SUCCESSES)


def test_without_any_label_nothing_is_made_up(tmp_path):
    root = write(tmp_path / "set", columns=False, outcome={})
    assert [episode.success for episode in summarize(root)] == [None] * len(SUCCESSES)
    with pytest.raises(HandrailError, match=r"^--success_only: expected episodes that say whether they"):
        read_source(tiny(root, tmp_path, success_only=True))
    with pytest.raises(HandrailError, match=r"^--mode: expected episodes that say their mode"):
        read_source(tiny(root, tmp_path, mode="ee"))
