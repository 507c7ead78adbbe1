"""Laws of the one entry of the benches: it lists them, and wrong input is one line that names it."""

import pytest
from command_helpers import ran, refused

from handrail.scripts.bench.__main__ import BENCHES

WRONG = (
    ("none", "", "unknown bench 'none'"),
    ("goal_reaching", "--controllers telepathy", "unknown controller 'telepathy': expected one of all"),
    ("goal_reaching", "--controllers ,", "--controllers: expected all, or some of mpc, rl"),
    ("goal_reaching", "--controllers mpc,mpc", "--controllers mpc,mpc: expected each controller once"),
    ("goal_reaching", "--profile slow", "unknown profile 'slow': expected one of all, delay"),
    ("goal_reaching", "--workers 1000", "--workers 1000: expected a whole number from 1 to 256"),
    ("goal_reaching", "--json /nowhere/at/all.json", "/nowhere/at/all.json: expected a file in an existing"),
    ("goal_reaching", "--page results.txt", "--page results.txt: expected a .md file"),
    ("cases", "e", "unknown case 'e': expected one of a, b, c, d"),
    ("cases", "a --seconds -1", "--seconds: expected a number >= 0"),
    ("speed", "--updates 1", "--updates: expected a whole number >= 10"),
    ("operators", "--tasks juggle", "unknown task 'juggle'"),
    ("rl", "--tau 2", "--tau: expected"),
    ("rl", "--steps 0", "--steps"),
    ("latency", "--browser /none", "--browser /none: expected a program"),
    ("soak", "--hours nan", "--hours: expected"),
    ("soak", "--fault typo", "--fault typo: expected a part of a name in faults.py, possible here"),
    ("soak", "--work edits", "unknown --work 'edits': expected one of edit, evaluate, packed"),
)


def test_every_bench_is_listed():
    assert {name for name, *_ in WRONG} == {*BENCHES, "none"}
    listed = ran(name="bench --help")
    assert all(f"{name} " in listed and bench.help in listed for name, bench in BENCHES.items())


@pytest.mark.parametrize(("name", "words", "told"), WRONG)
def test_wrong_input_is_one_line(name, words, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused(*words.split(), name=f"bench {name}", told=told)
    assert not list(tmp_path.iterdir())
