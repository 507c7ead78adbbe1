"""A hub that takes what is pushed, and the command that pushes."""

from command_helpers import command
from datasets_helpers import tree


class Hub:
    """Takes what LeRobot's upload hands to the hub's client, at the place where LeRobot imports it."""

    def __init__(self):
        self.sent, self.calls, self.repo = {}, [], {}
        self.private, self.there = None, []  # of what is there already

    def __call__(self):
        return self

    def repo_exists(self, repo_id, repo_type):
        return self.private is not None

    def repo_info(self, repo_id, repo_type):
        return self

    def list_repo_files(self, repo_id, repo_type):
        return self.there

    def create_repo(self, **said):
        self.repo = said

    def upload_folder(self, folder_path, allow_patterns, ignore_patterns, **said):
        from huggingface_hub.utils import filter_repo_objects

        files = tree(folder_path)
        chosen = filter_repo_objects(files, allow_patterns=allow_patterns, ignore_patterns=ignore_patterns)
        self.calls.append(said)
        self.sent |= {name: files[name] for name in chosen}

    def delete_tag(self, *_, **__):
        pass

    create_tag = delete_tag

    def push_card(self, card, repo_id, **_):
        self.sent["README.md"] = str(card).encode()


def push(root, *words, code=0):
    done = command(root, "--dataset.repo_id", "me/reach", *words, name="edit push")
    assert done.returncode == code, done.stderr
    return done
