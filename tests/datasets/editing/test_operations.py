"""Every way to edit a dataset, ours and LeRobot's, and then every use: it works, or one line says why not."""

import logging
import re
import sys
import warnings
from pathlib import Path
from unittest import mock

import pytest
from command_helpers import command, ran
from places import ROOT

from handrail.datasets.presentation.markdown import markdown_table, with_part
from handrail.datasets.presentation.table import Table
from handrail.datasets.reading.reader import read_episodes

PAGE = ROOT / "docs" / "editing.md"
RECORD = ("--task", "reach", "--cameras", "wrist", "--image_size", "32", "--dataset.repo_id", "me/set")
USES = ("inspect", "replay", "train", "compare", "resume")

OURS = {
    "delete": "delete SET --episodes 1 --output NEW",
    "keep": "keep SET --episodes 0,2 --output NEW",
    "split": "split SET --parts part=0.7 --output NEW",
    "trim": "trim SET --output NEW",
    "relabel": "relabel SET --episodes 0 --label failure --output NEW",
    "rename": "rename SET --task touch --output NEW",
    "render": "render SET --cameras wrist --image_size 32 --workers 1 --output NEW",
}
PACKED = {"pack": "SET --output NEW", "merge": "SET MORE --output NEW"}
LEROBOTS = {
    "delete_episodes": "--root SET --new_repo_id me/new --new_root NEW --operation.episode_indices [1]",
    "split": '--root SET --new_root NEW --operation.splits {"part":[0,1],"rest":[2]}',
    "merge": "--new_repo_id me/new --new_root NEW --operation.repo_ids ['me/set','me/set']"
    " --operation.roots ['SET','MORE']",
    "remove_feature": "--root SET --new_repo_id me/new --new_root NEW"
    " --operation.feature_names ['teleop.raw']",
    "modify_tasks": "--root NEW --operation.new_task touch",
    "recompute_stats": "--root NEW --new_repo_id me/set --new_root NEW --operation.overwrite true",
    "reencode_videos": "--root NEW --new_repo_id me/set --new_root NEW --operation.overwrite true"
    " --operation.rgb_encoder.vcodec h264 --operation.rgb_encoder.crf 30",
}
IN_PLACE = ("modify_tasks", "recompute_stats", "reencode_videos")
NOT_OURS = "was not written by Handrail"
NO_SEED = "expected one that handrail-record made, found no seed"
FOREIGN = "was written by another tool"
WORDS = {
    None: "works",
    NOT_OURS: "no: `meta/handrail.json` is gone",
    NO_SEED: "no: the seeds are gone",
    FOREIGN: "no: LeRobot has rewritten `meta/episodes`",
}
REFUSED = {
    **{("lerobot's", each, "resume"): NOT_OURS for each in LEROBOTS if each not in IN_PLACE},
    **{("lerobot's", each, "replay"): NO_SEED for each in ("delete_episodes", "split")},
    ("lerobot's", "modify_tasks", "resume"): FOREIGN,
}


@pytest.fixture(scope="module")
def sets(tmp_path_factory):
    """Two recordings, with one camera."""
    folder = tmp_path_factory.mktemp("recorded")
    for name, count, seed in (("SET", 3, 0), ("MORE", 1, 9)):
        words = ("--dataset.num_episodes", count, "--seed", seed)
        ran(folder / name, *RECORD, *words)
    return {name: folder / name for name in ("SET", "MORE")}


def edited(sets: dict[str, Path], whose: str, operation: str, new: Path) -> Path:
    """Return the dataset that an operation makes."""
    line = {"ours": OURS, "packed": PACKED, "lerobot's": LEROBOTS}[whose][operation]
    for name, place in {**sets, "NEW": new}.items():
        line = line.replace(name, str(place))
    if whose != "lerobot's":
        ran(*line.split(), name="edit" if whose == "ours" else operation)
    else:
        if operation in IN_PLACE:
            copied = command("keep", sets["SET"], "--episodes", "0-2", "--output", new, name="edit")
            assert copied.returncode == 0, copied.stderr
        repo = () if operation == "merge" else ("--repo_id", "me/set")
        lerobot_edit_dataset(*repo, "--operation.type", operation, *line.split())
    return new / "part" if operation == "split" else new


def lerobot_edit_dataset(*words: str) -> None:
    """Run LeRobot's command, unmodified, as its entry point does but without a new interpreter."""
    logger, level = logging.getLogger(), logging.getLogger().level
    handlers = list(logger.handlers)
    with warnings.catch_warnings(), mock.patch.object(sys, "argv", ["lerobot-edit-dataset", *words]):
        warnings.simplefilter("ignore")
        from lerobot.scripts.lerobot_edit_dataset import main

        try:
            main()
        finally:
            logger.handlers[:] = handlers
            logger.setLevel(level)


def used(use: str, root: Path, original: Path, output: Path):
    """Use a dataset and return how that went."""
    if use == "train":
        words = ("--output", output, "--steps", 4, "--batch_size", 4, "--device", "cpu")
        return command(root, *words, name="train")
    if use == "compare":
        return command(original, root, "--labels", "before,after", "--output", output, name="compare")
    if use == "resume":
        words = ("--dataset.num_episodes", 1, "--seed", 20, "--time_limit", 1, "--resume")
        return command(root, *RECORD, *words)
    return command(root, name=use)


def table() -> str:
    """Return what works after which operation, as the page shows it."""
    tools = (
        ("packed", "handrail-edit {}", PACKED),
        ("ours", "handrail-edit {}", OURS),
        ("lerobot's", "lerobot-edit-dataset {}", LEROBOTS),
    )
    rows = [
        [f"`{tool.format(each)}`", *(WORDS[REFUSED.get((whose, each, use))] for use in USES)]
        for whose, tool, operations in tools
        for each in operations
    ]
    return markdown_table(Table(("after", *USES), rows)).replace("\\`", "`")  # of ours, they are code


def test_the_page_says_what_is_tested():
    text = PAGE.read_text()
    assert with_part(text, "operations", table()) == text


@pytest.mark.slow
@pytest.mark.needs_gl
@pytest.mark.parametrize(
    ("whose", "operation"),
    [
        *(("packed", each) for each in PACKED),
        *(("ours", each) for each in OURS),
        *(("lerobot's", each) for each in LEROBOTS),
    ],
)
def test_every_use_works_or_says_why_not(sets, tmp_path, whose, operation):
    root, found = edited(sets, whose, operation, tmp_path / "new"), {}
    for use in USES:
        done, said = used(use, root, sets["SET"], tmp_path / use), REFUSED.get((whose, operation, use))
        if said is None:
            found[use] = done.stderr if done.returncode else ""
        else:
            told = done.returncode == 2 and done.stderr.count("\n") == 1 and re.search(said, done.stderr)
            found[use] = "" if told else f"{done.returncode}: {done.stderr}"
    assert found == dict.fromkeys(USES, "")


@pytest.mark.slow
@pytest.mark.needs_gl
def test_a_trimmed_episode_replays_as_it_was(sets, tmp_path):
    """Also though its beginning is gone: the robot stands still for as long."""
    from handrail.collect.commands.replay import replay_episode

    root = edited(sets, "ours", "trim", tmp_path / "new")
    rows = read_episodes(root)
    assert all(row["trimmed_start"] for row in rows)
    for number, row in enumerate(rows):
        replay, _ = replay_episode(root, number)
        assert replay.success == row["success"]
        assert replay.tool_at_end < 0.005
