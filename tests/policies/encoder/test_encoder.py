"""An encoder's laws: what it says comes from pictures, its file is all that it is, its memory fits."""

import numpy as np
import pytest
import torch
from safetensors.torch import save_file
from scipy.spatial.transform import Rotation

from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_env, session_features
from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.interface.compute import device_of
from handrail.policies.imitation.interface.encoder import Encoder, Reads, Said, find_encoder, same
from handrail.policies.imitation.interface.encoder_step import encoder_step
from handrail.policies.imitation.interface.interface import ENVIRONMENT, STATE, PolicyInterface
from handrail.policies.imitation.interface.network import Eye, windows
from handrail.policies.imitation.interface.scene_memory import SceneMemory
from handrail.policies.imitation.interface.views import (
    PLACED,
    CameraMount,
    facing,
    in_picture,
    placed,
    spread,
)

SIZE = (32, 48)


def reads(task="pick_place"):
    env = build_env(SessionConfig(task=task), 20)
    interface = PolicyInterface.of_dataset(session_features(env), (), "realised")
    mounts = {each.name: CameraMount.of(each, env.model, SIZE) for each in env.model.description.cameras}
    return Reads("ridgeback_ur10", task, mounts, interface, {"cube": 4}, ("cube",))


def encoder(seed=0):
    torch.manual_seed(seed)
    return Encoder(reads())


def moments(count=3, seed=0):
    """Return pictures and states of some moments."""
    env, rng = build_env(SessionConfig(task="pick_place"), 20), np.random.default_rng(seed)
    states = np.stack([env.reset(seed=each)[0]["agent_pos"] for each in range(count)])
    pictures = {name: rng.integers(0, 256, (count, *SIZE, 3), np.uint8) for name in ("front", "wrist")}
    return pictures, states


def test_it_tells_of_what_has_a_pose_or_a_position_and_of_nothing_else():
    said, (pictures, states) = encoder(), moments()
    assert [name for name, _, _ in said.reads.objects] == ["cube", "bin", "cube_table", "bin_table"]
    numbers = SceneMemory(said.reads).take(said.said(said.read(pictures), states), 0)
    names = said.reads.interface.environment_names
    zero = {name.split(".")[0] for name, value in zip(names, numbers, strict=True) if value == 0.0}
    assert zero == {"obstacle_0", "obstacle_1", "obstacle_2"}


def test_its_file_is_all_that_it_is(tmp_path):
    one, (pictures, states) = encoder(), moments()
    one.save(tmp_path / "a.safetensors")
    loaded = find_encoder(str(tmp_path / "a.safetensors"))
    loaded.save(tmp_path / "b.safetensors")
    assert loaded.reads == one.reads
    assert loaded.digest == one.digest != encoder(1).digest
    assert (tmp_path / "a.safetensors").read_bytes() == (tmp_path / "b.safetensors").read_bytes()
    first, second = (each.said(each.read(pictures), states)["cube"][0] for each in (one, loaded))
    np.testing.assert_allclose(first.position, second.position, atol=5e-3)  # float16


def test_estimates_move_with_the_robot():
    """The same picture elsewhere is the same thing, as far from the hand."""
    one, (pictures, states) = encoder(), moments(1)
    names = one.reads.interface.state_names
    elsewhere = states.copy()
    for name, by in (("x.pos", 1.0), ("tool.x", 1.0)):
        elsewhere[:, names.index(name)] += by
    said = [one.said(one.read(pictures), each)["cube"] for each in (states, elsewhere)]
    for here, there in zip(*said, strict=True):
        np.testing.assert_allclose(there.position - here.position, [[1.0, 0.0, 0.0]], atol=1e-5)
        np.testing.assert_allclose(there.spread, here.spread)
        np.testing.assert_allclose(np.array(there.rotation), np.array(here.rotation), atol=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda pictures: pictures.pop("wrist"), "camera wrist, 48 x 32 pixels, got none"),
        (lambda pictures: pictures.update(front=pictures["front"][:, :16]), "camera front, 48 x 32 pixels"),
    ],
)
def test_other_pictures_are_refused(change, words):
    change(pictures := moments()[0])
    with pytest.raises(HandrailError, match=words):
        encoder().read(pictures)


def test_a_file_of_something_else_is_refused(tmp_path):
    one, path = encoder(), tmp_path / "e.safetensors"
    with pytest.raises(HandrailError, match="unknown encoder"):
        find_encoder("nowhere")
    path.write_bytes(b"nothing")
    with pytest.raises(HandrailError, match=r"e\.safetensors"):
        find_encoder(str(path))
    save_file(one.network.state_dict(), path)
    with pytest.raises(HandrailError, match="expected"):
        find_encoder(str(path))
    next(one.network.parameters()).data[0] = float("nan")
    one.save(path)
    with pytest.raises(HandrailError, match="expected finite weights"):
        find_encoder(str(path))


def said(place, off=0.1, turn=None, turned_off=0.1, away=0.1):
    """Return what a camera says that is as far off in every direction."""
    rotation = None if turn is None else np.asarray(turn)[None]
    place, turned_off = np.array([place], float), np.array([turned_off], float)
    tools = (place + [[away, 0.0, 0.0]])[:, None]
    return [Said(tools, place, off**2 * np.eye(3)[None], rotation, turned_off)]


def remembered(memory, of_cube):
    others = {name: said([0.0, 0.0, 0.0]) for name in ("bin", "cube_table", "bin_table")}
    return memory.take({"cube": of_cube} | others, 0)[:7]


def test_repeated_estimates_become_surer():
    memory, rng = SceneMemory(reads()), np.random.default_rng(0)
    for _ in range(50):
        now = remembered(memory, said([1.0, 2.0, 0.5] + rng.normal(0, 0.05, 3), 0.1, np.eye(3)))
    assert np.linalg.norm(now[:3] - [1.0, 2.0, 0.5]) < 0.04
    np.testing.assert_allclose(now[3:], [1.0, 0.0, 0.0, 0.0], atol=1e-6)


def test_a_cube_out_of_the_hand_s_reach_stands():
    """In the hand a cube is where it is seen now; elsewhere where it was seen on average."""
    held, elsewhere = SceneMemory(reads()), SceneMemory(reads())
    for x in np.linspace(0.0, 1.0, 50):
        in_hand = remembered(held, said([x, 0.0, 0.0], 0.02, np.eye(3), away=0.05))
    rng = np.random.default_rng(0)
    for _ in range(50):
        stands = remembered(elsewhere, said(rng.normal(0, 0.05, 3), 0.08, np.eye(3), away=1.0))
    assert abs(in_hand[0] - 1.0) < 0.03
    assert np.linalg.norm(stands[:3]) < 0.025


def test_surer_estimates_count_more():
    memory = SceneMemory(reads())
    remembered(memory, said([1.0, 0.0, 0.0], 0.01, np.eye(3)))
    assert remembered(memory, said([1.02, 0.0, 0.0], 0.1, np.eye(3)))[0] < 1.001


def test_one_far_word_is_not_believed_many_are():
    memory = SceneMemory(reads())
    for _ in range(20):
        remembered(memory, said([1.0, 0.0, 0.0], 0.01, np.eye(3)))
    far = said([2.0, 0.0, 0.0], 0.01, np.eye(3))
    assert remembered(memory, far)[0] == pytest.approx(1.0)
    for _ in range(60):
        now = remembered(memory, far)
    assert now[0] == pytest.approx(2.0, abs=0.01)


def test_unsure_estimates_hardly_move_known_places():
    """A thing that stands was seen well, and is out of sight since."""
    memory = SceneMemory(reads())
    turns = {name: np.eye(3) if len(parts) == 7 else None for name, parts, _ in reads().objects}
    there = {name: said([1.0, 0.0, 0.0], 0.01, turn) for name, turn in turns.items()}
    lost = {name: said([1.5, 0.0, 0.0], 0.5, turn) for name, turn in turns.items()}
    for _ in range(20):
        memory.take(there, 0)
    for _ in range(20):
        known = memory.take(lost, 0)
    assert abs(known[7] - 1.0) < 0.05  # the bin


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_nan_is_never_remembered(bad):
    """Neither as the first word nor later."""
    memory, broken = SceneMemory(reads()), said([bad] * 3, 0.01, np.full((3, 3), bad), bad)
    assert np.isfinite(remembered(memory, broken)).all()
    first = remembered(memory, said([1.0, 0.0, 0.0], 0.01, np.eye(3)))
    np.testing.assert_allclose(first[:3], [1.0, 0.0, 0.0])
    np.testing.assert_array_equal(remembered(memory, broken), first)
    np.testing.assert_allclose(
        remembered(memory, said([1.0, 0, 0], 0.01, np.zeros((3, 3)))), first, atol=1e-9
    )


def test_an_unknown_device_is_refused():
    assert device_of("cpu") == "cpu"
    with pytest.raises(HandrailError, match="unknown device 'tpu': expected one of cpu"):
        device_of("tpu")


def test_a_quarter_turn_of_a_cube_is_no_turn():
    memory, quarter = SceneMemory(reads()), same(4)[1]
    first = remembered(memory, said([1.0, 0.0, 0.0], 0.01, np.eye(3)))
    np.testing.assert_allclose(remembered(memory, said([1.0, 0.0, 0.0], 0.01, quarter)), first, atol=1e-6)


def test_in_a_checkpoint_it_says_the_same(tmp_path):
    """As a step of LeRobot's it reads robots side by side, and forgets when an episode begins."""
    one, (pictures, states) = encoder(), moments(2)
    step = encoder_step(one)
    step.load_state_dict(step.state_dict())
    images = {
        f"observation.images.{name}": torch.from_numpy(each).movedim(-1, 1) / 255.0
        for name, each in pictures.items()
    }
    shown = images | {STATE: torch.from_numpy(states), ENVIRONMENT: torch.zeros(2, 28)}
    memories = [SceneMemory(one.reads), SceneMemory(one.reads)]
    for times in ([0.0, 0.0], [0.05, 0.05], [0.10, 0.0]):
        if times[1] == 0.0:
            memories[1] = SceneMemory(one.reads)
        told = one.said(one.read(pictures), states)
        expected = np.stack([memory.take(told, row) for row, memory in enumerate(memories)])
        found = step({"observation": shown | {"observation.time": torch.tensor(times)[:, None]}})
        np.testing.assert_array_equal(found["observation"][ENVIRONMENT].numpy(), expected)
    joined = {**images, STATE: torch.cat([torch.from_numpy(states), torch.ones(2, 28)], 1)}
    step.reset()
    found = step({"observation": joined})["observation"]
    assert found[STATE].shape == (2, states.shape[1])
    np.testing.assert_array_equal(found[ENVIRONMENT][0], SceneMemory(one.reads).take(told, 0))


@pytest.mark.parametrize("size", [(96, 96), (224, 224), (360, 640)])
def test_an_eye_says_where_in_a_picture_something_is(size):
    """An eye whose heat is brightness says where the one bright place is."""
    eye = Eye(size[0], [PLACED]).eval()

    class Bright(torch.nn.Module):
        def forward(self, pictures):
            bright = torch.nn.functional.avg_pool2d(pictures.mean(1, keepdim=True), 8)
            return bright.expand(-1, eye.heat.in_channels, -1, -1)

    class Half(torch.nn.Module):
        def forward(self, found):
            return found[:, : eye.heat.in_channels]

    eye.near, eye.around, eye.both = Bright(), torch.nn.Identity(), Half()  # pyright: ignore[reportAttributeAccessIssue]
    torch.nn.init.constant_(eye.heat.weight, 10.0)
    torch.nn.init.zeros_(eye.say[-1].weight)
    torch.nn.init.zeros_(eye.say[-1].bias)
    shown = -torch.ones(1, 3, *size)
    row, column = round(0.25 * size[0] / 8) * 8, round(0.75 * size[1] / 8) * 8
    shown[:, :, row : row + 8, column : column + 8] = 1.0
    said, heat = eye(shown)
    u, v = said[0, :2].tolist()
    assert heat.exp().sum((2, 3)).item() == pytest.approx(1.0)
    assert u == pytest.approx(2.0 * (column + 4) / size[1] - 1.0, abs=0.02)
    assert v == pytest.approx(2.0 * (row + 4) / size[0] - 1.0, abs=0.02)


def test_it_looks_closely_at_what_it_found():
    """Windows are of the picture itself, around each place; the second shows four times as much."""
    shown = torch.rand(2, 3, 360, 640)
    places = torch.tensor([[[2 * 100 / 640 - 1, 2 * 60 / 360 - 1], [0.0, 0.0]]] * 2)
    near = windows(shown, places)
    assert near.shape == (4, 6, 32, 32)
    torch.testing.assert_close(near[2, :3], shown[1, :, 44:76, 84:116], atol=1e-4, rtol=0)
    wide = torch.nn.functional.avg_pool2d(shown[1], 4)[:, 29:61, 64:96]
    torch.testing.assert_close(near[3, 3:], wide, atol=1e-4, rtol=0)


def test_a_thing_looks_the_same_wherever_it_is_in_the_picture():
    """What is said of its turn is as from a camera that faces it."""
    ways = np.random.default_rng(0).normal(size=(20, 3))
    turned = facing(ways)
    away = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    np.testing.assert_allclose(turned @ [0.0, 0.0, -1.0], away, atol=1e-9)
    np.testing.assert_allclose(turned.swapaxes(1, 2) @ turned - np.eye(3), 0.0, atol=1e-9)
    least = np.cos(Rotation.from_matrix(turned).magnitude())  # none about the way itself
    np.testing.assert_allclose(least, -away[:, 2], atol=1e-9)


def test_a_place_in_two_pictures_is_a_place_in_space():
    """Cameras that know no distance find a thing where their rays meet."""
    mounts, states = reads().cameras, moments(1)[1]
    pose = reads().interface.pose(states)
    thing = pose.tool[0] + [0.3, 0.1, -0.2]
    seen = []
    for mount in mounts.values():
        place, turn = (each[0] for each in mount.view(pose))
        way = turn.T @ (thing - place)
        u, v = way[0] / -way[2] / mount.slope / (SIZE[1] / SIZE[0]), way[1] / way[2] / mount.slope
        numbers = torch.tensor([[u, v, 0.0, np.log(0.002), np.log(1.0)]])
        d, ray, width = (
            each.numpy() for each in placed(numbers, torch.tensor([mount.slope], dtype=torch.float64), SIZE)
        )
        np.testing.assert_allclose(ray[0], way / np.linalg.norm(way), atol=1e-6)
        again = in_picture(torch.from_numpy(d), torch.tensor([mount.slope], dtype=torch.float64), SIZE)
        np.testing.assert_allclose(again[0], [u, v], atol=1e-6)
        off = spread(ray @ turn.T, width)
        seen.append(Said(pose.tool[:, None], place + d @ turn.T, off, np.eye(3)[None], np.ones(1)))
    others = {name: said([0.0, 0.0, 0.0]) for name in ("bin", "cube_table", "bin_table")}
    memory = SceneMemory(reads())
    for _ in range(5):
        found = memory.take({"cube": seen} | others, 0)[:3]
    np.testing.assert_allclose(found, thing, atol=0.01)
