"""The worst episodes come first, and the command that is printed leaves exactly them out."""

import re
import shlex
from dataclasses import replace

import numpy as np
import pytest
from command_helpers import command, ran, refused
from editing_helpers import record_episodes
from hypothesis import given
from hypothesis import strategies as st

from handrail.datasets.quality.worst import RANKING, deletion, ranked
from handrail.datasets.reading.load import read_demonstrations
from handrail.datasets.reading.reader import read_episodes, read_info


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    folder = tmp_path_factory.mktemp("worst") / "a set"
    record_episodes(folder, 4)
    ran("trim", folder, "--episodes", "2", "--in_place", name="edit")
    return folder


@pytest.fixture(scope="module")
def episodes(root):
    return read_demonstrations(root)


@given(
    values=st.lists(st.none() | st.integers(-3, 3), min_size=4, max_size=4), name=st.sampled_from([*RANKING])
)
def test_nothing_that_is_left_out_is_better(episodes, values, name):
    numbers = np.array([np.nan if value is None else float(value) for value in values])
    found = ranked(episodes, RANKING[name], numbers)
    assert sorted(each.episode.number for each in found) == np.flatnonzero(np.isfinite(numbers)).tolist()
    told = np.array([each.value for each in found])
    worse_first = np.diff(told) if RANKING[name].good == "higher" else -np.diff(told)
    assert (worse_first >= 0).all()


def test_the_printed_command_leaves_them_out(root):
    done = command(root, "--worst", "length", "--count", "3", name="inspect")
    assert done.returncode == 0, done.stderr
    (line,) = re.findall(r"^Without them: (.*)$", done.stdout, re.MULTILINE)
    name, *words = shlex.split(line)
    assert name == "handrail-edit"
    ran(*words, name="edit")
    (left,) = read_episodes(f"{root}_kept")
    assert left["seed"] == 2  # the trimmed one is the shortest


def test_of_another_tool_s_dataset_lerobot_leaves_them_out(root):
    info = replace(read_info(root), from_handrail=False)
    words = shlex.split(deletion(info, [2, 0]))
    assert words[0] == "lerobot-edit-dataset"
    assert words[-1] == "[0, 2]"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--worst", "lenght"), "expected one of"),
        (("--worst", "left.length"), "expected one of"),
        (("--worst", "left.sparc"), "got none: no entry of action or state is called left"),
        (("--worst", "undos"), "got none: nobody held a device"),
        (("--worst", "length", "--count", "0"), "expected 1 or more"),
    ],
)
def test_a_slip_is_one_line(root, words, told):
    refused(root, *words, name="inspect", told=told)
