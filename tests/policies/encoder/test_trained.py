"""An encoder that learns, for a few updates, from small pictures; and a policy that looks through it."""

import dataclasses
import errno
import json

import numpy as np
import pytest
import torch
from canned import record_by_command
from datasets_helpers import tree
from lerobot.configs.policies import PreTrainedConfig
from lerobot.datasets.dataset_tools import remove_feature
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.policies.factory import make_pre_post_processors

from handrail.collect.config import StoredConfig
from handrail.controllers.errors import HandrailError
from handrail.datasets.reading.reader import open_dataset
from handrail.datasets.storage import atomic
from handrail.datasets.storage.lock import FolderLock
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.encoder.config import EncoderConfig
from handrail.policies.imitation.encoder.samples import DRIVEN, OTHER, START, Drawn, batches
from handrail.policies.imitation.encoder.training import train
from handrail.policies.imitation.evaluation.conditions import read_checkpoint
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.evaluation import evaluate
from handrail.policies.imitation.interface.encoder import Encoder
from handrail.policies.imitation.interface.interface import ENVIRONMENT, STATE
from handrail.policies.imitation.interface.trained import TrainedPolicy
from handrail.policies.imitation.training.encoded import tellable
from handrail.policies.imitation.training.source import read_source
from handrail.policies.imitation.training.training import train as train_policy

pytestmark = pytest.mark.needs_gl
SIZE = 48


def config(tmp_path, **settings):
    return EncoderConfig(
        **{"output": str(tmp_path / "e.safetensors"), "image_size": SIZE, "workers": 0, "updates": 3}
        | settings
    )


def test_a_chunk_comes_from_its_number_alone(tmp_path):
    first, again = Drawn(config(tmp_path)), Drawn(config(tmp_path))
    again[0]
    one, same = first[1], again[1]
    for name, values in one.items():
        np.testing.assert_array_equal(values, same[name])
    assert {START, DRIVEN, OTHER} <= set(one["kind"])
    assert one["front"].shape == (len(one["kind"]), SIZE, SIZE, 3)
    assert not np.array_equal(one["environment"][0], Drawn(config(tmp_path, seed=1))[1]["environment"][0])


@pytest.mark.parametrize("wrong", [{"slope": float("inf")}, {"axes": ((1.0, 0.0, 0.0),) * 2}])
def test_a_camera_that_cannot_be_is_refused(tmp_path, wrong):
    reads, path = Drawn(config(tmp_path)).reads, tmp_path / "e.safetensors"
    mounts = {name: dataclasses.replace(each, **wrong) for name, each in reads.cameras.items()}
    Encoder(dataclasses.replace(reads, cameras=mounts)).save(path)
    with pytest.raises(HandrailError, match=next(iter(wrong))):
        Encoder.load(path)


def test_cameras_come_in_the_order_that_is_asked_for(tmp_path):
    drawn = Drawn(config(tmp_path, cameras="wrist,front"))
    chunk, reads = drawn[0], drawn.reads
    assert list(reads.cameras) == ["wrist", "front"]
    for row, camera in zip(
        chunk["views"].swapaxes(0, 1)[:, chunk["kind"] == START], reads.cameras.values(), strict=True
    ):
        place, turn = camera.view(reads.interface.pose(chunk["state"][chunk["kind"] == START]))
        np.testing.assert_allclose(row[:, :3], place, atol=1e-5)
        np.testing.assert_allclose(row[:, 3:12].reshape(-1, 3, 3), turn, atol=1e-5)
    with pytest.raises(HandrailError, match="unknown camera of the robot 'scene'"):
        _ = Drawn(config(tmp_path, cameras="front,scene")).reads


def test_where_the_robot_is_says_nothing_of_a_scene_elsewhere(tmp_path):
    """Its samples show robots of other episodes: the same scene from several of their poses."""
    chunk = Drawn(config(tmp_path))[0]
    driven = set(map(bytes, chunk["environment"][chunk["kind"] == DRIVEN]))
    elsewhere = np.array([bytes(scene) not in driven for scene in chunk["environment"]])
    elsewhere &= chunk["kind"] == OTHER
    scenes, poses = chunk["environment"][elsewhere], chunk["state"][elsewhere]
    assert 1 < len(np.unique(scenes, axis=0)) < len(np.unique(poses, axis=0))


def test_every_fourth_chunk_has_other_light_and_is_not_measured(tmp_path):
    """Colours of its pictures change from scene to scene, and none counts as what a policy sees."""
    drawn = Drawn(config(tmp_path))
    plain, randomised = drawn[2], drawn[3]
    assert set(randomised["kind"]) == {OTHER}
    corners = [{bytes(picture[0, 0]) for picture in chunk["front"]} for chunk in (plain, randomised)]
    assert len(corners[0]) < len(corners[1])


def test_batches_come_as_often_as_is_said():
    chunks = ({"kind": np.arange(10) + 10 * number} for number in range(20))
    found = list(batches(chunks, 5, 1.5, 40, 0))
    assert len(found) == 60
    assert all(len(batch["kind"]) == 5 for batch in found)
    assert found[-1]["kind"].min() >= 150


def test_an_encoder_learns_and_goes_on(tmp_path, capsys):
    train(config(tmp_path))
    before = Encoder.load(tmp_path / "e.safetensors")
    train(config(tmp_path, updates=6))
    after = Encoder.load(tmp_path / "e.safetensors")
    assert before.digest != after.digest
    state = torch.load(tmp_path / "e.training", weights_only=True)
    assert state["at"][0] == 6
    assert "goal" in capsys.readouterr().out
    with pytest.raises(HandrailError, match="say --overwrite: was begun with other settings"):
        train(config(tmp_path, lr=1e-4))
    assert Drawn(config(tmp_path)).reads == after.reads


@pytest.fixture(scope="module")
def looking(tmp_path_factory):
    """Return a dataset with pictures, an encoder that has hardly learnt, and a policy trained with it."""
    folder = tmp_path_factory.mktemp("looking")
    train(config(folder))
    line = f"--task reach --mode ee --cameras front,wrist --image_size {SIZE} --dataset.num_episodes 2"
    record_by_command(folder / "data", line)
    settings = TrainConfig(
        dataset=StoredConfig(root=str(folder / "data")),
        encoder=str(folder / "e.safetensors"),
        output=str(folder / "policy"),
        steps=2,
    )
    return folder, settings, train_policy(settings)


def test_a_policy_learns_from_the_truth(looking):
    """And looks when it drives: the encoder is in the checkpoint."""
    _, settings, _ = looking
    source, told = read_source(settings), read_source(dataclasses.replace(settings, encoder=""))
    np.testing.assert_array_equal(source.columns[ENVIRONMENT], told.columns[ENVIRONMENT])
    assert source.encoder is not None


def test_where_nobody_knows_the_truth_it_learns_what_the_encoder_says(looking, tmp_path):
    """As in a dataset of a real robot: LeRobot's own tool takes the truth away."""
    folder, settings, _ = looking
    known = LeRobotDataset("local/data", root=folder / "data")
    remove_feature(known, [ENVIRONMENT], tmp_path / "unknown", "local/unknown")
    unknown = dataclasses.replace(settings, dataset=StoredConfig(root=str(tmp_path / "unknown")))
    source, told = read_source(unknown), read_source(settings)
    assert source.features == told.features
    np.testing.assert_array_equal(source.columns[STATE], told.columns[STATE])
    assert np.isfinite(source.columns[ENVIRONMENT]).all()
    assert not np.allclose(source.columns[ENVIRONMENT], told.columns[ENVIRONMENT], atol=0.1)
    blind = LeRobotDataset("local/unknown", root=tmp_path / "unknown")
    remove_feature(blind, ["observation.images.front"], tmp_path / "blind", "local/blind")
    with pytest.raises(HandrailError, match="or pictures of front, wrist; found none of front"):
        read_source(dataclasses.replace(settings, dataset=StoredConfig(root=str(tmp_path / "blind"))))
    with pytest.raises(HandrailError, match="found no observation"):
        read_source(dataclasses.replace(unknown, encoder=""))


def test_numbers_that_an_encoder_never_estimates_are_not_learnt():
    one = Encoder(Drawn(EncoderConfig(task="pick_place", image_size=SIZE)).reads)
    told = tellable(np.ones((2, len(one.reads.interface.environment_names)), np.float32), one)
    names = zip(one.reads.interface.environment_names, told[0], strict=True)
    assert {name.split(".")[0] for name, value in names if value == 0.0} == {
        *("obstacle_0", "obstacle_1", "obstacle_2")
    }


def test_anybody_can_run_it(looking):
    """LeRobot's own loader brings the encoder along, with its weights."""
    folder, _, place = looking
    policy = PreTrainedConfig.from_pretrained(place)
    before, _ = make_pre_post_processors(policy, str(place))
    assert "handrail_policy_encoder" in [getattr(type(step), "_registry_name", "") for step in before.steps]
    with open_dataset(folder / "data") as dataset:
        state = dataset.frames(0, [STATE])[STATE][:1]
    images = {f"observation.images.{name}": torch.rand(1, 3, SIZE, SIZE) for name in ("front", "wrist")}
    first = before(images | {STATE: torch.from_numpy(state)})
    before.reset()
    told = before(images | {STATE: torch.from_numpy(state), ENVIRONMENT: torch.full((1, 7), 9.0)})
    assert torch.isfinite(first[ENVIRONMENT]).all()
    torch.testing.assert_close(first[ENVIRONMENT], told[ENVIRONMENT])  # whatever is told


def test_other_pictures_are_shown(looking, tmp_path, monkeypatch):
    _, _, place = looking
    seen, act = [], TrainedPolicy.act

    def watched(self, state, environment=None, images=None, task=""):
        seen.append(np.mean([picture.mean() for picture in images.values()]))
        return act(self, state, environment, images, task)

    monkeypatch.setattr(TrainedPolicy, "act", watched)
    asked = EvaluateConfig(
        checkpoints=(str(place),),
        episodes=1,
        perturbation="none,blank,swap",
        time_limit=1.0,
        json=str(tmp_path / "e.json"),
        workers=1,
    )
    assert read_checkpoint(place, asked).pictures == {"front": (SIZE, SIZE), "wrist": (SIZE, SIZE)}
    arms = evaluate(asked)["arms"]
    assert list(arms) == ["ee", "ee cameras blank", "ee pictures of another episode"]
    assert json.loads((tmp_path / "e.json").read_text())["arms"].keys() == arms.keys()
    plain, blank, swapped = np.split(np.array(seen), 3)
    assert max(blank) == 0.0 < min(*plain, *swapped)
    assert plain[0] != swapped[0]


@pytest.mark.parametrize("asked", [{"robot": "lekiwi"}, {"robot": "moved.toml"}, {"task": "pick_place"}])
def test_a_policy_that_says_its_robot_and_task_drives_no_other(looking, asked):
    """It would be measured on its own instead, and nobody would know."""
    (said,) = asked.values()
    with pytest.raises(HandrailError, match=f"expected one trained for {said}, got"):
        read_checkpoint(looking[2], EvaluateConfig(**asked))


def test_saliency_is_where_the_thing_is():
    """With a network that looks at one place only, that place is red."""
    drawn = Drawn(EncoderConfig(image_size=SIZE))
    encoder = Encoder(drawn.reads)
    pictures = {name: np.zeros((SIZE, SIZE, 3), np.uint8) for name in ("front", "wrist")}

    class Corner(torch.nn.Module):
        def forward(self, shown):
            bright = shown["front"][:, :, 5, 40].sum(1) + 0.0 * shown["wrist"].sum()
            return bright[:, None, None] * torch.ones(1, 2, sum(encoder.reads.sizes))

    blind = Encoder(drawn.reads, Corner())
    heat = blind.saliency(pictures)["front"]
    assert np.unravel_index(heat.argmax(), heat.shape) == (5, 40)
    assert heat.max() == pytest.approx(1.0)


def test_a_draft_of_something_else_is_refused(tmp_path):
    settings = config(tmp_path)
    torch.save({"a": 1}, settings.file.with_suffix(".training"))
    with pytest.raises(HandrailError, match="say --overwrite"):
        train(settings)


def test_two_trainings_never_write_one_encoder(tmp_path):
    settings = config(tmp_path)
    with (
        FolderLock(tmp_path / ".e.safetensors.lock"),
        pytest.raises(HandrailError, match="by another handrail-encoder"),
    ):
        train(settings)
    assert not settings.file.with_suffix(".training").exists()


def test_a_full_disk_is_one_line_and_keeps_the_draft(tmp_path, monkeypatch):
    settings = config(tmp_path, updates=1)
    train(settings)
    before = tree(tmp_path)

    def full(path, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(atomic, "write_synced", full)
    with pytest.raises(HandrailError, match=r"cannot write .*e\.training': No space left on device"):
        train(dataclasses.replace(settings, updates=2))
    assert tree(tmp_path) == before


def test_an_encoder_that_is_there_is_never_replaced_unasked(tmp_path):
    settings = config(tmp_path, updates=1)
    train(settings)
    settings.file.with_suffix(".training").unlink()
    kept = settings.file.read_bytes()
    with pytest.raises(HandrailError, match=r"no e\.training to go on from; say --overwrite"):
        train(settings)
    assert settings.file.read_bytes() == kept
    train(dataclasses.replace(settings, overwrite=True, seed=1))
    assert settings.file.read_bytes() != kept


@pytest.mark.parametrize(
    ("task", "movable"), [("reach", ()), ("pick_place", ("cube",)), ("drawer", ("handle",))]
)
def test_what_moves_is_not_taken_for_standing(tmp_path, task, movable):
    reads = Drawn(config(tmp_path, task=task)).reads
    assert tuple(name for name, _, _ in reads.objects if name in reads.movable) == movable
