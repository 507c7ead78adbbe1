"""LeRobot's streaming expects one video a camera: a fresh recording says so, and packing makes it so."""

import warnings

import pytest
from datasets_helpers import CAMERAS, REPO, brightness, record

from handrail.datasets.editing.config import packing_advice
from handrail.datasets.editing.merge import merge_datasets

EPISODES = 3


def streamed(root, monkeypatch) -> list[tuple[int, int, list[float]]]:
    """Return episode, frame and brightness of what LeRobot streams, in order; PyAV decodes."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from lerobot.datasets import streaming_dataset
        from lerobot.datasets.video_utils import decode_video_frames

        def by_pyav(path, times, tolerance, decoder_cache=None, return_uint8=False):
            return decode_video_frames(path, times, tolerance, backend="pyav", return_uint8=return_uint8)

        monkeypatch.setattr(streaming_dataset, "decode_video_frames_torchcodec", by_pyav)
        items = streaming_dataset.StreamingLeRobotDataset(REPO, root=root, shuffle=False, buffer_size=1)
        return sorted(
            (
                int(item["episode_index"]),
                int(item["frame_index"]),
                [float(item[key].mean()) for key in CAMERAS],
            )
            for item in items
        )


def test_a_recording_says_to_pack_before_streaming_and_packed_it_streams_right(tmp_path, monkeypatch):
    root = record(tmp_path / "set", EPISODES, cameras=True)
    assert f"handrail-edit pack {root} before streaming" in packing_advice(root)
    assert "\n" not in packing_advice(root)
    with pytest.raises(Exception, match=r"tolerance|[Ii]nvalid frame|index"):
        streamed(root, monkeypatch)  # no longer: then LeRobot's issue 4524 is closed, and the advice may go
    merge_datasets([root], root)
    assert packing_advice(root) == ""
    found = streamed(root, monkeypatch)
    assert {episode for episode, *_ in found} == set(range(EPISODES))
    for episode, index, shades in found:
        for place, shade in enumerate(shades):
            assert abs(255 * shade - brightness(episode, index, place)) < 2.5


@pytest.mark.parametrize(("episodes", "cameras"), [(1, True), (EPISODES, False)])
def test_a_dataset_that_streams_right_is_not_to_be_packed(episodes, cameras, tmp_path):
    assert packing_advice(record(tmp_path / "set", episodes, cameras=cameras)) == ""
