"""Policies that see cameras: beside where things are, or in place of it."""

import numpy as np
import pytest
from training_helpers import tiny, write_dataset

from handrail.policies.imitation.interface.checkpoint import load_policy
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")


def test_a_policy_sees_cameras_where_it_is_asked_to(tmp_path):
    root = write_dataset(tmp_path / "set", lengths=(5, 6), cameras=("wrist",))
    config = tiny(root, tmp_path / "policy", "replace_final_stride_with_dilation=0", steps=1, images=True)
    folder = train(config, quiet=True)
    policy = load_policy(folder)
    assert list(policy.policy.config.image_features) == ["observation.images.wrist"]
    assert "observation.environment_state" in policy.policy.config.input_features
    assert pictures_matter(policy)


def test_a_policy_that_is_told_nothing_of_the_scene_sees_it(tmp_path):
    root = write_dataset(tmp_path / "set", lengths=(5, 6), cameras=("wrist",))
    options = "replace_final_stride_with_dilation=0"
    config = tiny(root, tmp_path / "policy", options, steps=1, images=True, scene=False)
    policy = load_policy(train(config, quiet=True))
    assert "observation.environment_state" not in policy.policy.config.input_features
    assert pictures_matter(policy)


def pictures_matter(policy):
    sizes = [feature.shape[0] for feature in policy.policy.config.input_features.values()]
    dark, light = (np.full((16, 16, 3), level, np.uint8) for level in (0, 255))
    acted = []
    for picture in (dark, light):
        policy.reset()
        acted.append(policy.act(np.zeros(sizes[0]), np.zeros(sizes[1]), {"wrist": picture}))
    return not np.array_equal(*acted)
