"""A process that records until it is killed, and says on stdout what it has saved."""

import sys
from pathlib import Path

from datasets_helpers import create, digest, record_one, resume

from handrail.datasets.format.layout import Layout


def main(root: Path) -> None:
    open_writer = resume if Layout(root).manifest.exists() else create
    with open_writer(root, cameras=True) as writer:
        print("ready", flush=True)
        while True:
            episode = record_one(writer, cameras=True)
            print(episode, digest(root, episode, cameras=True), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
