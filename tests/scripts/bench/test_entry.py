"""Laws of the one entry of the benches: it lists them, and wrong input is one line that names it."""

import pytest
from command_helpers import command

from handrail.scripts.bench.__main__ import BENCHES

WRONG = {
    "none": ("", "unknown bench 'none'"),
    "goal_reaching": ("--controllers telepathy", "unknown controller 'telepathy'"),
    "cases": ("d", "unknown case 'd'"),
    "speed": ("--updates 1", "--updates: expected"),
    "operators": ("--tasks juggle", "unknown task 'juggle'"),
    "rl": ("--gamma 2", "--gamma: expected"),
    "latency": ("--browser /none", "--browser /none: expected a program"),
    "scaling": ("--workers x", "--workers x: expected"),
    "soak": ("--hours nan", "--hours: expected"),
}


def test_every_bench_is_listed():
    assert set(WRONG) == {*BENCHES, "none"}
    listed = command(name="bench --help")
    assert listed.returncode == 0
    assert all(f"{name} " in listed.stdout and bench.help in listed.stdout for name, bench in BENCHES.items())


@pytest.mark.parametrize("name", WRONG)
def test_wrong_input_is_one_line(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words, said = WRONG[name]
    done = command(*words.split(), name=f"bench {name}")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert said in done.stderr
    assert not list(tmp_path.iterdir())
