"""What is on the hub already: nothing private becomes public, no episode that was left out stays."""

from command_helpers import command
from hub_helpers import push
from huggingface_hub import HfApi


def test_a_public_dataset_on_the_hub_is_not_taken_for_private(root, hub):
    hub.private = False
    assert "me/reach is on the hub and public" in push(root, "--upload", code=2).stderr
    assert not hub.sent
    push(root, "--upload", "--no_private")
    assert hub.sent


def test_no_episode_that_is_left_out_stays_on_the_hub(root, hub):
    """LeRobot reads every file that is there."""
    push(root, "--upload")
    hub.private, hub.there = True, [*hub.sent, ".gitattributes", "notes.txt"]
    push(root, "--upload")
    command(root, "--episodes", "2", "--in_place", name="edit delete")
    hub.sent = {}
    said = push(root, "--upload", code=2).stderr
    assert "me/reach on the hub has" in said
    assert "delete them there, or choose another name" in said
    assert not hub.sent


def test_a_network_that_is_not_there_is_one_line(root, hub, monkeypatch):
    monkeypatch.setattr("handrail.datasets.editing.push.HfApi", lambda: HfApi("http://127.0.0.1:9"))
    said = push(root, "--upload", code=2).stderr
    assert said.startswith("error: --upload: the hub did not take me/reach")
    assert said.count("\n") == 1
