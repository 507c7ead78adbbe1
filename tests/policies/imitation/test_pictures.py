"""Policies that see cameras: beside where things are, or in place of it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
import training_helpers
from training_helpers import cut, tiny, weights, write_dataset

from handrail.collect.config import StoredConfig
from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.interface.checkpoint import read_meta
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training.resume import check_data
from handrail.policies.imitation.training.source import read_source
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")

SMALL = "replace_final_stride_with_dilation=0"


def test_a_policy_sees_cameras_where_it_is_asked_to(tmp_path):
    root = write_dataset(tmp_path / "set", lengths=(5, 6), cameras=("wrist",))
    config = tiny(root, tmp_path / "policy", SMALL, steps=1, images=True)
    folder = train(config, quiet=True)
    policy = load_policy(folder)
    assert list(policy.policy.config.image_features) == ["observation.images.wrist"]
    assert "observation.environment_state" in policy.policy.config.input_features
    assert pictures_matter(policy)


def test_a_policy_that_is_told_nothing_of_the_scene_sees_it(tmp_path):
    root = write_dataset(tmp_path / "set", lengths=(5, 6), cameras=("wrist",))
    config = tiny(root, tmp_path / "policy", SMALL, steps=1, images=True, scene=False)
    policy = load_policy(train(config, quiet=True))
    assert "observation.environment_state" not in policy.policy.config.input_features
    assert pictures_matter(policy)


def test_a_policy_sees_the_same_picture_while_it_acts_as_while_it_learnt(tmp_path, monkeypatch):
    """To the normalised pixel: LeRobot's training divides pictures by 255 itself, before what normalises."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset
    from lerobot.policies.act.modeling_act import ACTPolicy

    learnt, acted = [], []
    for name, batches in (("forward", learnt), ("select_action", acted)):
        monkeypatch.setattr(ACTPolicy, name, keeping(batches, getattr(ACTPolicy, name)))
    root = write_dataset(tmp_path / "set", lengths=(5, 6), cameras=("wrist",))
    config = tiny(root, tmp_path / "policy", SMALL, steps=1, batch_size=11, images=True)
    policy = load_policy(train(config, quiet=True))
    recorded, key = LeRobotDataset("handrail/test", root=root, return_uint8=True), "observation.images.wrist"
    sizes = [feature.shape[0] for feature in policy.policy.config.input_features.values()]
    for frame, index in enumerate(learnt[0]["index"].tolist()):
        sample: Any = recorded[int(index)]
        picture = sample[key].permute(1, 2, 0).numpy()
        policy.act(np.zeros(sizes[0]), np.zeros(sizes[1]), {"wrist": picture})
        torch.testing.assert_close(learnt[0][key][frame], acted[-1][key][0])
    assert len(acted) == 11


def test_a_training_on_pictures_goes_on_to_the_bit(tmp_path):
    root = write_dataset(tmp_path / "set", lengths=(130, 130), cameras=("wrist",))  # a count beyond a byte
    config = tiny(root, tmp_path / "policy", SMALL, images=True)
    whole = train(config, quiet=True)
    assert weights(train(cut(config, tmp_path / "cut"), quiet=True)) == weights(whole)


def test_a_training_does_not_go_on_with_other_pictures(tmp_path, monkeypatch):
    """The numbers are the same. A checkpoint of an earlier version says nothing of pictures, and goes on."""
    root = write_dataset(tmp_path / "set", lengths=(5, 6), cameras=("wrist",))
    dark = {"observation.images.wrist": np.zeros((16, 16, 3), np.uint8)}
    with monkeypatch.context() as other:
        drawn = training_helpers.frame
        other.setattr(training_helpers, "frame", lambda rng, cameras: drawn(rng, cameras) | dark)
        darker = write_dataset(tmp_path / "dark", lengths=(5, 6), cameras=("wrist",))
    config = tiny(root, tmp_path / "policy", SMALL, images=True)
    source, moved = read_source(config), read_source(replace(config, dataset=StoredConfig(root=str(darker))))
    began = read_meta(train(config, quiet=True))
    assert began.data == source.digest
    check_data(source, replace(began, data=began.data[:16]))
    with pytest.raises(HandrailError, match="got others"):
        check_data(moved, began)


def test_a_policy_is_told_what_to_do(tmp_path):
    """Few policies read it: ours say to their processors what LeRobot's rollouts say, too."""
    root = write_dataset(tmp_path / "set", lengths=(5, 6))
    policy = load_policy(train(tiny(root, tmp_path / "policy", steps=1), quiet=True))
    sizes = [feature.shape[0] for feature in policy.policy.config.input_features.values()]
    told = []
    listening = replace(policy, before=lambda batch: told.append(batch["task"]) or policy.before(batch))
    listening.act(np.zeros(sizes[0]), np.zeros(sizes[1]), task="Move to the goal.")
    assert told == [["Move to the goal."]]


def keeping(batches, method):
    return lambda policy, batch: batches.append(batch) or method(policy, batch)


def pictures_matter(policy):
    sizes = [feature.shape[0] for feature in policy.policy.config.input_features.values()]
    dark, light = (np.full((16, 16, 3), level, np.uint8) for level in (0, 255))
    acted = []
    for picture in (dark, light):
        policy.reset()
        acted.append(policy.act(np.zeros(sizes[0]), np.zeros(sizes[1]), {"wrist": picture}))
    return not np.array_equal(*acted)
