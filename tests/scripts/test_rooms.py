"""The house: a room is a folder of few files, and arrows go one way."""

import networkx
from rooms import FLOORS, ROOT, arrows, rooms

MOST_FILES = 20
COMMANDS = "scripts"  # as many files as there are commands
MOST_LINES = 300


def test_rooms_are_small():
    sizes = {room: len(files) for room, files in rooms().items() if room != COMMANDS}
    assert not {room: size for room, size in sizes.items() if size > MOST_FILES}


def test_files_are_short():
    files = [path for files in rooms().values() for path in files] + list((ROOT / "tests").rglob("*.py"))
    assert not {str(path): n for path in files if (n := len(path.read_text().splitlines())) > MOST_LINES}


def test_no_cycle():
    assert not list(networkx.simple_cycles(arrows()))


def test_no_arrow_upwards():
    def level(room: str) -> int:
        return FLOORS.index(room.split(".")[0])

    assert not [(room, target) for room, target in arrows().edges if level(target) > level(room)]
