"""Killed at any moment, a recording loses at most the open episode, and nothing it had reported as saved."""

import gc
import itertools
import json
import os
import random
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from datasets_guillotine import Guillotine, tear_staged_files
from datasets_helpers import (
    TINY_FEATURES,
    check_is,
    check_pictures,
    create,
    digest,
    length_of,
    open_with_lerobot,
    record,
    record_one,
    resume,
    tree,
)
from killed_child import killed, run_command
from places import HELPERS

from handrail.datasets.format.layout import Layout
from handrail.datasets.recording.repair import MOVED, repair
from handrail.datasets.storage.lock import LOCK_NAME

GUILLOTINE = Guillotine()


@pytest.fixture
def quick_collector():
    """Collect garbage of this test alone: it need not walk through torch after each kill."""
    gc.freeze()  # collecting after each kill need not walk through torch
    yield
    gc.unfreeze()


def _session(root: Path, saved: dict[int, str]) -> None:
    """Record two episodes, close, resume, discard one, record two more (with another task)."""
    with create(root, features=TINY_FEATURES) as writer:
        for _ in range(2):
            episode = record_one(writer, cameras=False)
            saved[episode] = digest(root, episode, cameras=False)
    with resume(root, features=TINY_FEATURES) as writer:
        writer.add_frame({"action": [0.0, 0.0], "teleop.mode": "base"}, "forget me")
        writer.discard_episode()
        for _ in range(2):
            episode = record_one(writer, cameras=False)
            saved[episode] = digest(root, episode, cameras=False)


def _check_after_kill(root: Path, saved: dict[int, str]) -> None:
    """The law: all that was reported is there to the byte, repair settles, and recording goes on."""
    if not Layout(root).manifest.exists():
        assert not saved
        create(
            root, features=TINY_FEATURES
        ).close()  # a folder that never became a dataset is as good as an empty one
    report = repair(root)
    assert len(saved) <= report.episodes <= len(saved) + 1
    assert not report.done[MOVED]
    assert not report.damage
    for episode, expected in saved.items():
        assert digest(root, episode, cameras=False) == expected
    settled = tree(root)
    assert repair(root).clean
    assert tree(root) == settled
    with resume(root, features=TINY_FEATURES) as writer:
        assert record_one(writer, cameras=False) == report.episodes
    check_is(root, range(report.episodes + 1))
    assert not (root / ".handrail").exists()
    assert not any(LOCK_NAME in path for path in tree(root))


@pytest.mark.parametrize(
    ("every", "torn"), [(3, 0), *(pytest.param(1, torn, marks=pytest.mark.slow) for torn in (0, 1))]
)
def test_killed_at_every_change_to_the_disk(every, torn, tmp_path, quick_collector):
    """At every second one, files that were being written are cut in half."""
    for k in itertools.count(1, every):
        root, saved = tmp_path / str(k), {}
        lived = GUILLOTINE.run(root, k, lambda root=root, saved=saved: _session(root, saved))
        if k % 2 == torn:
            tear_staged_files(root)
        _check_after_kill(root, saved)
        if lived:
            break
    assert len(saved) == 4
    assert k > 60  # the hook really saw the changes


def test_overwriting_killed_at_every_change(tmp_path, quick_collector):
    """Cut short, it leaves the old dataset whole, or an empty one; either may be overwritten or resumed."""
    lived, k = False, 0
    while not lived:
        k += 1
        root = record(tmp_path / str(k), 2, features=TINY_FEATURES)
        lived = GUILLOTINE.run(
            root, k, lambda root=root: create(root, features=TINY_FEATURES, overwrite=True).close()
        )
        episodes = repair(root).episodes
        assert episodes in (0, 2)
        with resume(root, features=TINY_FEATURES) as writer:
            assert record_one(writer, cameras=False) == episodes
        check_is(root, range(episodes + 1))
        create(root, features=TINY_FEATURES, overwrite=True).close()
    assert k > 10


@pytest.mark.parametrize(
    ("torn", "every"),
    [(False, 3), *(pytest.param(each, 1, marks=pytest.mark.slow) for each in (False, True))],
)
def test_repair_killed_at_every_change(tmp_path, quick_collector, torn, every):
    """However far a repair came, another one ends as if it had not been killed."""
    original = record(tmp_path / "original", 4, features=TINY_FEATURES)
    os.truncate(Layout(original).data(1), 100)
    if torn:
        Layout(original).info.write_bytes(b"{torn")
    for k in itertools.count(1, every):
        root = shutil.copytree(original, tmp_path / str(k) / "set")
        lived = GUILLOTINE.run(root.parent, k, lambda root=root: repair(root, set_aside_damaged=True))
        if k % 2:
            tear_staged_files(root)
        repair(root)
        assert repair(root, set_aside_damaged=True).episodes == 3
        assert repair(root).clean
        check_is(root, [0, 2, 3])
        assert Path(root / ".damaged").exists()
        with resume(root, features=TINY_FEATURES) as writer:
            assert record_one(writer, cameras=False) == 3
        assert list(root.parent.iterdir()) == [root]
        if lived:
            break
    assert k > 30


@pytest.mark.slow
def test_compare_killed_10_times(tmp_path):
    """Each file of a report is the old one or the new one, whole; the datasets are as they were."""
    from compare_helpers import quick_and_slow

    roots = list(map(Path, quick_and_slow(tmp_path)))
    before = [tree(root) for root in roots]
    output = tmp_path / "report"
    words = (run_command, "compare", *roots, "--output", output, "--no_pictures", "--seed")
    assert not killed(output, 0, *words, 0)
    old = tree(output)
    for number in range(10):
        shutil.rmtree(output)
        output.mkdir()
        for name, content in old.items():
            (output / name).write_bytes(content)
        assert killed(output, 1 + number % (2 * len(old)), *words, number)
        assert set(old) <= set(tree(output))
        assert all(_is_whole(output / name) for name in old)
        assert [tree(root) for root in roots] == before
    assert not killed(output, 0, *words, 0)
    assert tree(output) == old  # what a killed one left behind is gone


def _is_whole(path: Path) -> bool:
    content = path.read_text()
    if path.suffix == ".json":
        return bool(json.loads(content))
    return content.endswith("</html>\n" if path.suffix == ".html" else "\n") and len(content) > 1000


@pytest.mark.parametrize("kills", [2, pytest.param(30, marks=pytest.mark.slow)])
def test_sigkill(kills, tmp_path):
    """A recorder is killed again and again."""
    root, reported, moments = tmp_path / "set", {}, random.Random(kills)
    for _ in range(kills):
        command = [sys.executable, str(HELPERS / "datasets_recorder.py"), str(root)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout is not None
            assert child.stdout.readline() == "ready\n"
            lines = [child.stdout.readline() for _ in range(moments.randrange(4))]  # however slow it is
            time.sleep(moments.uniform(0.0, 0.3))
            child.kill()
            lines += [line for line in child.stdout.read().splitlines(keepends=True) if line.endswith("\n")]
        reported |= {int(line.split()[0]): line.split()[1] for line in lines}
        _check_survivors(root, reported)
    assert len(reported) > 2 * kills - 2


def _check_survivors(root: Path, reported: dict[int, str]) -> None:
    """Check the law with cameras."""
    for episode, expected in reported.items():
        assert digest(root, episode, cameras=True) == expected
    report = repair(root)
    assert len(reported) <= report.episodes <= len(reported) + 1
    assert not report.done[MOVED]
    with resume(root, cameras=True) as writer:
        record_one(writer, cameras=True)
        reported |= {episode: digest(root, episode, cameras=True) for episode in range(writer.num_episodes)}
    dataset = open_with_lerobot(root)
    assert dataset.num_episodes == len(reported)
    assert len(dataset) == sum(map(length_of, reported))
    check_pictures(
        dataset, [0, len(dataset) // 2, len(dataset) - length_of(len(reported) - 1), len(dataset) - 1]
    )
