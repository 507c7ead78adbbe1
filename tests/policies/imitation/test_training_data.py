"""Data on which policies are trained: of other tools, of several modes; or a line that names the lack."""

import itertools
import json
import shutil

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from canned import canned
from training_helpers import FPS, TINY, refused, tiny, write_dataset

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.interface.checkpoint import read_meta
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training.selection import select
from handrail.policies.imitation.training.source import read_source
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")
PICTURES = "observation.images.top"
STATE, ENVIRONMENT = "observation.state", "observation.environment_state"
CASES = {
    "no state": ((ENVIRONMENT, "action"), "act", "a column 'observation.state' for policy act"),
    "no state for diffusion": ((ENVIRONMENT, "action"), "diffusion", "for policy diffusion; got"),
    "nothing but the action": (("action",), "act", "'observation.state' .* got no observation"),
    "pictures only": ((PICTURES, "action"), "act", "for policy act; got observation.images.top"),
    "pictures for another": ((PICTURES, "action"), "tdmpc", "or pictures and --images, for policy tdmpc"),
    "state and pictures": ((STATE, PICTURES, "action"), "act", "and --images, .*observation.images.top"),
    "no action": ((STATE, PICTURES), "act", "expected a column 'action', got observation.state"),
    "nothing but pictures": ((PICTURES,), "act", "expected a column 'action', got none"),
}


def write(root, keys, dtype="float32", fps=20, robot="so101"):
    """Write a dataset with these columns and nothing else, as any recorder might."""
    vector, camera = Feature(dtype, (2,), ("a.pos", "b.pos")), Feature("video", (32, 48, 3))
    features = {key: camera if key == PICTURES else vector for key in keys}
    with EpisodeWriter.create(root, Manifest("any/body", fps, robot, features)) as writer:
        for index in range(12):
            frame = {key: np.full(2, index if dtype == "int64" else index / 12, dtype) for key in keys}
            frame |= {key: np.full((32, 48, 3), 20 * index, np.uint8) for key in keys if key == PICTURES}
            writer.add_frame(frame, "wave")
        writer.save_episode({})
    return root


@pytest.mark.parametrize("case", CASES)
def test_missing_columns_are_one_line(case, tmp_path):
    keys, policy, said = CASES[case]
    options = {"actions": "recorded", "policy": policy, "policy_options": ()}
    refused(tiny(canned(write, keys), tmp_path / "policy", **options), f"^dataset .*{said}")
    assert not (tmp_path / "policy").exists()


def test_a_dataset_of_another_tool_needs_its_columns_as_they_are(tmp_path):
    refused(tiny(canned(write, (STATE, "action")), tmp_path / "policy"), "say --actions recorded")


@pytest.mark.parametrize(("fps", "robot"), [(5, "SO-100 (follower)"), (120, "me/so100")])
def test_a_policy_of_any_rate_and_robot_s_name_can_be_read_again(fps, robot, tmp_path):
    root = canned(write, (STATE, "action"), fps=fps, robot=robot)
    policy = train(tiny(root, tmp_path / "policy", steps=1, actions="recorded"))
    assert read_meta(policy).fps == fps


def test_a_policy_of_another_rate_is_no_beginning(tmp_path):
    slow, fast = (canned(write, (STATE, "action"), fps=fps) for fps in (20, 50))
    train(tiny(slow, tmp_path / "slow", steps=1, actions="recorded"))
    config = tiny(fast, tmp_path / "fast", actions="recorded", init=str(tmp_path / "slow"))
    refused(config, "--init .*: expected a policy of 50 Hz, got 20 Hz")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_nan_is_not_learnt(value, tmp_path):
    root = shutil.copytree(canned(write, (STATE, "action")), tmp_path / "set")
    (file,) = root.glob("data/**/*.parquet")
    table = pq.read_table(file)
    actions = pa.array([[value, 0.0], *table["action"].to_pylist()[1:]], table["action"].type)
    pq.write_table(table.set_column(table.column_names.index("action"), "action", actions), file)
    (root / "meta" / "handrail.json").unlink()
    config = tiny(root, tmp_path / "policy", actions="recorded")
    refused(config, "expected finite numbers, got others in action of episode 0$")


@pytest.mark.parametrize("policy", ["act", "diffusion"])
def test_without_a_scene_the_robot_s_state_stands_for_it(policy, tmp_path):
    """LeRobot's ACT and Diffusion refuse to learn from the robot's state alone."""
    options = TINY if policy == "act" else ("horizon=8", "n_action_steps=4", "down_dims=[8,16]")
    settings = {"policy": policy, "policy_options": options, "steps": 1, "actions": "recorded"}
    config = tiny(canned(write, (STATE, "action")), tmp_path / "policy", **settings)
    columns = read_source(config).columns
    np.testing.assert_array_equal(columns[ENVIRONMENT], columns[STATE])
    loaded = load_policy(train(config))
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
    train(tiny(root, tmp_path / "policy", actions="recorded", steps=1, batch_size=12))
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


def test_an_episode_in_which_somebody_changed_the_mode_is_refused(tmp_path):
    """Its row says the one that it began in; `realised` takes it."""
    root = canned(write_dataset, driven=("ee", "direct", "ee"))
    config = {"root": root, "output": tmp_path / "policy", "steps": 1}
    refused(tiny(**config, actions="intent"), "one teleop mode.*got direct, ee;")
    assert train(tiny(**config))
    root = canned(write_dataset, driven=("ee", "ee", "ee"))
    assert read_meta(train(tiny(**config | {"root": root}, overwrite=True, actions="intent"))).mode == "ee"


@pytest.mark.parametrize(
    ("modes", "said"),
    [
        (("ee", "switching", "ee"), "got ee, switching;"),
        (("mask:01", "mask:01", "mask:01"), "got mask:01;"),
        (("", "", ""), "got no mode;"),
    ],
)
def test_an_intent_of_several_modes_is_refused(modes, said, tmp_path):
    """No one controller could complete it when the policy drives."""
    config = {"root": canned(write_dataset, modes=modes), "output": tmp_path / "policy", "actions": "intent"}
    refused(tiny(**config), f"--actions intent: expected episodes of one teleop mode.*{said}")
    assert not (tmp_path / "policy").exists()
    if "ee" in modes:
        assert read_meta(train(tiny(**config, steps=1, mode="ee"))).mode == "ee"


def test_missing_files_of_a_dataset_are_not_fetched(tmp_path):
    root = write_dataset(tmp_path / "set", lengths=(5, 6), cameras=("wrist",))
    sorted(root.rglob("*.mp4"))[0].unlink()
    refused(tiny(root, tmp_path / "policy", images=True), "was copied in part: 1 of 2 episodes")


ROWS = [
    {"episode_index": i, "length": 20 * (1 + i % 3), "mode": ("ee", "joints")[i % 2], "success": i % 4 != 1}
    for i in range(40)
]


def chosen(**settings):
    selection = select(ROWS, FPS, TrainConfig(**settings))
    return [row["episode_index"] for row in selection.rows], selection


def test_filters_keep_what_they_say():
    assert chosen()[0] == list(range(40))
    assert chosen(mode="joints")[0] == list(range(1, 40, 2))
    kept, selection = chosen(mode="joints", success_only=True)
    assert kept == list(range(3, 40, 4))
    assert selection.attempts == 20
    assert selection.operator_time == sum(row["length"] for row in ROWS[1::2]) / FPS


@pytest.mark.parametrize("success_only", [False, True])
def test_more_episodes_or_minutes_only_add(success_only):
    rising = [chosen(success_only=success_only, episodes=n) for n in range(1, 31)]
    rising_time = [chosen(success_only=success_only, minutes=m / 60) for m in range(9, 80, 5)]
    for way in (rising, rising_time):
        for (fewer, _), (more, _) in itertools.pairwise(way):
            assert set(fewer) <= set(more)
    assert [len(kept) for kept, _ in rising] == list(range(1, 31))


def test_operator_time_counts_the_failed_attempts_that_were_needed():
    for draw in range(20):
        kept, selection = chosen(success_only=True, episodes=5, draw=draw)
        seconds = sum(ROWS[index]["length"] for index in kept) / FPS
        failed = selection.attempts - 5
        assert seconds + failed * 1.0 <= selection.operator_time <= seconds + failed * 3.0
        within = chosen(success_only=True, minutes=selection.operator_time / 60, draw=draw)[0]
        assert set(kept) <= set(within)
    assert chosen(episodes=5, draw=0)[0] != chosen(episodes=5, draw=1)[0]


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"episodes": 41}, "at most the 40"),
        ({"minutes": 60.0}, "at most the 1.3"),
        ({"minutes": 0.001}, "no episode left"),
        ({"mode": "base"}, "expected one of ee, joints"),
    ],
)
def test_too_much_is_refused(settings, said):
    with pytest.raises(HandrailError, match=said):
        chosen(**settings)
