"""The package's laws: it leaves nothing out, shadows nobody, pins everything, imports downwards."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from configs import JOBS
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from places import ROOT
from rooms import FLOORS, imported, named, sources

from handrail.controllers.registry import resolved
from handrail.scripts.commands import COMMANDS, ENTRY

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
SETUPTOOLS = PROJECT["tool"]["setuptools"]
BENCH = Path("scripts/bench")
FORBIDDEN = {
    "controllers": {"mujoco", "gymnasium", "torch", "lerobot", "rerun", "datasets"},
    "datasets": {"mujoco", "gymnasium", "torch", "rerun"},
}


def test_every_package_is_listed():
    folders = {path.parent.relative_to(ROOT) for floor in FLOORS for path in sources(floor)}
    folders = {folder for folder in folders if BENCH not in (folder, *folder.parents)}  # not in the wheel
    assert set(SETUPTOOLS["packages"]) == {".".join(("handrail", *folder.parts)) for folder in folders}
    assert SETUPTOOLS["package-dir"] == {f"handrail.{floor}": floor for floor in FLOORS}


def test_every_data_file_is_listed():
    listed = {
        path
        for package, patterns in SETUPTOOLS["package-data"].items()
        for pattern in patterns
        for path in ROOT.joinpath(*package.split(".")[1:]).glob(
            pattern + ("/*" if pattern.endswith("**") else "")
        )
    }
    data = {
        path
        for floor in FLOORS
        for path in (ROOT / floor).rglob("*")
        if path.is_file() and path.suffix != ".py" and not {"__pycache__", "bench"} & set(path.parts)
    }
    assert data - listed == set()
    assert ROOT / "controllers" / "robot" / "robots" / "ridgeback_ur10.toml" in data


@pytest.mark.parametrize("folder", ["datasets", "tests"])
def test_folders_that_must_not_be_regular_packages(folder):
    assert not list((ROOT / folder).rglob("__init__.py"))


@pytest.mark.parametrize("path", ["", str(ROOT)])
def test_datasets_stays_hugging_face_s(path):
    code = "import datasets; print(datasets.__file__); datasets.Dataset"
    command = [sys.executable, "-c", code]
    environment = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT, env=environment)
    assert "site-packages" in done.stdout


def test_the_entry_points_are_those_of_the_table():
    names = ("handrail", *(f"handrail-{name}" for name in COMMANDS))
    assert PROJECT["project"]["scripts"] == dict.fromkeys(names, ENTRY)
    assert callable(resolved(ENTRY))
    for job in JOBS.values():
        assert callable(resolved(f"handrail.{job.body}"))


def requirements() -> list[Requirement]:
    extras = PROJECT["project"]["optional-dependencies"].values()
    texts = PROJECT["project"]["dependencies"] + PROJECT["build-system"]["requires"]
    return [Requirement(text) for text in texts + [text for extra in extras for text in extra]]


def pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    return dict(line.split("==") for line in lines if not line.startswith("#"))


def test_constraints_are_versions_without_addresses():
    for line in (ROOT / "constraints.txt").read_text().splitlines():
        assert line.startswith("# ") or re.fullmatch(r"[a-z0-9\-]+==[0-9][0-9a-z.]*", line), line
    assert not re.search(r"https?:|file:|[@/\\]", (ROOT / "constraints.txt").read_text())


@pytest.mark.parametrize("requirement", requirements(), ids=str)
def test_what_is_asked_for_is_pinned_and_fits(requirement):
    pin = pins()[canonicalize_name(requirement.name)]
    assert requirement.specifier.contains(pin), f"constraints.txt: {requirement.name}=={pin}"


def test_what_the_pins_need_is_pinned():
    """Every installed distribution that a pinned one needs, markers considered, is pinned as well."""
    pinned = pins()
    for name in pinned:
        try:
            needs = metadata.distribution(name).requires or []
        except metadata.PackageNotFoundError:
            continue  # a pin for another platform
        for need in map(Requirement, needs):
            if need.marker is None or need.marker.evaluate({"extra": ""}):
                assert canonicalize_name(need.name) in pinned, f"{name} needs {need.name}"


@pytest.mark.parametrize("floor", FLOORS)
def test_imports_go_downwards_and_by_the_full_name(floor):
    allowed = FLOORS[: FLOORS.index(floor) + 1]
    for path in sources(floor):
        for name in imported(path) | named(path):
            parts = name.split(".")
            if parts[0] == "handrail":
                assert len(parts) == 1 or parts[1] in allowed, f"{path}: names {name} from a floor above"
                assert "bench" not in parts or BENCH in path.relative_to(ROOT).parents, (
                    f"{path}: names {name}"
                )
            assert parts[0] not in {*FLOORS, "tests"} - {"datasets"}, f"{path}: import handrail.{name}"
            assert parts[0] not in FORBIDDEN.get(floor, ()), f"{path}: {name} does not belong on this floor"


def script(path: Path, text: str) -> None:
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


@pytest.fixture
def checkout(tmp_path):
    """A folder with the setup script and nothing else; its `venv` stops after saying who was asked."""
    (tmp_path / ".ci").mkdir()
    (tmp_path / ".ci" / "setup").write_text((ROOT / ".ci" / "setup").read_text())
    (tmp_path / "bin").mkdir()
    for tool in ("dirname", "ls"):
        (tmp_path / "bin" / tool).symlink_to(shutil.which(tool) or "")
    script(tmp_path / "bin" / "python3.12", "echo 'pyenv: python3.12: command not found' >&2; exit 127")
    return tmp_path


def setup(folder: Path, python: str = "") -> subprocess.CompletedProcess:
    environment = {"PATH": str(folder / "bin"), "HOME": str(folder), "PYTHON": python}
    command = ["/bin/sh", ".ci/setup"]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment)


@pytest.mark.parametrize("where", ["bin/python3", ".pyenv/versions/3.12.9/bin/python3"])
def test_setup_passes_over_a_python_that_does_not_run(checkout, where):
    found = checkout / where
    found.parent.mkdir(parents=True, exist_ok=True)
    script(found, f'case "$1$2" in -mvenv) echo "venv by $0"; exit 9;; *) exec {sys.executable} "$@";; esac')
    done = setup(checkout)
    assert done.returncode == 9
    assert f"venv by {found}" in done.stdout


def test_setup_says_what_to_do_without_python(checkout):
    done = setup(checkout, python=str(checkout / "bin" / "python3.12"))
    assert done.returncode == 1
    assert "does not run, is older than 3.12, or lacks venv" in done.stderr
    assert not (checkout / ".venv").exists()
