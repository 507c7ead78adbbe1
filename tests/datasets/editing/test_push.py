"""What goes to the hub when asked: the dataset and its card; nothing else that lies there, nobody."""

import io
import re

import fsspec
import numpy as np
import pytest
import yaml
from canned import copied, record_by_command
from command_helpers import command, ran, refused
from datasets_helpers import CAMERAS
from editing_helpers import record_episodes
from fsspec.implementations.memory import MemoryFileSystem
from hub_helpers import push
from PIL import Image, ImageSequence

from handrail.collect.world.gl import missing_graphics
from handrail.datasets.format.layout import Layout
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.reader import read_episodes


def litter(root):
    """Leave what must not be sent where it could be taken for the dataset."""
    for name in (
        ".damaged/000/data/chunk-000/file-000.parquet",
        ".damaged/000/meta/episodes/chunk-000/file-000.parquet",
        ".handrail/data.parquet",
        "data/notes.txt",
        "meta/answers.json",
        "exports/answers.csv",
        "videos/face.mp4",
    ):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text("private")


def test_nothing_is_sent_unless_asked(root, hub):
    said = push(root).stdout
    assert (hub.sent, hub.repo) == ({}, {})
    assert "nothing was sent; --upload sends it" in said
    assert "me/reach (private, cc-by-4.0): 17 files" in said


def test_the_dataset_is_sent_and_nothing_else(root, hub):
    litter(root)
    said = push(root, "--upload").stdout
    names = set(hub.sent)
    layout = Layout(root)
    expected = {f"meta/{name}" for name in ("info.json", "stats.json", "tasks.parquet", "handrail.json")}
    for number in range(len(read_episodes(root))):
        videos = [layout.video(key, number) for key in CAMERAS]
        expected |= {layout.relative(path) for path in (layout.data(number), layout.row(number), *videos)}
    assert names == expected | {"README.md"}
    assert not [name for name, content in hub.sent.items() if content == b"private"]
    assert "these stay: .damaged, .handrail, exports" in said
    assert hub.repo["private"] is True
    assert hub.sent["README.md"] == (root / "README.md").read_bytes()


def test_the_card_says_what_was_recorded(root, hub):
    push(root, "--license", "cc0-1.0", "--no_private", "--upload")
    text = hub.sent["README.md"].decode()
    head = yaml.safe_load(text.split("---")[1])
    assert head["license"] == "cc0-1.0"
    assert {"LeRobot", "handrail"} <= set(head["tags"])
    assert hub.repo["private"] is False
    for told in (
        "- 3 episodes, 165 frames at 30 Hz",
        "- operator: ada (3)",
        "- mode: ee (3)",
        "- task: lift the cup (2), put it down (1)",
        "- success: 2 of 3 (67 %)",
        "- failures: timeout (1)",
    ):
        assert told in text
    shown = re.findall(r"^\| (.*?) \|", text, re.MULTILINE)
    assert (
        {"episode length", "smoothness (SPARC)"}
        <= set(shown)
        <= {m.title for m in METRICS} | {"metric", "---"}
    )


def test_a_card_is_renewed_but_not_somebody_else_s(root, hub):
    push(root)
    push(root)
    (root / "README.md").write_text("# Mine")
    assert "give it another name" in push(root, "--upload", code=2).stderr
    assert (root / "README.md").read_text() == "# Mine"
    assert not hub.sent


@pytest.mark.needs_gl
def test_the_card_of_a_dataset_without_pictures_opens_with_one(tmp_path, hub):
    """It is small, moves, is sent, and is none of those that an edit leaves behind."""
    root = copied(tmp_path / "set", record_by_command, "--task reach --seed 3 --dataset.num_episodes 1")
    push(root, "--upload")
    description = hub.sent["README.md"].decode().partition("<!-- written by handrail-edit push -->")[2]
    assert description.startswith("\n\n![An episode](meta/preview.webp)\n")
    picture = hub.sent["meta/preview.webp"]
    assert len(picture) < 500_000
    with Image.open(io.BytesIO(picture)) as film:
        assert (film.format, film.size) == ("WEBP", (320, 240))
        shown = [np.array(each.convert("RGB"), dtype=int) for each in ImageSequence.Iterator(film)]
    assert len(shown) > 20
    assert np.ptp(shown[0]) > 100
    assert (np.abs(shown[-1] - shown[0]).max(axis=2) > 60).sum() > 100  # it moves
    check_whole(root, verify=True)
    ran(root, "--episodes", "0", "--output", tmp_path / "kept", name="edit keep")
    assert (tmp_path / "kept" / "meta" / "info.json").is_file()
    assert not list(tmp_path.glob("kept/**/preview.webp"))


def test_without_opengl_the_card_has_no_picture_and_one_line_says_so(tmp_path, monkeypatch):
    root = copied(tmp_path / "set", record_by_command, "--task reach --seed 3 --dataset.num_episodes 1")

    def no_library(*_, **__):
        raise missing_graphics("no libEGL")

    monkeypatch.setattr("handrail.collect.world.env.Painter", no_library)
    said = push(root).stdout.splitlines()
    assert said[0].startswith("The card gets no picture: cameras need OpenGL, which is missing here")
    assert said[1].startswith(f"{root} as me/reach (private, cc-by-4.0): ")
    assert "preview" not in (root / "README.md").read_text()
    assert not (root / "meta/preview.webp").exists()


def test_the_pictures_of_a_dataset_that_has_some_are_enough(root):
    assert "no picture" not in push(root).stdout
    assert not (root / "meta/preview.webp").exists()


def test_participants_are_not_sent(tmp_path, hub):
    mixed, theirs = record_episodes(tmp_path / "a", 2, participant=""), tmp_path / "b"
    record_episodes(theirs, 1, participant="P001")
    command("merge", mixed, theirs, "--output", tmp_path / "all", name="edit")
    said = push(tmp_path / "all", "--upload", code=2).stderr
    assert "episodes 2 are of participants" in said
    assert "handrail-edit keep --episodes 0-1" in said
    assert "all are" in push(theirs, "--upload", code=2).stderr
    (tmp_path / "participants").mkdir()
    assert "part of the user study" in push(mixed, "--upload", code=2).stderr
    assert (hub.sent, hub.repo) == ({}, {})


@pytest.mark.parametrize("merged", [False, True])
def test_episodes_of_unknown_drivers_are_not_sent(tmp_path, hub, merged):
    """LeRobot's `delete_episodes` drops the column of participants; its merge leaves it empty."""
    from lerobot.datasets.dataset_tools import merge_datasets
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    root = record_episodes(tmp_path / "set", 2, driven=True)
    if merged:
        mine = record_episodes(tmp_path / "mine", 1, participant="")
        parts = [LeRobotDataset("me/part", root=each) for each in (root, mine)]
        root = tmp_path / "both"
        merge_datasets(parts, output_repo_id="me/both", output_dir=root)
    said = push(root, "--upload", code=2).stderr
    assert "people drove episodes 0-1, and another tool has dropped who" in said
    assert not hub.sent


def test_a_refusal_of_the_hub_is_one_line(root, hub):
    def refuse(**_):
        raise OSError("401 Client Error\nlots of text")

    hub.create_repo = refuse
    said = push(root, "--upload", code=2).stderr
    assert "the hub did not take me/reach: 401 Client Error" in said


@pytest.mark.parametrize(
    "name", ["data/chunk-000/old/file-000.parquet", "videos/face/chunk-000/file-000.mp4"]
)
def test_files_of_others_with_names_like_ours_are_not_sent(root, hub, name):
    (root / name).parent.mkdir(parents=True)
    (root / name).write_text("private")
    assert f"{name}': no file of the dataset" in push(root, "--upload", code=2).stderr
    assert not hub.sent


def test_links_are_not_followed(root, hub, tmp_path):
    (tmp_path / "secret").write_text("private")
    stats = Layout(root).stats
    stats.rename(tmp_path / "stats.json")
    stats.symlink_to(tmp_path / "stats.json")
    assert "no file of the dataset, or a link" in push(root, "--upload", code=2).stderr
    assert not hub.sent


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--dataset.repo_id", "reach"), "owner/name"),
        (("--dataset.repo_id", "me/x", "--license", "My licence"), "such as cc-by-4.0"),
    ],
)
def test_wrong_settings_are_one_line(root, words, told):
    refused(root, *words, name="edit push", told=told)


STORE = "memory://bucket/reach"


@pytest.fixture
def store():
    system = fsspec.filesystem("memory")
    yield system
    system.rm("/bucket", recursive=True) if system.exists("/bucket") else None


def there(store):
    return {path.removeprefix("/bucket/reach/"): store.cat(path) for path in store.find("/bucket/reach")}


def test_a_store_gets_what_the_hub_gets_and_it_can_be_read(root, hub, store, tmp_path):
    litter(root)
    push(root, "--upload")
    said = push(root, "--to", STORE).stdout
    assert f"{root} to {STORE}: " in said
    assert there(store) == {}
    assert f"sent to {STORE}" in push(root, "--to", STORE, "--upload").stdout
    assert there(store) == hub.sent
    store.get("/bucket/reach", str(tmp_path / "back"), recursive=True)
    check_whole(tmp_path / "back", verify=True)


@pytest.mark.parametrize("sent", [0, 5, 16])
def test_a_copy_that_was_cut_short_is_no_dataset_and_is_made_again(sent, root, store, monkeypatch):
    left, put = [None] * sent, MemoryFileSystem.put_file

    def failing(system, *arguments, **settings):
        if not left:
            raise ConnectionError("the network\nis gone")
        left.pop()
        put(system, *arguments, **settings)

    with monkeypatch.context() as patch:
        patch.setattr(MemoryFileSystem, "put_file", failing)
        done = push(root, "--to", STORE, "--upload", code=2)
    assert f"--to {STORE}: the dataset could not be copied there: the network is gone\n" in done.stderr
    assert len(there(store)) == sent
    assert "meta/info.json" not in there(store)
    push(root, "--to", STORE, "--upload")
    assert len(there(store)) == 17


def test_data_in_a_store_are_not_replaced(root, store):
    push(root, "--to", STORE, "--upload")
    before = there(store)
    assert "found 17 files" in push(root, "--to", STORE, "--upload", code=2).stderr
    assert there(store) == before
    store.pipe("/bucket/reach/thesis.tex", b"mine")
    store.rm("/bucket/reach/meta/info.json")
    assert "choose another place" in push(root, "--to", STORE, "--upload", code=2).stderr


@pytest.mark.parametrize("to", ["nosuch://bucket/reach", "s3:bucket", "outputs/reach", "file:///proc/reach"])
def test_a_place_that_is_none_is_one_line(to, root):
    said = push(root, "--to", to, "--upload", code=2).stderr
    assert "--to" in said
    assert said.count("\n") == 1


def test_a_place_that_cannot_take_a_dataset_is_refused_before_the_dataset_is_read(root, store, tmp_path):
    push(root, "--to", STORE, "--upload")
    (root / "README.md").unlink()
    (tmp_path / "taken").write_text("mine")
    for to in ("nosuch://bucket/reach", STORE, f"file://{tmp_path}/taken", f"file://{tmp_path}/taken/below"):
        assert f"--to {to}: " in push(root, "--to", to, "--upload", code=2).stderr
        assert not (root / "README.md").exists()
