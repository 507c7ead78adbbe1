"""Who asked is told, once, that something is being compiled; what is in the cache is not compiled."""

import casadi as ca
import pytest

from handrail.controllers.numerics import first_use
from handrail.controllers.numerics.compiled import compiled


@pytest.fixture
def told():
    """Return a list that grows whenever it is said that something is being compiled."""
    said: list[str] = []
    first_use.tell_when_compiling(lambda: said.append("compiling"))
    yield said
    first_use.tell_when_compiling(lambda: None)


def test_a_library_of_casadi_is_told_and_one_in_the_cache_is_not(told, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("HANDRAIL_COMPILE", raising=False)
    x = ca.SX.sym("x")
    function = ca.Function("squared", [x], [x * x])
    if compiled(function) is function:
        pytest.skip("no C compiler here")
    assert told == ["compiling"]
    first_use.tell_when_compiling(lambda: told.append("again"))
    assert float(compiled(function)(3.0)) == 9.0
    assert told == ["compiling"]


@pytest.mark.parametrize("missing", ["compiler", "wish", "compiler that works", "home"])
def test_without_a_compiler_the_numbers_are_the_same(told, tmp_path, monkeypatch, missing):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("HANDRAIL_COMPILE", raising=False)
    x = ca.SX.sym("x", 3)
    function = ca.Function("tangled", [x], [ca.sin(x[0]) * x[1] / (1.0 + x[2] ** 2) + ca.exp(x)])
    fast = compiled(function)
    if missing == "home":
        monkeypatch.delenv("XDG_CACHE_HOME")
        monkeypatch.setattr("os.path.expanduser", str)
    elif missing == "wish":
        monkeypatch.setenv("HANDRAIL_COMPILE", "0")
    else:
        monkeypatch.setenv("PATH", str(tmp_path))
    if missing == "compiler that works":
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))
        (tmp_path / "cc").write_text("#!/bin/sh\nexit 1\n")
        (tmp_path / "cc").chmod(0o755)
    slow = compiled(function)
    assert slow is function
    for number in range(20):
        point = [0.1 * number, 2.0 - number, 0.3]
        assert fast(point).full().tolist() == slow(point).full().tolist()


def test_a_library_that_a_power_cut_left_empty_is_compiled_anew(told, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("HANDRAIL_COMPILE", raising=False)
    x = ca.SX.sym("x")
    functions = [ca.Function("cubed", [x], [x * x * x]) for _ in range(2)]
    if compiled(functions[0]) is functions[0]:
        pytest.skip("no C compiler here")
    (library,) = tmp_path.rglob("cubed-*.so")
    library.unlink()  # not emptied: this process has it mapped
    library.touch()
    assert compiled(functions[1]) is not functions[1]
    assert library.stat().st_size
