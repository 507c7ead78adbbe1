"""One command line: folders first, lists by comma or space, a version, hints that lead to the clone."""

import dataclasses
import io
import os
import re
import shlex
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import get_args, get_type_hints

import pytest
from command_helpers import command, refused
from hypothesis import given
from hypothesis import strategies as st
from pages import COMMAND_CONFIGS, CONFIGS
from places import FLOORS, sources
from rich.console import Console

from handrail.controllers.errors import HandrailError, check_installed, not_installed
from handrail.datasets.lists import Names, Numbers, Words, split_list
from handrail.datasets.presentation.table import Table
from handrail.scripts import cli

STORED = ("inspect", "edit repair", "replay", "train", "record")
NEEDED = {
    "handrail-compare": ["x"],
    "handrail-edit merge": ["x", "y"],
    "handrail-devices test": ["keyboard"],
    "handrail-robot new": ["x"],
    "handrail-user-study": ["status", "x"],
}
LISTS = [get_args(kind)[1] for kind in (Names, Numbers, Words)]


@pytest.mark.parametrize("name", COMMAND_CONFIGS)
def test_every_command_says_its_version(name):
    done = command("--version", name=name.removeprefix("handrail-"))
    assert (done.returncode, done.stderr) == (0, "")
    assert re.fullmatch(rf"{name.split()[0]}.* \d+\.\d+\.\d+\n", done.stdout)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("x --actions foo", "invalid choice 'foo' for argument '--actions'. Expected one of"),
        ("x --steps many", "Error parsing --steps: invalid literal for int"),
        ("x --stepz 3", "Unrecognized options: --stepz"),
    ],
)
def test_a_wrong_flag_is_one_line_that_begins_with_what_is_wrong(words, said):
    line = refused(*words.split(), name="train")
    assert line.startswith(f"error: {said}")
    assert line.endswith("(see handrail-train --help)\n")


def test_a_terminal_without_unicode_gets_the_words_it_can_show(monkeypatch):
    written = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(written, "ascii"))
    monkeypatch.setattr(cli, "tell_when_compiling", lambda tell: None)  # it would last beyond this test
    with pytest.raises(SystemExit) as stopped:
        cli.run(lambda: print("pick × place", flush=True))
    assert (stopped.value.code, written.getvalue()) == (None, b"pick ? place\n")


@pytest.mark.parametrize(
    "word", [os.fsdecode(b"caf\xe9"), "~nobody-here/x", "--output=~nobody-here", "a" * 300, "/"]
)
@pytest.mark.parametrize("name", ["inspect", "repair", "replay", "pack", "compare", "train", "evaluate"])
def test_a_name_that_none_can_have_is_one_line(name, word, tmp_path, monkeypatch):
    """Bytes that are no text, a person who has no home here, a name too long, the top of all folders."""
    monkeypatch.chdir(tmp_path)
    line = refused(word, *(["--output", "new"] if name == "train" else []), name=name)
    assert len(line) < 500
    assert not list(tmp_path.iterdir())


def test_a_sentence_may_begin_with_a_tilde():
    words = "~5 cm above the table"
    given = cli.parse(CONFIGS["handrail-record"], "record", ["a", "--dataset.single_task", words])
    assert given.dataset.single_task == words


ONE_WAY = [  # command, ways to say the same, both ways at once
    *((name, ("a", "--dataset.root a", "--dataset.root=a"), "a --dataset.root b") for name in STORED),
    ("evaluate", ("a b", "a,b", "--policy a b", "--policy a,b"), "a --policy b"),
]


@pytest.mark.parametrize(("name", "ways", "both"), ONE_WAY)
def test_a_folder_is_the_first_word_or_a_flag_and_never_both(name, ways, both, monkeypatch):
    config = CONFIGS[f"handrail-{name}"]
    found = [cli.parse(config, name, way.split()) for way in ways]
    folders = [
        each.folders if name == "evaluate" else getattr(each, "dataset", each).folder for each in found
    ]
    assert set(folders) == {(Path("a"), Path("b")) if name == "evaluate" else Path("a")}
    refused(*both.split(), name=name, told="got both")
    refused(name=name, told="got n")
    if name in STORED:
        monkeypatch.setenv("HF_LEROBOT_HOME", "/hub")
        assert cli.parse(config, name, ["--dataset.repo_id", "me/a"]).dataset.folder == Path("/hub/me/a")


def list_flags(config: type, prefix: str = "") -> list[str]:
    """Return the flags and fields of a config that take a list, perhaps with help of their own."""
    found = []
    for name, hint in get_type_hints(config, include_extras=True).items():
        kind, (_, *given) = getattr(hint, "__origin__", hint), get_args(hint) or (hint,)
        if dataclasses.is_dataclass(kind):
            found += list_flags(kind, f"{prefix}{name}.")
        elif "Positional" not in map(str, given) and any(given[:1] == [each] for each in LISTS):
            found.append(f"{prefix}{name}")
    return found


FLAGS = [(name, flag) for name, config in CONFIGS.items() for flag in list_flags(config)]


@pytest.mark.parametrize(("name", "flag"), FLAGS)
def test_a_list_is_written_with_commas_or_spaces(name, flag, capsys):
    assert len(FLAGS) > 12
    needed = NEEDED.get(name, ["x"] if name.startswith("handrail-edit") else [])
    values = {
        str(cli.parse(CONFIGS[name], name, [*needed, f"--{flag}", *shlex.split(written)]))
        for written in ("1 2", "1,2", "1, 2", "'1,2'", "1,2,")
    }
    assert len(values) == 1, values
    with pytest.raises(SystemExit):  # as where a shell's variable is empty
        cli.parse(CONFIGS[name], name, [*needed, f"--{flag}"])
    assert f"--{flag}: expected a list, got nothing" in capsys.readouterr().err


@pytest.mark.parametrize("config", COMMAND_CONFIGS.values())
def test_every_setting_of_many_names_is_such_a_list(config):
    assert tuple[str, ...] not in get_type_hints(config, include_extras=True).values()


def test_brackets_and_names_of_folders_keep_their_commas(tmp_path, monkeypatch):
    words = ["down_dims=[64, 128],n=3", '{"a": [1], "b": [2, 3]}', "x"]
    assert split_list(words) == ("down_dims=[64, 128]", "n=3", '{"a": [1], "b": [2, 3]}', "x")
    many = tuple(map(str, range(200)))  # longer than a file's name may be
    assert split_list([",".join(many)]) == many
    monkeypatch.chdir(tmp_path)
    Path("a,b").mkdir()
    assert split_list(["a,b", "c,d"]) == ("a,b", "c", "d")


def test_install_hints_come_from_one_place_and_lead_to_the_clone():
    """The package of this name on a public index is somebody else's."""
    files = [path for floor in FLOORS for path in sources(floor)]
    assert [path.name for path in files if "pip install" in path.read_text()] == ["errors.py"]
    for extra, what in (("display", "'.[display]'"), ("", ".")):
        message = str(not_installed("--flag", "module", extra))
        assert message.endswith(f"in the clone of Handrail: pip install -c constraints.txt -e {what}")
    with pytest.raises(HandrailError, match=r"^handrail-x: expected nowhere, found none; .*'\.\[rl\]'$"):
        check_installed("handrail-x", ("nowhere",), "rl")


def shown(table: Table) -> str:
    out = io.StringIO()
    Console(width=80, file=out).print(table)
    return out.getvalue()


CELL = st.text(st.sampled_from("abcdefghij 0123456789[]±"), max_size=30)


@given(st.lists(st.lists(CELL, min_size=9, max_size=9), min_size=2, max_size=5), st.integers(2, 9))
def test_a_table_fits_in_80_columns_and_loses_nothing(cells, size):
    headings, *rows = [row[:size] for row in cells]
    text = shown(Table(headings, rows, "title [s]", "caption [m]"))
    assert max(map(len, text.splitlines())) <= 80
    given_letters = Counter("".join(cell for row in [headings, *rows] for cell in row).replace(" ", ""))
    assert given_letters <= Counter(text)


def test_a_table_keeps_units_and_words_whole():
    headings = ("episode", "mode", "success", "why not", "length [s]")
    headings += ("smallest distance [m]", "smoothness", "contacts")
    row = ("0", "direct_filtered", "no", "timeout", "30.0", "0.088", "-2.20", "0")
    words = shown(Table(headings, [row])).split()
    assert {*" ".join(headings).split(), *row} <= set(words)


@pytest.mark.parametrize(
    "words", [["cockpit"], ["record", "x", "--operator=gamepad"], ["user-study", "run", "x", "P"]]
)
def test_waiting_is_said_before_anything_heavy_is_loaded(words):
    code = (
        "import sys\n"
        "heavy = ('mujoco', 'casadi', 'pinocchio', 'scipy', 'numba', 'lerobot')\n"
        "sys.modules.update(dict.fromkeys(heavy))  # to load one of them fails\n"
        "from handrail.scripts.__main__ import main\n"
        "sys.argv[0] = 'handrail'\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, timeout=60)
    assert done.stderr.startswith(f"{cli.STARTING}\n"), done.stderr
    assert "ModuleNotFoundError" in done.stderr


def test_an_interrupt_names_the_error_that_it_ended_in(capsys):
    def ends():
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        raise HandrailError("--output d: No space left on device")

    with pytest.raises(SystemExit) as ended:
        cli.run(ends)
    assert ended.value.code == 130
    assert capsys.readouterr().err == "error: interrupted; --output d: No space left on device\n"


def test_ctrl_d_at_a_question_is_one_line(capsys):
    def asks():
        raise EOFError("EOF when reading a line")

    with pytest.raises(SystemExit) as ended:
        cli.run(asks)
    assert ended.value.code == 2
    assert capsys.readouterr().err == "error: EOF when reading a line\n"
