"""What all tests share: no network, repeatable property tests, and a marker for those that draw pictures."""

import os
import tempfile
from pathlib import Path
from unittest import mock

import pytest
from graphics import graphics_trouble
from hypothesis import settings

MOST_WORKERS = 4  # each imports torch, MuJoCo and the rest anew: about 1 GB, and the first half minute

os.environ["HF_HUB_OFFLINE"] = "1"  # before anything of Hugging Face is imported
os.environ.setdefault("HF_DATASETS_CACHE", str(Path(tempfile.gettempdir()) / "handrail-test-datasets"))
if "PYTEST_XDIST_WORKER" in os.environ:  # a worker inherits the cache of the process that started it
    os.environ["HF_DATASETS_CACHE"] += f"-{os.environ['PYTEST_XDIST_WORKER']}"
os.environ.setdefault("OMP_NUM_THREADS", "1")  # before torch: workers share the cores, and matrices are small

settings.register_profile("handrail", derandomize=True, deadline=None)
settings.load_profile("handrail")


@pytest.hookimpl(optionalhook=True)  # pytest may run without xdist
def pytest_xdist_auto_num_workers() -> int:
    """Return what `-n auto` means: a worker a core that this process may use, within reason."""
    given = os.environ.get("PYTEST_XDIST_AUTO_NUM_WORKERS")
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return int(given) if given else min(allowed, MOST_WORKERS)


@pytest.fixture(autouse=True, scope="session")
def _checksums_elsewhere(tmp_path_factory: pytest.TempPathFactory):
    """Remember the checksums of tests' datasets below the tests' own folder, not in the user's cache."""
    from handrail.datasets.recording import checksums

    folder = tmp_path_factory.mktemp("checksums")
    with mock.patch.object(checksums, "memory_folder", return_value=folder):
        yield


@pytest.fixture(autouse=True, scope="session")
def _disks_at_rest():
    """Wait for no disk: what is not on it yet is lost with the machine's power, and with nothing a test does.

    Tests of the order in which things reach the disk put an `os.fsync` of their own in its place.
    """

    def at_once(descriptor: int) -> None:
        """Write nothing through."""

    with mock.patch("os.fsync", at_once):
        yield


@pytest.fixture(autouse=True, scope="session")
def _errors_are_one_line():
    """Whatever is refused in any test, is refused in one line."""
    from handrail.controllers.errors import HandrailError

    def checked(self: HandrailError, *words: object) -> None:
        assert "\n" not in "".join(map(str, words)), words

    with mock.patch.object(HandrailError, "__init__", checked):
        yield


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("needs_gl") and graphics_trouble():
        pytest.skip(f"needs OpenGL: {graphics_trouble()}")
