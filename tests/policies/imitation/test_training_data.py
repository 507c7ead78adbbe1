"""Data on which policies are trained: of other tools, of several modes; or a line that names the lack."""

import json

import numpy as np
import pytest
from canned import canned
from training_helpers import TINY, refused, tiny, write_dataset

from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.policies.imitation.interface.checkpoint import read_meta
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training.source import read_source
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")
PICTURES = "observation.images.top"
STATE, ENVIRONMENT = "observation.state", "observation.environment_state"
CASES = {
    "no state": ((ENVIRONMENT, "action"), "act", "'observation.state', which policy act needs"),
    "no state for diffusion": ((ENVIRONMENT, "action"), "diffusion", "which policy diffusion needs; got"),
    "nothing but the action": (("action",), "act", "'observation.state', .* got no observation"),
    "pictures only": ((PICTURES, "action"), "act", "needs beside pictures [(]--images[)]; got"),
    "pictures for another": ((PICTURES, "action"), "tdmpc", "[(]observation.images.top[)]: say --images"),
    "state and pictures": ((STATE, PICTURES, "action"), "act", "[(]observation.images.top[)]: say --images"),
    "no action": ((STATE, PICTURES), "act", "expected a column 'action', got observation.state"),
    "nothing but pictures": ((PICTURES,), "act", "expected a column 'action', got none"),
}


def write(root, keys, dtype="float32"):
    """Write a dataset with these columns and nothing else, as any recorder might."""
    vector, camera = Feature(dtype, (2,), ("a.pos", "b.pos")), Feature("video", (32, 48, 3))
    features = {key: camera if key == PICTURES else vector for key in keys}
    with EpisodeWriter.create(root, Manifest("any/body", 20, "so101", features)) as writer:
        for index in range(12):
            frame = {key: np.full(2, index if dtype == "int64" else index / 12, dtype) for key in keys}
            frame |= {key: np.full((32, 48, 3), 20 * index, np.uint8) for key in keys if key == PICTURES}
            writer.add_frame(frame, "wave")
        writer.save_episode({})
    return root


@pytest.mark.parametrize("case", CASES)
def test_what_is_missing_is_said_in_one_line(case, tmp_path):
    keys, policy, said = CASES[case]
    options = {"actions": "recorded", "policy": policy, "policy_options": ()}
    refused(tiny(canned(write, keys), tmp_path / "policy", **options), f"^dataset .*{said}")
    assert not (tmp_path / "policy").exists()


def test_a_dataset_of_another_tool_needs_its_columns_as_they_are(tmp_path):
    refused(tiny(canned(write, (STATE, "action")), tmp_path / "policy"), "say --actions recorded")


@pytest.mark.parametrize("policy", ["act", "diffusion"])
def test_without_a_scene_the_robot_s_state_stands_for_it(policy, tmp_path):
    """LeRobot's ACT and Diffusion refuse to learn from the robot's state alone."""
    options = TINY if policy == "act" else ("horizon=8", "n_action_steps=4", "down_dims=[8,16]")
    settings = {"policy": policy, "policy_options": options, "steps": 1, "actions": "recorded"}
    config = tiny(canned(write, (STATE, "action")), tmp_path / "policy", **settings)
    columns = read_source(config).columns
    np.testing.assert_array_equal(columns[ENVIRONMENT], columns[STATE])
    loaded = load_policy(train(config, quiet=True))
    state = columns[STATE][0]
    assert loaded.act(state, state).shape == columns["action"][0].shape


def test_whole_numbers_are_normalised_like_others(tmp_path, monkeypatch):
    """LeRobot turns the statistics of a column into the type of the column: a spread of 0.8 would be 0."""
    from lerobot.policies.act.modeling_act import ACTPolicy

    forward, learnt = ACTPolicy.forward, []
    monkeypatch.setattr(
        ACTPolicy, "forward", lambda self, batch: learnt.append(batch) or forward(self, batch)
    )
    root = canned(write, (STATE, "action"), "int64")
    train(tiny(root, tmp_path / "policy", actions="recorded", steps=1, batch_size=12), quiet=True)
    expected = (np.arange(12) - 5.5) / np.std(np.arange(12))
    for key in (STATE, "action"):
        seen = learnt[0][key].reshape(12, -1)[:, 0].numpy()
        np.testing.assert_allclose(np.sort(seen), expected, atol=1e-5)


def test_distances_are_not_taken_for_colours(tmp_path):
    root = write(tmp_path / "set", (STATE, PICTURES, "action"))
    info = json.loads((root / "meta" / "info.json").read_text())
    info["features"][PICTURES].setdefault("info", {})["is_depth_map"] = True
    (root / "meta" / "info.json").write_text(json.dumps(info))
    config = tiny(root, tmp_path / "policy", actions="recorded", images=True)
    refused(config, f"pictures in colour, found distances in {PICTURES}")


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
    config = {"root": canned(write_dataset, modes=modes), "output": tmp_path / "policy", "actions": "intent"}
    refused(tiny(**config), f"--actions intent: expected episodes of one teleop mode.*{said}")
    assert not (tmp_path / "policy").exists()
    if "ee" in modes:
        assert read_meta(train(tiny(**config, steps=1, mode="ee"), quiet=True)).mode == "ee"


def test_what_a_dataset_lacks_is_not_fetched_from_anywhere(tmp_path):
    root = write_dataset(tmp_path / "set", lengths=(5, 6), cameras=("wrist",))
    sorted(root.rglob("*.mp4"))[0].unlink()
    refused(tiny(root, tmp_path / "policy", images=True), "was copied in part: 1 of 2 episodes")
