"""`handrail-replay --video`: the whole episode, or one line."""

from pathlib import Path

import av
import numpy as np
import pytest
from canned import canned, record_by_command
from command_helpers import command, refused

from handrail.datasets.reading.reader import read_episodes, read_info


@pytest.fixture(scope="module")
def recorded():
    return canned(record_by_command, "--task reach --dataset.num_episodes 1 --time_limit 1")


@pytest.mark.needs_gl
def test_a_replay_is_filmed_from_beginning_to_end(recorded, tmp_path, monkeypatch):
    """Also into a file whose name FFmpeg would read as the address of something."""
    monkeypatch.chdir(tmp_path)
    film = Path("17:28.mp4")
    done = command(recorded, "--episode", 0, "--video", film, name="replay")
    assert (done.returncode, done.stdout.count(str(film))) == (0, 1), done.stderr
    with av.open(str(film.absolute())) as container:
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
        assert container.streams.video[0].average_rate == read_info(recorded).fps
    assert len(pictures) == read_episodes(recorded)[0]["length"]
    assert np.any(pictures[0] != pictures[-1])


@pytest.mark.needs_gl
@pytest.mark.parametrize(
    "words",
    [
        "--video folder --episode 0",
        "--video a.mp4",
        "--video a.gif --episode 0",
        "--video no/a.mp4 --episode 0",
    ],
)
def test_a_film_that_cannot_be_written_is_one_line(words, recorded, tmp_path, monkeypatch):
    """And nothing lies about afterwards."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    refused(recorded, *words.split(), name="replay", told=words.split()[0])
    assert len(list(tmp_path.rglob("*"))) == 1
