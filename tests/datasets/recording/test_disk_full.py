"""A full disk or a failing encoder costs the open episode and nothing else."""

import contextlib
import os
import resource

import pytest
from datasets_helpers import (
    check_pictures,
    create,
    digest,
    frame_of,
    open_with_lerobot,
    record_one,
    tree,
)

from handrail.controllers.errors import HandrailError
from handrail.datasets.format import video
from handrail.datasets.recording.repair import repair


@contextlib.contextmanager
def _largest_file(size: int):
    """Let no file grow beyond a size [byte]; the kernel then fails writes as on a full disk."""
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, old[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)


def _check_recovers(writer, root, cameras):
    """After a failed save: the saved episode is whole, nothing else is there, the next one can be saved."""
    before = digest(root, 0, cameras)
    assert [path for path in tree(root) if path.startswith(".handrail")] == [".handrail/lock"]
    assert writer.num_episodes == 1
    assert record_one(writer, cameras) == 1
    writer.close()
    assert digest(root, 0, cameras) == before
    assert repair(root).clean
    dataset = open_with_lerobot(root)
    assert dataset.num_episodes == 2
    if cameras:
        check_pictures(dataset, range(len(dataset)))


@pytest.mark.parametrize("cameras", [False, True])
def test_files_that_cannot_grow(tmp_path, cameras):
    root = tmp_path / "set"
    with create(root, cameras) as writer:
        record_one(writer, cameras)
        content = tree(root)
        for index in range(20):
            writer.add_frame(frame_of(1, index, cameras), "too much")
        with _largest_file(500), pytest.raises(HandrailError, match=r"episode 1 .*could not be saved"):
            writer.save_episode()
        assert tree(root) == content
        _check_recovers(writer, root, cameras)


def _failure_of(action) -> str | None:
    try:
        action()
    except HandrailError as error:
        return str(error)
    return None


def test_every_moment_of_a_full_disk(tmp_path, monkeypatch):
    """Whichever write finds the disk full, the outcome is the same."""
    from handrail.datasets.recording import writer as module

    real, failures = module.write_synced, 0
    with create(tmp_path / "set") as writer:
        record_one(writer, cameras=False)
        content = tree(writer.root)
        for k in range(1, 20):
            calls = iter(range(k))

            def full(path, data, calls=calls):
                real(path, data[: len(data) // 2] if next(calls, None) is None else data)
                if next(calls, None) is None:
                    raise OSError(28, os.strerror(28))

            monkeypatch.setattr(module, "write_synced", full)
            writer.add_frame(frame_of(1, 0, cameras=False), "new task")
            message = _failure_of(writer.save_episode)
            if message is None:
                break
            failures += 1
            assert "No space left" in message
            assert tree(writer.root) == content
        monkeypatch.undo()
        assert failures >= 5
        assert writer.num_episodes == 2


@pytest.mark.parametrize("when", ["a picture", "the end"])
def test_a_failing_encoder(tmp_path, monkeypatch, when):
    root = tmp_path / "set"
    with create(root, cameras=True) as writer:
        record_one(writer, cameras=True)
        content = tree(root)
        with monkeypatch.context() as patch:
            if when == "a picture":
                patch.setattr(video, "image_levels", lambda image: 1 / 0)
            else:
                patch.setattr(video, "count_frames", lambda path: 3)
            for index in range(video.QUEUE_LENGTH * 2):  # a dead encoder must not block the recording
                writer.add_frame(frame_of(1, index, cameras=True), "encode me")
            with pytest.raises(HandrailError, match=r"encoder of observation\.images"):
                writer.save_episode()
        assert tree(root) == content
        _check_recovers(writer, root, cameras=True)


def test_a_slow_encoder_makes_the_recording_wait(tmp_path, monkeypatch):
    import time

    real = video.image_levels
    monkeypatch.setattr(video, "QUEUE_LENGTH", 2)
    monkeypatch.setattr(video, "image_levels", lambda image: (time.sleep(0.005), real(image))[1])
    with create(tmp_path / "set", cameras=True) as writer:
        record_one(writer, cameras=True)
    check_pictures(open_with_lerobot(tmp_path / "set"), range(8))
