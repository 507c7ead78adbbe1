"""Lost lines and counts of metadata never cost data."""

import shutil

import pytest
from datasets_helpers import record, resume, tree

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.recording.repair import REMOVED, repair


@pytest.mark.parametrize("asked", [False, True])
def test_lost_lines_of_metadata_never_cost_data(root, asked):
    """If the lines of saved episodes vanish, their files are no leftovers of a crash."""
    before = {content for path, content in tree(root).items() if path.startswith(("data", "videos"))}
    shutil.rmtree(root / "meta" / "episodes")
    Layout(root).info.unlink()
    report = repair(root, asked)
    assert report.episodes == (0 if asked else 4)
    assert all("is missing" in fault for fault in report.damage or report.lost)
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
