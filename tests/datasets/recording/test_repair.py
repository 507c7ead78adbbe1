"""Repair loses no saved episode: it names what is damaged, puts back what is whole, mends the rest."""

import json
import os
import shutil

import numpy as np
import pytest
from command_helpers import command
from datasets_helpers import (
    CAMERAS,
    FPS,
    check_is,
    create,
    files_of,
    frame_of,
    length_of,
    open_with_lerobot,
    record,
    record_one,
    resume,
    tree,
)

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.recording.repair import MOVED, REBUILT, REMOVED, repair


def _flip_a_byte(path, place=1 / 3):
    content = bytearray(path.read_bytes())
    content[int(len(content) * place)] ^= 0xFF
    path.write_bytes(content)


def test_a_whole_dataset_is_left_alone(root):
    before = tree(root)
    report = repair(root)
    assert report.clean
    assert report.complete
    assert report.episodes == 4
    assert str(report).endswith("nothing to repair")
    assert tree(root) == before


@pytest.mark.parametrize("name", ["info", "stats", "tasks"])
@pytest.mark.parametrize(
    "content", [None, b"", b'{"total_episodes": 4, "feat', b"[1]", b'{"a": {"max": [NaN]}}']
)
def test_summary_files_are_rebuilt_to_the_byte(root, name, content):
    before, path = tree(root), getattr(Layout(root), name)
    path.unlink()
    if content is not None:
        path.write_bytes(content)
    report = repair(root)
    assert report.done[REBUILT] == (path.relative_to(root).as_posix(),)
    assert not report.done[MOVED]
    assert tree(root) == before
    assert repair(root).clean


@pytest.mark.parametrize("stream", range(4), ids=["data", "line", "wrist", "scene"])
@pytest.mark.parametrize("harm", ["cut", "empty", "gone", "flipped"])
def test_a_damaged_episode_is_named_and_costs_no_other(root, stream, harm):
    path = files_of(root, 1, cameras=True)[stream]
    if harm == "gone":
        path.unlink()
    elif harm == "flipped":
        _flip_a_byte(path)
    else:
        os.truncate(path, path.stat().st_size // 2 if harm == "cut" else 0)
    before = tree(root)
    checked = command("--dataset.root", root, "--check", name="inspect")
    if stream == 1 and harm == "flipped" and checked.returncode == 0:
        return  # the byte was one that nothing depends on
    assert checked.returncode == 1
    assert path.relative_to(root).as_posix() in checked.stdout
    if stream > 1 and "of like content" in checked.stdout:
        return  # it decodes to what was saved: noticed, and no damage
    with pytest.raises(HandrailError, match=r"\A[^\n]*episode 1[^\n]*handrail-edit repair[^\n]*\Z"):
        resume(root, cameras=True)
    assert tree(root) == before
    done = command(root, name="edit repair")
    assert (done.returncode, done.stdout.count("\n")) == (1, 1)
    assert path.relative_to(root).as_posix() in done.stdout
    assert tree(root) == before  # nothing that was saved is moved without being asked
    done = command(root, "--set_aside", name="edit repair")
    assert (done.returncode, done.stdout.count("\n")) == (1, 1)
    check_is(root, [0, 2, 3])
    assert not path.exists() or path.read_bytes() != before.get(path.relative_to(root).as_posix())
    assert repair(root).clean
    with resume(root, cameras=True) as writer:
        assert record_one(writer, cameras=True) == 3
    dataset = open_with_lerobot(root)
    assert dataset.num_episodes == 4
    assert dataset.meta.stats["index"]["count"].tolist() == [len(dataset)]


def test_pictures_move_up_with_their_episode(root):
    os.truncate(Layout(root).data(0), 10)
    repair(root, set_aside_damaged=True)
    dataset = open_with_lerobot(root)
    moved = {key: dataset[length_of(1) + 2][key].mean().item() * 255 for key in CAMERAS}
    for place, key in enumerate(CAMERAS):
        assert moved[key] == pytest.approx(frame_of(2, 2, cameras=True)[CAMERAS[place]].mean(), abs=2.5)


def test_leftovers_of_a_save_that_was_never_committed_are_removed(root):
    layout, donor = Layout(root), files_of(root, 3, cameras=True)
    shutil.copy(donor[0], layout.data(4))
    shutil.copy(donor[2], layout.video(CAMERAS[0], 4))
    layout.staging.mkdir()
    (layout.staging / "data.parquet").write_bytes(b"PAR1 and no footer")
    report = repair(root)
    assert report.episodes == 4
    assert sorted(report.done[REMOVED]) == sorted(
        [
            ".handrail/data.parquet",
            layout.relative(layout.data(4)),
            layout.relative(layout.video(CAMERAS[0], 4)),
        ]
    )
    assert not report.done[MOVED]
    assert not report.damage
    assert not layout.data(4).exists()


def test_a_dataset_copied_in_part_is_named_as_such(root):
    layout = Layout(root)
    for path in files_of(root, 3, cameras=True):
        path.unlink()
    with pytest.raises(HandrailError, match=r"copied in part.*episode 3: .* is missing"):
        resume(root, cameras=True)
    layout.video(CAMERAS[0], 2).unlink()
    with pytest.raises(HandrailError, match=r"copied in part: 2 of 4 episodes"):
        resume(root, cameras=True)
    assert repair(root).episodes == 4
    assert repair(root, set_aside_damaged=True).episodes == 2
    check_is(root, [0, 1])


@pytest.mark.parametrize("of", ["data", "row"])
@pytest.mark.parametrize("name", ["chunk-000/copy of file-000", "chunk-0000/file-000", "chunk-00٠/file-000"])
def test_a_stray_file_that_lerobot_would_read_is_set_aside(root, of, name):
    """The file of an episode has one name: another that means the same number is none of its files."""
    path = getattr(Layout(root), of)(0)
    stray = path.parents[1] / f"{name}.parquet"
    stray.parent.mkdir(exist_ok=True)
    shutil.copy(path, stray)
    report = repair(root)
    assert report.episodes == 4
    assert report.done[MOVED] == (stray.relative_to(root).as_posix(),)
    assert repair(root).clean
    assert open_with_lerobot(root).num_episodes == 4


def test_a_dataset_with_no_episode(tmp_path):
    create(tmp_path / "set").close()
    assert repair(tmp_path / "set").clean
    Layout(tmp_path / "set").info.unlink()
    assert repair(tmp_path / "set").done[REBUILT] == ("meta/info.json",)
    assert json.loads(Layout(tmp_path / "set").info.read_bytes())["total_episodes"] == 0


def test_chunks_roll_over(tmp_path, monkeypatch):
    from handrail.datasets.format import layout

    monkeypatch.setattr(layout, "FILES_IN_A_CHUNK", 3)
    root = record(tmp_path / "set", 5)
    with resume(root) as writer:
        for _ in range(3):
            record_one(writer, cameras=False)
    assert sorted(path.name for path in (root / "data").iterdir()) == ["chunk-000", "chunk-001", "chunk-002"]
    assert repair(root).clean
    dataset = open_with_lerobot(root)
    assert dataset.num_episodes == 8
    assert dataset[len(dataset) - 1]["timestamp"].item() == pytest.approx((length_of(7) - 1) / FPS)
    last = frame_of(7, length_of(7) - 1, cameras=False)["action"]
    assert np.array_equal(dataset[len(dataset) - 1]["action"].numpy(), last)
    os.truncate(Layout(root).data(1), 10)
    repair(root, set_aside_damaged=True)
    check_is(root, [0, *range(2, 8)])


@pytest.mark.parametrize("asked", [False, True])
def test_lost_lines_of_metadata_never_cost_data(root, asked):
    """If the lines of saved episodes vanish, their files are no leftovers of a crash."""
    before = {content for path, content in tree(root).items() if path.startswith(("data", "videos"))}
    shutil.rmtree(root / "meta" / "episodes")
    Layout(root).info.unlink()
    report = repair(root, asked)
    assert report.episodes == (0 if asked else 4)
    faults = report.damage or report.lost
    assert faults
    assert all("is missing" in fault for fault in faults)
    assert before <= set(tree(root / ".damaged" if asked else root).values())
    assert not report.done[REMOVED]


def test_a_dataset_of_which_only_the_count_is_left_may_begin_anew(root):
    for name in ("data", "videos", "meta/episodes"):
        shutil.rmtree(root / name)
    assert len(repair(root).damage) == 4
    assert repair(root, set_aside_damaged=True).episodes == 0
    assert repair(root).clean


@pytest.mark.parametrize("episodes", [1, 3])
@pytest.mark.parametrize("info", [None, "{"])
def test_the_last_line_and_the_count_gone_cost_no_data(tmp_path, episodes, info):
    """A crash leaves `info.json` whole: without it, the files of the last episode are no leftovers."""
    root = record(tmp_path / "set", episodes)
    layout, rows = Layout(root), Layout(root).data(episodes - 1).read_bytes()
    layout.row(episodes - 1).unlink()
    layout.info.unlink() if info is None else layout.info.write_text(info)
    with pytest.raises(HandrailError, match=f"episode {episodes - 1}: meta/.* is missing"):
        resume(root)
    assert not repair(root).done[REMOVED]
    assert layout.data(episodes - 1).read_bytes() == rows
