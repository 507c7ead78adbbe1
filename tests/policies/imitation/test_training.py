"""Training of imitation policies: the same numbers as LeRobot's own, the right episodes, nothing lost."""

import dataclasses
import json
import os
import re
import shutil
import subprocess
import sys
from typing import Any
from unittest import mock

import numpy as np
import pytest
import torch
from places import ROOT
from training_helpers import FPS, TINY, features, refused, tiny, weights, write_dataset

from handrail.collect.config import StoredConfig
from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.interface.checkpoint import read_meta
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training import presets, run
from handrail.policies.imitation.training.presets import policy_config
from handrail.policies.imitation.training.source import read_source, steadied
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")


@pytest.mark.parametrize("policy", ["act", "diffusion"])
def test_the_dataset_in_memory_gives_the_same_tensors_as_lerobot_s_own(policy, recorded, tmp_path):
    from lerobot.datasets.factory import resolve_delta_timestamps
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    options = TINY if policy == "act" else ("horizon=8", "n_action_steps=4")
    config = tiny(recorded, tmp_path, actions="recorded", policy=policy, policy_options=options)
    described = policy_config(config)
    ours = read_source(config).dataset(described)
    stamps = resolve_delta_timestamps(described, ours.meta)
    theirs = LeRobotDataset("handrail/test", root=recorded, delta_timestamps=stamps)
    assert len(ours) == len(theirs)
    batch = ours.batch(range(len(ours)))
    for index in range(len(ours)):
        sample: Any = theirs[index]
        for key in set(ours.columns) | {f"{key}_is_pad" for key in ours.windows}:
            assert torch.equal(batch[key][index], sample[key]), key
        assert batch["task"][index] == sample["task"]
    assert any(batch[f"{key}_is_pad"].any() for key in ours.windows)
    assert torch.equal(ours.batch([3, 1])["action"], batch["action"][[3, 1]])


def test_the_learnt_columns_are_the_interface_s(recorded, tmp_path):
    source = read_source(tiny(recorded, tmp_path, actions="intent"))
    frames = read_frames(recorded, 1)
    assert source.interface is not None
    seen = source.interface.observe(frames["observation.state"], frames["observation.environment_state"])
    rows = source.columns["episode_index"] == 1
    np.testing.assert_array_equal(source.columns["observation.state"][rows], seen[0])
    np.testing.assert_array_equal(source.columns["observation.environment_state"][rows], seen[1])
    np.testing.assert_array_equal(source.columns["action"][rows], source.interface.encode(frames))


def test_statistics_are_of_the_chosen_episodes_only(recorded, tmp_path):
    config = tiny(recorded, tmp_path, episodes=1)
    source = read_source(config)
    dataset = source.dataset(policy_config(config))
    mean = source.columns["action"].mean(axis=0)
    np.testing.assert_allclose(dataset.meta.stats["action"]["mean"], mean, atol=1e-6)
    assert len(dataset.meta.lengths) == 1


def test_a_nearly_constant_column_is_not_scaled_up():
    still = {name: np.array([2.0, 2.0]) for name in ("min", "max", "q01", "q99", "q10", "q90", "mean")}
    steady = steadied(still | {"std": np.array([0.0, 0.5])})
    assert 1e-3 <= steady["std"][0] < steady["std"][1] == 0.5
    np.testing.assert_allclose(steady["max"] - steady["min"], 2 * steady["std"][0])
    np.testing.assert_allclose((steady["max"] + steady["min"]) / 2, 2.0)


def test_a_checkpoint_says_all_that_is_needed(trained, recorded):
    folder, _ = trained
    meta = read_meta(folder)
    assert folder.parent.name == "000006"
    assert os.readlink(folder.parents[1] / "last") == "000006"
    frames = [read_frames(recorded, row["episode_index"]) for row in read_episodes(recorded)]
    assert meta.interface == PolicyInterface.of_dataset(features(), frames, "realised")
    assert (meta.environment, meta.mode, meta.robot, meta.fps) == ("reach", "ee", "ridgeback_ur10", FPS)
    assert meta.trained_on == {"episodes": 3, "attempts": 3, "operator_time": 24 / FPS}
    assert (meta.steps, meta.policy, meta.training["batch_size"]) == (6, "act", 8)


@pytest.mark.parametrize(
    ("limits", "longest"), [((), 0.0), ((0.0, 0.0), 0.0), ((12.0, 45.0), 45.0), ((12.0, 0.0), 30.0)]
)
def test_a_checkpoint_says_how_long_its_episodes_could_last(limits, longest, tmp_path):
    """0 is the task's own limit, 30 s of `reach`."""
    root = write_dataset(tmp_path / "set", lengths=(9, 7), limits=limits)
    folder = train(tiny(root, tmp_path / "policy", steps=1))
    assert read_meta(folder).time_limit == longest


def test_the_same_seed_gives_the_same_weights_and_another_seed_others(trained, tmp_path):
    folder, config = trained
    again = train(dataclasses.replace(config, output=str(tmp_path / "again")))
    assert weights(again) == weights(folder)
    other = train(dataclasses.replace(config, output=str(tmp_path / "other"), seed=1))
    assert weights(other) != weights(folder)


def test_sizes_are_what_the_policy_and_the_training_get(recorded, tmp_path):
    options = ("chunk_size=7", "n_action_steps=3")
    config = tiny(recorded, tmp_path, policy_options=options, batch_size=0, lr=0.25)
    sizes, described = presets.resolved(config), vars(policy_config(config))
    for name, value in sizes.options.items():
        assert described[name] == value
    assert described["optimizer_lr"] == described["optimizer_lr_backbone"] == sizes.lr == 0.25
    assert sizes.batch_size == presets.resolved(TrainConfig()).batch_size > 0
    assert sizes.steps == 6
    assert described["temporal_ensemble_coeff"] is None


@pytest.mark.parametrize("option", ["dim_model=130", "dropout=2.0", "feedforward_activation=loud"])
def test_settings_that_no_policy_can_be_built_with_are_one_line(option, recorded, tmp_path):
    config = TrainConfig(StoredConfig(root=str(recorded)), str(tmp_path), policy_options=(option,))
    refused(config, "^policy act: ")


@pytest.mark.parametrize("kind", ["FSDP", "DEEPSPEED"])
def test_a_launch_that_splits_the_model_is_refused_in_one_line(kind, recorded, tmp_path, monkeypatch):
    """Law: accelerate's FSDP and DeepSpeed, whose parts a checkpoint does not gather, train nothing."""
    from accelerate import Accelerator
    from accelerate.utils import DistributedType

    monkeypatch.setattr(Accelerator, "distributed_type", DistributedType[kind])
    refused(tiny(recorded, tmp_path / "policy"), f"expected one process or --multi_gpu, got {kind}")
    assert not (tmp_path / "policy").exists()


@pytest.mark.parametrize("resume", [False, True])
def test_a_file_in_the_place_of_the_training_is_one_line(resume, recorded, tmp_path):
    (tmp_path / "file").touch()
    for place, said in (("file", "found a file"), ("file/below", "file/below: ")):
        refused(tiny(recorded, tmp_path / place, resume=resume), said)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"policy": "actt"}, "expected one of act"),
        ({"policy_options": ("chunk=5",)}, "unknown setting of the policy act 'chunk'"),
        ({"policy_options": ("chunk_size",)}, "expected key=value"),
        ({"policy_options": ("chunk_size=many",)}, "policy act: .*chunk_size"),
        ({"policy_options": ("n_action_steps=500",)}, "policy act: .*n_action_steps"),
        ({"policy_options": ("n_action_steps=5", "temporal_ensemble_coeff=0.01")}, "policy act: .*ensembl"),
        ({"device": "tpu"}, "expected one of cpu"),
        ({"images": True}, "expected cameras"),
        ({"scene": False}, "--no_scene: expected --images too"),
        ({"steps": -1}, "--steps: expected a whole number >= 0"),
        ({"eval_split": 1.0}, "--eval_split: expected a number < 1"),
        ({"resume": True, "overwrite": True}, "expected one of them"),
        ({"dataset": StoredConfig(root="nowhere")}, "expected a folder"),
    ],
)
def test_wrong_settings_are_one_line_and_leave_nothing(settings, said, recorded, tmp_path):
    refused(tiny(recorded, tmp_path / "policy", **({"policy_options": ()} | settings)), said)
    assert not (tmp_path / "policy").exists()


def test_an_existing_output_is_kept_unless_it_may_go(trained, recorded, tmp_path):
    folder, config = trained
    refused(config, "say --resume or --overwrite")
    refused(dataclasses.replace(config, resume=True, seed=5), "--resume with --seed 5: expected 0")
    assert train(dataclasses.replace(config, resume=True)) == folder  # already there
    for name in ("thesis.tex", "checkpoints/thesis.tex"):
        thesis = tmp_path / name.replace("/", "-") / name
        thesis.parent.mkdir(parents=True)
        thesis.touch()
        config = tiny(recorded, tmp_path / name.replace("/", "-"), overwrite=True)
        refused(config, f"missing or empty folder, found {name}")
        assert thesis.exists()


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"dataset": StoredConfig(root="nowhere")}, "expected a folder"),
        ({"policy_options": ("dim_model=130",)}, "^policy act: "),
    ],
)
def test_an_existing_policy_is_kept_if_the_training_cannot_begin(wrong, said, trained, tmp_path):
    folder, config = trained
    config = dataclasses.replace(config, output=str(tmp_path / "policy"), steps=2, overwrite=True)
    shutil.copytree(folder.parents[2], config.folder, symlinks=True)
    refused(dataclasses.replace(config, **wrong), said)
    assert weights(config.folder / "checkpoints" / "last" / "pretrained_model") == weights(folder)
    assert os.listdir(train(config).parents[1]) == ["000002", "last"]


def test_one_training_at_a_time_writes_a_folder(recorded, tmp_path):
    config = tiny(recorded, tmp_path / "policy", steps=1)
    others = [dataclasses.replace(config, **{flag: True}) for flag in ("resume", "overwrite")]

    def update(*_):
        for other in others:
            refused(other, "by another handrail-train")

    with mock.patch.object(run, "update_policy", update):
        train(config)
    assert os.listdir(tmp_path) == ["policy"]


def test_a_link_to_a_folder_is_a_folder(recorded, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "policy").symlink_to("elsewhere")
    for overwrite in (False, True):
        train(tiny(recorded, tmp_path / "policy", steps=1, overwrite=overwrite))
    assert load_policy(tmp_path / "elsewhere").meta.steps == 1
    assert (tmp_path / "policy").is_symlink()
    (tmp_path / "loop").symlink_to("loop")
    refused(tiny(recorded, tmp_path / "loop"), "^training in .*loop")


def test_weights_that_are_no_numbers_are_not_written(recorded, tmp_path):
    config = tiny(recorded, tmp_path / "policy", lr=1e12)
    refused(config, "expected finite weights")
    assert not [path for path in (config.folder / "checkpoints").glob("*") if path.name.isdecimal()]


def test_an_average_over_plans_begins_anew_where_nobody_asked(recorded, tmp_path):
    """Law: after a gap nothing counts that was planned for moments of before."""
    options = (*TINY, "n_action_steps=1", "temporal_ensemble_coeff=0.01")
    policy = load_policy(train(tiny(recorded, tmp_path / "policy", steps=1, policy_options=options)))
    seen, later = (
        [np.full(len(names), at) for names in policy.meta.interface.observation_names] for at in (0, 1)
    )
    policy.reset()
    alone = policy.act(*later)
    policy.reset()
    first = policy.act(*seen), policy.act(*later)
    policy.skip(2)
    np.testing.assert_array_equal(policy.act(*later), alone)
    assert not np.array_equal(first[1], alone)


def test_no_source_patches_another_library_s_names():
    floors = ("controllers", "datasets", "collect", "policies", "scripts")
    files = [path for floor in floors for path in (ROOT / floor).rglob("*.py")]
    assert len(files) > 100
    for path in files:
        assert not re.search(r"\bunittest\b|\bmonkeypatch\b", path.read_text()), path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("launcher", "processes"),
    [
        ("accelerate.commands.accelerate_cli launch --cpu --num_processes 1", 1),
        ("torch.distributed.run --nproc_per_node 2", 2),  # what accelerate uses where there are several GPUs
    ],
)
def test_several_processes_train_one_policy(launcher, processes, recorded, tmp_path):
    options = f"--dataset.root {recorded} --output {tmp_path / 'policy'} --steps 6 --batch_size 4"
    words = ["-m", *launcher.split(), "-m", "handrail.scripts", "train", *options.split()]
    done = subprocess.run([sys.executable, *words, "--policy_options", *TINY], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    assert load_policy(tmp_path / "policy").meta.steps == 6
    state = tmp_path / "policy" / "checkpoints" / "last" / "training_state" / "training_step.json"
    assert json.loads(state.read_text())["num_processes"] == processes
