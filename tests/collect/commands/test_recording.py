"""Laws of a cockpit's folder, said or not: a dataset that fits goes on, another one is left alone."""

import shutil
from dataclasses import replace

import pytest
from canned import copied
from command_helpers import ran, refused
from datasets_helpers import record as make_dataset

from handrail.collect.commands.account import next_commands
from handrail.collect.commands.record import record
from handrail.collect.commands.recording import located, open_writer, session_writer
from handrail.collect.commands.shared import record_shard
from handrail.collect.config import DatasetConfig, DriveConfig, FoundDatasetConfig, RecordConfig
from handrail.collect.session.build import build_env
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.datasets.reading.reader import read_episodes

PLAIN = DriveConfig(physics=False)
ENV = build_env(PLAIN, PLAIN.dataset.fps)


def opened(config=PLAIN):
    """Return the folder that is chosen, and what the settings say then."""
    config.check()
    env = build_env(config, config.dataset.fps)
    there = located(config, env)
    with open_writer(there, env) as writer:
        return writer.root, there


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_the_first_time_it_is_new_and_then_it_goes_on(tmp_path):
    root, config = opened()
    assert root == tmp_path / "outputs" / "cockpit" / "reach"
    assert config.dataset.folder.absolute() == root
    assert next_commands(root)[0].endswith("handrail-inspect outputs/cockpit/reach")  # zsh takes no comments
    assert next_commands(root.parent / "my set")[1].endswith("handrail-replay 'outputs/cockpit/my set'")
    assert opened()[0] == root
    with open_writer(located(PLAIN, ENV), ENV):  # one that is being written is left alone
        assert opened()[0].name == "reach-2"


def test_one_of_another_rate_or_robot_or_no_dataset_is_left_alone(tmp_path):
    first, _ = opened()
    before = {path: path.read_bytes() for path in first.rglob("*") if path.is_file()}
    faster = replace(PLAIN, dataset=FoundDatasetConfig(fps=30))
    assert opened(faster)[0].name == "reach-2"
    (tmp_path / "outputs" / "cockpit" / "reach-3").mkdir()
    (tmp_path / "outputs" / "cockpit" / "reach-3" / "notes.txt").write_text("mine")
    assert opened(replace(PLAIN, robot="ridgeback_panda"))[0].name == "reach-4"
    assert opened(faster)[0].name == "reach-2"
    assert {path: path.read_bytes() for path in first.rglob("*") if path.is_file()} == before


def test_no_episode_is_recorded_again_after_an_edit(tmp_path):
    """At once, in two goes, or by a worker: an edit gives episodes other numbers, and seeds follow."""
    flags = ("--task", "reach", "--time_limit", "0.2", "--no_physics", "--dataset.num_episodes")
    root, once, part = tmp_path / "d", tmp_path / "at_once", tmp_path / "shards" / "part"
    ran(root, *flags, 7)
    ran(root, "--episodes", "1,3,4", "--in_place", name="delete")
    shutil.copytree(root, once)
    before = [row["seed"] for row in read_episodes(root)]
    config = RecordConfig(
        task="reach", time_limit=0.2, physics=False, dataset=DatasetConfig(root=str(root), num_episodes=6)
    )
    with pytest.raises(HandrailError, match="expected the folder of the command, which all computers have"):
        record_shard(config, part, 4, 6)
    part.parent.mkdir()
    (part.parent / "plan.json").touch()
    record_shard(config, part, 4, 6)
    ran(once, *flags, 6, "--resume")
    for episodes in (2, 4):
        ran(root, *flags, episodes, "--resume")
    seeds, alone, shared = ([row["seed"] for row in read_episodes(each)] for each in (root, once, part))
    assert seeds == alone == before + shared
    assert len(set(seeds)) == 10


def test_a_folder_that_is_said_goes_on_and_is_never_another(tmp_path):
    said = replace(PLAIN, dataset=FoundDatasetConfig(place=str(tmp_path / "mine")))
    for resume in (False, True):
        root, config = opened(said)
        assert root == tmp_path / "mine"
        assert config.resume is resume
    with pytest.raises(HandrailError, match="fps"):
        opened(replace(said, dataset=replace(said.dataset, fps=30)))
    with pytest.raises(HandrailError, match="exists already"):  # `handrail-record` is asked to
        opened(RecordConfig(task="reach", physics=False, dataset=DatasetConfig(place=str(root))))


@pytest.mark.parametrize("place", ["", "mine"])
def test_a_session_adds_in_the_same_words_and_without_episodes_leaves_nothing(tmp_path, place, capsys):
    config = replace(PLAIN, operator="scripted", dataset=FoundDatasetConfig(place=place, num_episodes=1))
    root = tmp_path / (place or "outputs/cockpit/reach")
    with session_writer(located(config, ENV), ENV) as writer:
        assert writer.root == root
    assert not list(tmp_path.iterdir())
    assert record(config) == record(config) == 0
    assert f"Adds to {root}; episodes there: 1\n" in capsys.readouterr().err
    before = sorted(root.rglob("*"))
    with session_writer(located(config, ENV), ENV) as writer:
        assert writer.num_episodes == 2
    assert sorted(root.rglob("*")) == before


def test_files_beside_a_dataset_without_episodes_stay(tmp_path):
    config = replace(PLAIN, dataset=FoundDatasetConfig(place="mine"))
    (tmp_path / "mine").mkdir()
    with session_writer(located(config, ENV), ENV) as writer:
        (writer.root / "notes.txt").write_text("mine")
    assert list(tmp_path.rglob("*")) == [tmp_path / "mine", tmp_path / "mine" / "notes.txt"]


def test_a_demo_removes_no_more_episodes_than_a_demo_has(tmp_path):
    root = copied(tmp_path / "dataset", make_dataset, episodes=2)
    refused(tmp_path, "--overwrite", "--episodes", 1, name="demo", told="has 2 episodes, not 1")
    assert len(read_episodes(root)) == 2


def test_where_nothing_can_be_written_it_says_so(tmp_path):
    (tmp_path / "outputs").write_text("a file")
    with pytest.raises(HandrailError, match="is a file"):
        opened()


def test_a_robot_s_file_has_a_name_of_its_own(tmp_path):
    """A policy knows its robot by that name."""
    own, mine = ROBOTS.find("ridgeback_ur10").file, tmp_path / "mine.toml"
    shutil.copy(own, mine)
    flags = ("--task", "reach", "--time_limit", "0.2", "--no_physics", "--dataset.num_episodes", 1)
    refused(tmp_path / "set", *flags, "--robot", mine, told="expected a name of its own, got")
    assert not (tmp_path / "set").exists()
    ran(tmp_path / "set", *flags, "--robot", own)
    mine = tmp_path / "other.toml"
    mine.write_text(own.read_text().replace('\nname = "ridgeback_ur10"', '\nname = "mine"'))
    ran(tmp_path / "other", *flags, "--robot", mine)
