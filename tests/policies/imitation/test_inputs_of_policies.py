"""Data that a policy cannot be trained on: one line that says what is missing, or which flag is."""

import dataclasses
import json

import numpy as np
import pytest
from training_helpers import tiny

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.policies.imitation.training.training import train

PICTURES = "observation.images.top"
STATE, ENVIRONMENT = "observation.state", "observation.environment_state"
CASES = {
    "no state": (
        (ENVIRONMENT, "action"),
        "act",
        "'observation.state', which policy act needs",
    ),
    "no state for diffusion": (
        (ENVIRONMENT, "action"),
        "diffusion",
        "which policy diffusion needs; got",
    ),
    "nothing but the action": (("action",), "act", "'observation.state', .* got no observation"),
    "pictures only": ((PICTURES, "action"), "act", "needs beside pictures [(]--images[)]; got"),
    "pictures only for another policy": (
        (PICTURES, "action"),
        "tdmpc",
        "[(]observation.images.top[)]: say --images",
    ),
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
    config = tiny(write(tmp_path / "set", keys), tmp_path / "policy")
    config = dataclasses.replace(config, actions="recorded", policy=policy, policy_options=())
    with pytest.raises(HandrailError, match=said) as error:
        train(config, quiet=True)
    assert "\n" not in str(error.value)
    assert str(error.value).startswith("dataset ")
    assert not (tmp_path / "policy").exists()


def test_whole_numbers_are_normalised_like_others(tmp_path, monkeypatch):
    """LeRobot turns the statistics of a column into the type of the column: a spread of 0.8 would be 0."""
    from lerobot.policies.act.modeling_act import ACTPolicy

    forward, learnt = ACTPolicy.forward, []
    monkeypatch.setattr(
        ACTPolicy, "forward", lambda self, batch: learnt.append(batch) or forward(self, batch)
    )
    root = write(tmp_path / "set", (STATE, "action"), "int64")
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
    with pytest.raises(HandrailError, match=f"pictures in colour, found distances in {PICTURES}"):
        train(config, quiet=True)
