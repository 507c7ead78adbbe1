"""Policies that see cameras: beside where things are, or in place of it."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
import training_helpers
from canned import canned
from training_helpers import cut, tiny, weights, write_dataset

from handrail.collect.config import StoredConfig
from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.interface.checkpoint import read_meta
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training.source import read_source
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")

KEYS = ("observation.state", "observation.environment_state")
SMALL = "replace_final_stride_with_dilation=0"


@pytest.mark.parametrize("scene", [True, False])
def test_a_policy_sees_cameras_where_it_is_asked_to_and_the_scene_unless_it_is_not(scene, tmp_path):
    root = canned(write_dataset, lengths=(5, 6), cameras=("wrist",))
    config = tiny(root, tmp_path / "policy", SMALL, steps=1, images=True, scene=scene)
    policy = load_policy(train(config))
    assert list(policy.policy.config.image_features) == ["observation.images.wrist"]
    assert ("observation.environment_state" in policy.policy.config.input_features) == scene
    acted = []
    for level in (0, 255):
        policy.reset()
        acted.append(policy.act(*still(policy), images={"wrist": np.full((16, 16, 3), level, np.uint8)}))
    assert not np.array_equal(*acted)


def test_a_policy_is_loaded_without_a_network(tmp_path, monkeypatch):
    """Whoever trained it began with a network's weights that PyTorch fetches; the checkpoint has its own."""
    root = canned(write_dataset, lengths=(5, 6), cameras=("wrist",))
    folder = train(tiny(root, tmp_path / "policy", SMALL, steps=1, images=True))
    said = json.loads((folder / "config.json").read_text())
    fetched = said | {"pretrained_backbone_weights": "ResNet18_Weights.IMAGENET1K_V1"}
    (folder / "config.json").write_text(json.dumps(fetched))
    monkeypatch.setattr("torch.hub.load_state_dict_from_url", lambda *_, **__: pytest.fail("fetched"))
    monkeypatch.setattr(
        "torchvision.models._api.load_state_dict_from_url", lambda *_, **__: pytest.fail("fetched")
    )
    assert load_policy(folder)


def test_a_policy_sees_the_same_picture_while_it_acts_as_while_it_learnt(tmp_path, monkeypatch):
    """To the normalised pixel: LeRobot's training divides pictures by 255 itself, before what normalises."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset
    from lerobot.policies.act.modeling_act import ACTPolicy

    learnt, acted = [], []
    for name, batches in (("forward", learnt), ("select_action", acted)):
        monkeypatch.setattr(ACTPolicy, name, keeping(batches, getattr(ACTPolicy, name)))
    root = canned(write_dataset, lengths=(5, 6), cameras=("wrist",))
    config = tiny(root, tmp_path / "policy", SMALL, steps=1, batch_size=11, images=True)
    policy = load_policy(train(config))
    recorded, key = LeRobotDataset("handrail/test", root=root, return_uint8=True), "observation.images.wrist"
    for frame, index in enumerate(learnt[0]["index"].tolist()):
        sample: Any = recorded[int(index)]
        picture = sample[key].permute(1, 2, 0).numpy()
        policy.act(*still(policy), images={"wrist": picture})
        torch.testing.assert_close(learnt[0][key][frame], acted[-1][key][0])
    assert len(acted) == 11


def test_a_training_on_pictures_goes_on_to_the_bit(tmp_path):
    root = canned(write_dataset, lengths=(130, 130), cameras=("wrist",))  # a count beyond a byte
    config = tiny(root, tmp_path / "policy", SMALL, images=True)
    whole = train(config)
    assert weights(train(cut(config, tmp_path / "cut"))) == weights(whole)


def test_a_training_does_not_go_on_with_other_pictures(tmp_path, monkeypatch):
    """The numbers are the same."""
    root = canned(write_dataset, lengths=(5, 6), cameras=("wrist",))
    dark = {"observation.images.wrist": np.zeros((16, 16, 3), np.uint8)}
    with monkeypatch.context() as other:
        drawn = training_helpers.frame
        other.setattr(training_helpers, "frame", lambda rng, cameras: drawn(rng, cameras) | dark)
        darker = write_dataset(tmp_path / "dark", lengths=(5, 6), cameras=("wrist",))
    config = tiny(root, tmp_path / "policy", SMALL, images=True)
    source, moved = read_source(config), replace(config, dataset=StoredConfig(root=str(darker)))
    began = read_meta(train(config))
    assert began.data == source.digest
    with pytest.raises(HandrailError, match="got others"):
        read_source(moved, began)


def keeping(batches, method):
    return lambda policy, batch: batches.append(batch) or method(policy, batch)


def still(policy):
    """Return a state of nothing, and a scene where the policy reads one."""
    inputs = policy.policy.config.input_features
    return [np.zeros(inputs[key].shape[0]) for key in KEYS if key in inputs]
