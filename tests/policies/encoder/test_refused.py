"""Where an encoder or its policy does not fit what it meets, one line says so."""

import dataclasses

import numpy as np
import pytest
import torch
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.policies.act.configuration_act import ACTConfig

from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.gl import missing_graphics
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import RobotModel, load_model
from handrail.datasets.format.schema import Feature
from handrail.datasets.reading.reader import DatasetInfo
from handrail.policies.imitation.encoder.config import EncoderConfig
from handrail.policies.imitation.encoder.samples import Drawn
from handrail.policies.imitation.interface.encoder import OWN, Encoder
from handrail.policies.imitation.training.earlier import check_pictures
from handrail.policies.imitation.training.encoded import encoded

FILES = sorted(OWN.glob("*.safetensors"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_robot_with_its_cameras_elsewhere_is_refused(path):
    reads = Encoder.load(path).reads
    model = load_model(reads.robot)
    reads.check_robot(model)
    cameras = [
        dataclasses.replace(each, position=np.add(each.position, (0.0, 0.01, 0.0)))
        for each in model.description.cameras
    ]
    moved = RobotModel(dataclasses.replace(model.description, cameras=tuple(cameras)))
    with pytest.raises(HandrailError, match=r"encoder: expected camera .* where .* has it; that of"):
        reads.check_robot(moved)


def test_a_machine_without_opengl_is_told_before_any_worker_begins(tmp_path, monkeypatch):
    def missing(*asked):
        raise missing_graphics("libEGL")

    monkeypatch.setattr(HandrailEnv, "pictures", missing)
    with pytest.raises(HandrailError, match=r"\Acameras need OpenGL"):
        _ = Drawn(EncoderConfig(output=str(tmp_path / "e.safetensors"), workers=1)).reads


def test_half_precision_of_a_policy_is_none_of_its_encoder():
    encoder = Encoder.load(FILES[0])
    pictures = {
        name: np.random.default_rng(0).integers(0, 255, (1, *size, 3), np.uint8)
        for name, size in encoder.reads.pictures.items()
    }
    alone = encoder.read(pictures)
    with torch.autocast("cpu"):
        np.testing.assert_array_equal(encoder.read(pictures), alone)


def seeing(**cameras):
    """Return the settings of a policy that sees pictures of these sizes."""
    features = {
        f"observation.images.{name}": PolicyFeature(FeatureType.VISUAL, (3, *size))
        for name, size in cameras.items()
    }
    return ACTConfig(input_features=features)


@pytest.mark.parametrize(
    "cameras",
    [{}, {"front": (32, 48)}, {"wrist": (8, 8), "front": (32, 48)}, {"front": (32, 40), "wrist": (8, 8)}],
)
def test_a_policy_that_sees_other_pictures_is_no_beginning(tmp_path, cameras):
    both = seeing(front=(32, 48), wrist=(8, 8))
    both.save_pretrained(tmp_path)
    check_pictures(tmp_path, both)
    with pytest.raises(HandrailError, match=r"got front \[3, 32, 48\], wrist \[3, 8, 8\]"):
        check_pictures(tmp_path, seeing(**cameras))


def test_single_pictures_are_no_video(tmp_path):
    encoder = Encoder.load(FILES[0])
    features = {
        f"observation.images.{name}": Feature("image", (*size, 3))
        for name, size in encoder.reads.pictures.items()
    }
    info = DatasetInfo(tmp_path, 20, "robot", features, 1, 1, "", "", from_handrail=False)
    states = np.zeros((1, len(encoder.reads.interface.state_names)))
    with pytest.raises(HandrailError, match="expected a video of front, got pictures"):
        list(encoded(info, [{"length": 1}], encoder, [{"observation.state": states}]))
