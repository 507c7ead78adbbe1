"""One command line: folders first, lists by comma or space, a version, hints that lead to the clone."""

import dataclasses
import io
import os
import re
import shlex
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
from command_helpers import command
from hypothesis import given
from hypothesis import strategies as st
from pages import CONFIGS
from places import ROOT
from rich.console import Console

from handrail.controllers.errors import HandrailError, not_installed
from handrail.datasets.lists import Names, Numbers, Words, split_list
from handrail.datasets.presentation.table import Table
from handrail.policies.imitation.config import check_installed
from handrail.scripts import cli

SOURCES = [
    path
    for room in ("collect", "controllers", "datasets", "policies", "scripts")
    for path in (ROOT / room).rglob("*.py")
]
STORED = ("inspect", "repair", "replay", "train", "record")
NEEDED = {
    "handrail-compare": ["x"],
    "handrail-edit merge": ["x", "y"],
    "handrail-devices test": ["keyboard"],
    "handrail-user-study": ["status", "x"],
}
LISTS = (Names, Numbers, Words)


@pytest.mark.parametrize("name", CONFIGS)
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
def test_a_wrong_flag_is_one_line_that_begins_with_what_is_wrong(words, said, capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.parse(CONFIGS["handrail-train"], "handrail-train", shlex.split(words))
    line = capsys.readouterr().err
    assert (stopped.value.code, line.count("\n")) == (2, 1)
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
    done = command(word, *(["--output", "new"] if name == "train" else []), name=name)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert len(done.stderr) < 500
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", STORED)
def test_a_dataset_is_a_folder_or_lerobot_s_flag_and_never_both(name, monkeypatch):
    config = CONFIGS["handrail-edit repair" if name == "repair" else f"handrail-{name}"]
    monkeypatch.setenv("HF_LEROBOT_HOME", "/hub")
    ways = (["outputs/a"], ["--dataset.root", "outputs/a"], ["--dataset.root=outputs/a"])
    assert {cli.parse(config, name, words).dataset.folder for words in ways} == {Path("outputs/a")}
    named = cli.parse(config, name, ["--dataset.repo_id", "me/a"])
    assert named.dataset.folder == Path("/hub/me/a")
    for words, told in ((["a", "--dataset.root", "b"], "got both"), ([], "got neither")):
        done = command(*words, name=name)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
        assert told in done.stderr
        assert "--dataset." in done.stderr


def test_policies_are_folders_or_the_flag_and_never_both():
    config = CONFIGS["handrail-evaluate"]
    ways = ("a b", "a,b", "--policy a b", "--policy a,b --workers 2")
    assert {cli.parse(config, "evaluate", shlex.split(way)).folders for way in ways} == {
        (Path("a"), Path("b"))
    }
    for words, told in ((["a", "--policy", "b"], "got both"), (["--workers", "2"], "got none")):
        done = command(*words, name="evaluate")
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
        assert told in done.stderr


def test_the_demo_s_folder_is_given_either_way():
    config = CONFIGS["handrail-demo"]
    folders = [cli.parse(config, "demo", words).folder for words in ([], ["a"], ["--root", "a"])]
    assert folders == [Path("outputs/demo"), Path("a"), Path("a")]
    assert cli.parse(config, "demo", ["~/a"]).folder == Path.home() / "a"
    done = command("a", "--root", "b", name="demo")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr


def is_list(hint: Any) -> bool:
    """Whether a type is that of a list with a flag, perhaps with help of its own."""
    _, *given = get_args(hint) or (hint,)
    return "Positional" not in map(str, given) and any(given[:1] == [get_args(kind)[1]] for kind in LISTS)


def list_flags(config: type, prefix: str = "") -> list[str]:
    """Return the flags and fields of a config that take a list."""
    found = []
    for name, hint in get_type_hints(config, include_extras=True).items():
        kind = getattr(hint, "__origin__", hint)
        if dataclasses.is_dataclass(kind):
            found += list_flags(kind, f"{prefix}{name}.")
        elif is_list(hint):
            found.append(f"{prefix}{name}")
    return found


FLAGS = [(command, flag) for command, config in CONFIGS.items() for flag in list_flags(config)]


def test_there_are_lists_in_many_commands():
    assert {"--" + flag for _, flag in FLAGS} >= {
        *("--cameras", "--controllers", "--profile", "--tasks", "--modes", "--protection", "--perturbation"),
        *("--policy", "--policy_options", "--labels", "--evaluations", "--columns.asked", "--layers"),
    }


@pytest.mark.parametrize(("name", "flag"), FLAGS)
def test_a_list_is_written_with_commas_or_spaces(name, flag):
    needed = NEEDED.get(name, ["x"] if name.startswith("handrail-edit") else [])
    values = {
        str(cli.parse(CONFIGS[name], name, [*needed, f"--{flag}", *shlex.split(written)]))
        for written in ("1 2", "1,2", "1, 2", "'1,2'", "1,2,")
    }
    assert len(values) == 1, values


def test_no_help_asks_for_commas_but_where_a_space_does_as_well():
    """A setting of many names is a list, which takes both: none is left that takes commas alone."""
    for name, config in CONFIGS.items():
        assert "comma-separated" not in str(command("--help", name=name.removeprefix("handrail-")).stdout), (
            name
        )
        plain = [
            hint
            for hint in get_type_hints(config, include_extras=True).values()
            if hint in (tuple[str, ...],)
        ]
        assert not plain, name


def test_brackets_keep_their_commas():
    words = ["down_dims=[64, 128],n=3", '{"a": [1], "b": [2, 3]}', "x"]
    assert split_list(words) == ("down_dims=[64, 128]", "n=3", '{"a": [1], "b": [2, 3]}', "x")


def test_a_folder_with_a_comma_in_its_name_is_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a,b").mkdir()
    assert split_list(["a,b", "c,d"]) == ("a,b", "c", "d")


def test_install_hints_come_from_one_place_and_lead_to_the_clone():
    """The package of this name on a public index is somebody else's."""
    hints = [
        (path.name, line)
        for path in SOURCES
        for line in path.read_text().splitlines()
        if "pip install" in line
    ]
    assert [name for name, _ in hints] == ["errors.py"], hints
    for extra, what in (("display", "'.[display]'"), ("", ".")):
        message = str(not_installed("--flag", "module", extra))
        assert message.endswith(f"in the clone of Handrail: pip install -c constraints.txt {what}")
        assert "\n" not in message
    with pytest.raises(HandrailError, match=r"^handrail-x: expected nowhere, found none; .*'\.\[rl\]'$"):
        check_installed("handrail-x", ("nowhere",), extra="rl")


def test_messages_name_flags(tmp_path):
    """What may be done about a dataset in the way is said in words that can be typed."""
    folder = tmp_path / "set"
    (folder / "meta").mkdir(parents=True)
    (folder / "meta" / "info.json").write_text("{}")
    done = command(folder, "--task", "reach")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert {"--resume", "--overwrite"} <= set(done.stderr.split())


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
    headings = (
        *("episode", "mode", "success", "why not", "length [s]"),
        *("smallest distance [m]", "smoothness", "contacts"),
    )
    row = ("0", "direct_filtered", "no", "timeout", "30.0", "0.088", "-2.20", "0")
    words = shown(Table(headings, [row])).split()
    assert {*" ".join(headings).split(), *row} <= set(words)


@pytest.mark.parametrize(
    "words", [["cockpit"], ["record", "x", "--operator=gamepad"], ["user-study", "run", "x", "P"]]
)
def test_who_waits_is_told_so_before_anything_heavy_is_loaded(words):
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
