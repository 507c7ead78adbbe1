"""Which datasets a policy is trained on: of other tools, of several modes, with files missing; or why not."""

import dataclasses

import numpy as np
import pytest
from command_helpers import command
from training_helpers import TINY, tiny, write_dataset

from handrail.collect.config import StoredConfig
from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.interface.checkpoint import read_meta
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training.source import read_source
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")


def another_tool_s(root, keys, cameras=False):
    """Write a dataset that is not Handrail's; return its root."""
    from datasets_helpers import CAMERA_FEATURES, frame_of

    from handrail.datasets.format.manifest import Manifest
    from handrail.datasets.recording.writer import EpisodeWriter

    features = {key: feature for key, feature in CAMERA_FEATURES.items() if key.startswith(keys)}
    with EpisodeWriter.create(root, Manifest("a/b", 30, "testbot", features)) as writer:
        for index in range(8):
            writer.add_frame({key: frame_of(0, index, cameras)[key] for key in features}, "lift")
        writer.save_episode({})
    return root


def test_a_dataset_of_another_tool_needs_its_columns_as_they_are(tmp_path):
    root = another_tool_s(tmp_path / "set", ("observation.state", "action"))
    with pytest.raises(HandrailError, match="say --actions recorded"):
        train(tiny(root, tmp_path / "policy"), quiet=True)


@pytest.mark.parametrize("policy", ["act", "diffusion"])
def test_without_a_scene_the_robot_s_state_stands_for_it(policy, tmp_path):
    """LeRobot's ACT and Diffusion refuse to learn from the robot's state alone."""
    root = another_tool_s(tmp_path / "set", ("observation.state", "action"))
    options = TINY if policy == "act" else ("horizon=8", "n_action_steps=4", "down_dims=[8,16]")
    config = tiny(root, tmp_path / "policy", policy=policy, policy_options=options, steps=1)
    config = dataclasses.replace(config, actions="recorded")
    columns = read_source(config).columns
    np.testing.assert_array_equal(columns["observation.environment_state"], columns["observation.state"])
    loaded = load_policy(train(config, quiet=True))
    state = columns["observation.state"][0]
    assert loaded.act(state, state).shape == columns["action"][0].shape


def test_a_scene_in_pictures_alone_names_the_flag(tmp_path):
    root = another_tool_s(tmp_path / "set", ("observation", "action"), cameras=True)
    config = dataclasses.replace(tiny(root, tmp_path / "policy", steps=1), actions="recorded")
    with pytest.raises(HandrailError, match="or --images for policy act") as raised:
        train(config, quiet=True)
    assert "\n" not in str(raised.value)
    blind = another_tool_s(tmp_path / "blind", ("action",))
    with pytest.raises(HandrailError, match=r"expected a column 'observation\.state'"):
        train(dataclasses.replace(config, dataset=StoredConfig(root=str(blind))), quiet=True)


@pytest.mark.parametrize(
    ("modes", "said"),
    [
        (("ee", "switching", "ee"), r"got ee \(2\), switching \(1\); say --mode ee$"),
        (("mask:01", "mask:01", "mask:01"), r"got mask:01 \(3\); say --actions realised$"),
        (("", "", ""), r"got no mode \(3\); say --actions realised$"),
    ],
)
def test_an_intent_of_several_modes_is_refused_with_the_flag(modes, said, tmp_path):
    """No one controller could complete it when the policy drives."""
    root = write_dataset(tmp_path / "set", modes=modes)
    config = dataclasses.replace(tiny(root, tmp_path / "policy", steps=1), actions="intent")
    with pytest.raises(
        HandrailError, match=f"--actions intent: expected episodes of one teleop mode.*{said}"
    ):
        train(config, quiet=True)
    assert not (tmp_path / "policy").exists()
    done = command(
        "--dataset.root", root, "--actions", "intent", "--output", tmp_path / "policy", name="train"
    )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    if "ee" in modes:
        assert read_meta(train(dataclasses.replace(config, mode="ee"), quiet=True)).mode == "ee"


def test_what_a_dataset_lacks_is_not_fetched_from_anywhere(tmp_path):
    root = write_dataset(tmp_path / "set", lengths=(5, 6), cameras=("wrist",))
    sorted(root.rglob("*.mp4"))[0].unlink()
    with pytest.raises(HandrailError, match="was copied in part: 1 of 2 episodes"):
        train(tiny(root, tmp_path / "policy", steps=1, images=True), quiet=True)
