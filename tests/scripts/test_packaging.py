"""The package's laws: it leaves nothing out, shadows nobody, pins everything; its setup finds a Python."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from pages import VERBS
from places import FLOORS, ROOT, sources

from handrail.controllers.registry import resolved
from handrail.scripts.commands import COMMANDS

ENTRY = "handrail.scripts.__main__:main"  # of all commands
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
SETUPTOOLS = PROJECT["tool"]["setuptools"]
LINES = (ROOT / "constraints.txt").read_text().splitlines()
PINS = dict(line.split("==") for line in LINES if not line.startswith("#"))
REQUIREMENTS = [
    *(PROJECT["project"]["dependencies"] + PROJECT["build-system"]["requires"]),
    *(text for extra in PROJECT["project"]["optional-dependencies"].values() for text in extra),
]


def test_every_package_and_data_file_is_listed():
    """All but the benches, which are not in the wheel."""
    packages = {path.parent.relative_to(ROOT) for floor in FLOORS for path in sources(floor)}
    names = {".".join(("handrail", *folder.parts)) for folder in packages if "bench" not in folder.parts}
    assert set(SETUPTOOLS["packages"]) == names
    assert SETUPTOOLS["package-dir"] == {f"handrail.{floor}": floor for floor in FLOORS}
    listed = {
        path
        for package, patterns in SETUPTOOLS["package-data"].items()
        for pattern in patterns
        for path in ROOT.joinpath(*package.split(".")[1:]).glob(re.sub(r"\*\*$", "**/*", pattern))
    }
    files = {path for floor in FLOORS for path in (ROOT / floor).rglob("*") if path.is_file()}
    data = {path for path in files if path.suffix != ".py" and not {"__pycache__", "bench"} & set(path.parts)}
    assert data - listed == set()


@pytest.mark.parametrize("folder", ["datasets", "tests"])
def test_folders_that_must_not_be_regular_packages(folder):
    assert not list((ROOT / folder).rglob("__init__.py"))


def test_datasets_stays_hugging_face_s():
    code = "import datasets; print(datasets.__file__); datasets.Dataset"
    command = [sys.executable, "-c", code]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT, env=environment)
    assert "site-packages" in done.stdout


def test_the_entry_points_are_those_of_the_table():
    names = ("handrail", *(f"handrail-{name}" for name in COMMANDS))
    assert PROJECT["project"]["scripts"] == dict.fromkeys(names, ENTRY)
    for name in (ENTRY, *(f"handrail.{verb.body}" for verb in VERBS.values())):
        assert callable(resolved(name))


def test_constraints_are_versions_without_addresses():
    wrong = [line for line in LINES if not re.fullmatch(r"# [^@/\\]*|[a-z0-9\-]+==[0-9][0-9a-z.]*", line)]
    assert not wrong


@pytest.mark.parametrize("requirement", [Requirement(text) for text in REQUIREMENTS], ids=str)
def test_requested_packages_are_pinned_and_fit(requirement):
    assert requirement.specifier.contains(PINS[canonicalize_name(requirement.name)])


def test_requirements_of_pinned_packages_are_pinned():
    """What an installed one needs, markers considered; some pins are for another platform."""
    installed = {
        canonicalize_name(each.metadata["Name"]): each.requires or () for each in metadata.distributions()
    }
    for name in PINS.keys() & installed.keys():
        for need in map(Requirement, installed[name]):
            if need.marker is None or need.marker.evaluate({"extra": ""}):
                assert canonicalize_name(need.name) in PINS, f"{name} needs {need.name}"


def script(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


@pytest.fixture
def setup(tmp_path):
    """What runs the setup script in a folder with nothing else but a Python that does not run."""
    (tmp_path / ".ci").mkdir()
    shutil.copy(ROOT / ".ci" / "setup", tmp_path / ".ci")
    broken = script(
        tmp_path / "bin" / "python3.12", "echo 'pyenv: python3.12: command not found' >&2; exit 127"
    )
    for tool in ("dirname", "ls"):
        (tmp_path / "bin" / tool).symlink_to(shutil.which(tool) or "")

    def run(python: str = "") -> subprocess.CompletedProcess:
        environment = {"PATH": str(broken.parent), "HOME": str(tmp_path), "PYTHON": python}
        command = ["/bin/sh", ".ci/setup"]
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment)

    return run


@pytest.mark.parametrize("where", ["bin/python3", ".pyenv/versions/3.12.9/bin/python3"])
def test_setup_passes_over_a_python_that_does_not_run(setup, where, tmp_path):
    """The `venv` of the one that runs stops after saying which was asked."""
    asked = f'case "$1$2" in -mvenv) echo "venv by $0"; exit 9;; *) exec {sys.executable} "$@";; esac'
    found = script(tmp_path / where, asked)
    done = setup()
    assert done.returncode == 9
    assert f"venv by {found}" in done.stdout


@pytest.mark.skipif(any(Path("/usr/bin").glob("python3.1[2-9]")), reason="it would be found")
def test_setup_says_where_a_python_comes_from(setup):
    done = setup()
    assert done.returncode == 1
    assert "make setup PYTHON=/path/to/python3.12" in done.stderr


def test_setup_brings_pip_to_an_environment_without(setup, tmp_path):
    answers = 'case "$1$2" in -mpip) exit 1;; -mensurepip) echo brought; exit 9;; esac'
    script(tmp_path / ".venv/bin/python", answers)
    done = setup()
    assert (done.returncode, done.stdout) == (9, "brought\n")


def test_setup_says_what_to_do_without_python(setup, tmp_path):
    done = setup(str(tmp_path / "bin" / "python3.12"))
    assert done.returncode == 1
    assert "does not run, is not 3.12 or 3.13, or lacks venv" in done.stderr
    assert not (tmp_path / ".venv").exists()
