"""A stretch of a video shows exactly its pictures, whoever encoded the whole, copied or encoded anew."""

from contextlib import closing
from fractions import Fraction
from types import SimpleNamespace

import av
import numpy as np
import pytest
import torch

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.join import Stretch, VideoJoin, Videos
from handrail.datasets.format.schema import Feature
from handrail.datasets.format.video import VideoEncoder, count_frames, encode_stretch

COUNT, FPS = 24, 20
CAMERA = Feature("video", (32, 48, 3))
OTHERS = {"one group": {"g": "100", "bf": "0"}, "pictures between": {"g": "8", "bf": "2"}}


def level(index: int) -> int:
    return 20 + 9 * index


def pictures():
    return [np.full((32, 48, 3), level(index), np.uint8) for index in range(COUNT)]


@pytest.fixture(scope="module", params=["ours", *OTHERS])
def video(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("video") / "whole.mp4"
    if request.param == "ours":
        encoder = VideoEncoder(path, FPS, CAMERA)
        for picture in pictures():
            encoder.add(picture)
        encoder.finish(COUNT)
        return path
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=FPS, options=OTHERS[request.param] | {"crf": "18"})
        stream.height, stream.width, stream.pix_fmt = 32, 48, "yuv420p"
        stream.time_base = Fraction(1, FPS)
        for index, picture in enumerate(pictures()):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = index, Fraction(1, FPS)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


def cut(source, first, count, target):
    """Write a stretch as a volume does: its packets if they can be copied, else encoded anew."""
    with closing(Videos(FPS)) as opened:
        stretch = opened.stretch(source, first, count, "")
        if stretch is None:
            encode_stretch(source, first, count, target, FPS, CAMERA)
            return
        join = VideoJoin(target, FPS)
        join.add(stretch)
        join.close()


def shown(path) -> list[tuple[float, float]]:
    """Return time [s] and brightness of every picture."""
    found: list[tuple[float, float]] = []
    with av.open(str(path)) as container:
        found.extend(
            (float(frame.time or 0.0), float(frame.to_ndarray(format="rgb24").mean()))
            for frame in container.decode(video=0)
        )
    return found


@pytest.mark.parametrize(("first", "count"), [(0, 24), (0, 7), (4, 9), (5, 8), (8, 8), (16, 8), (23, 1)])
def test_a_stretch_shows_its_pictures(video, tmp_path, first, count):
    cut(video, first, count, tmp_path / "cut.mp4")
    assert count_frames(tmp_path / "cut.mp4") == count
    times, levels = np.array(shown(tmp_path / "cut.mp4")).T
    assert times == pytest.approx(np.arange(count) / FPS, abs=1e-3)
    assert levels == pytest.approx([level(first + index) for index in range(count)], abs=2.5)


def test_more_than_there_is_cannot_be_cut(video, tmp_path):
    for first, count in ((20, 9), (40, 2)):
        with pytest.raises(
            HandrailError, match=f"expected the pictures {first} to {first + count - 1}, got fewer"
        ):
            cut(video, first, count, tmp_path / "cut.mp4")


def test_a_file_that_is_no_video_is_one_line(tmp_path):
    (tmp_path / "text.mp4").write_text("no video")
    with pytest.raises(HandrailError, match="expected a whole mp4"):
        cut(tmp_path / "text.mp4", 0, 1, tmp_path / "cut.mp4")


class CountingJoin(VideoJoin):
    """Counts pictures without any."""

    def add(self, stretch):
        self._pictures += stretch.count


@pytest.mark.parametrize(("count", "episodes", "groups"), [(9000, 4, [3, 1]), (300, 300, [300])])
def test_lerobot_finds_each_picture_of_a_long_video(tmp_path, count, episodes, groups):
    """At 30 Hz, by LeRobot's arithmetic: times are rounded to float32, and may be 0.1 ms off."""
    stretch, fps, found = Stretch([], SimpleNamespace(), 0, count), 30, [0]
    join = CountingJoin(tmp_path / "none.mp4", fps)
    for _ in range(episodes):
        if not join.fits(stretch):
            found.append(0)
            join = CountingJoin(tmp_path / "none.mp4", fps)
        first = found[-1] * count
        stored = torch.tensor([index / fps for index in range(count)], dtype=torch.float32)
        asked = torch.tensor([first / fps + each for each in stored.tolist()])
        shown = torch.tensor([(first + index) / fps for index in range(count)])
        assert ((asked - shown).abs() < 1e-4).all()
        join.add(stretch)
        found[-1] += 1
    assert found == groups
