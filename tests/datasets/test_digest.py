"""A digest of a recording covers its pictures, and does not depend on how the files lie."""

from datasets_helpers import CAMERAS, create, frame_of

from handrail.datasets.reading.digest import digest_of_dataset

ROWS = 16  # letters of the digest of the rows


def test_one_other_picture_is_another_recording(tmp_path):
    """Every value in the rows is the same."""
    digests = []
    for name, brighter in (("one", 0), ("again", 0), ("other", 9)):
        with create(tmp_path / name, cameras=True) as writer:
            for index in range(12):
                frame = frame_of(0, index, cameras=True)
                frame[CAMERAS[-1]] += brighter if index == 7 else 0
                writer.add_frame({key: frame[key] for key in writer.features}, "reach")
            writer.save_episode({"success": True, "failure_reason": None, "seed": 0})
        digests.append(digest_of_dataset(tmp_path / name))
    one, again, other = digests
    assert one == again
    assert one[:ROWS] == other[:ROWS]
    assert one[ROWS:] != other[ROWS:]
