"""What all tests share: no network, repeatable property tests, and a marker for those that draw pictures."""

import functools
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from unittest import mock

import pytest
from hypothesis import settings

MOST_WORKERS = 4  # each imports torch, MuJoCo and the rest anew: about 1 GB, and the first half minute

os.environ["HF_HUB_OFFLINE"] = "1"  # before anything of Hugging Face is imported
os.environ.setdefault("HF_DATASETS_CACHE", str(Path(tempfile.gettempdir()) / "handrail-test-datasets"))
if "PYTEST_XDIST_WORKER" in os.environ:  # a worker inherits the cache of the process that started it
    os.environ["HF_DATASETS_CACHE"] += f"-{os.environ['PYTEST_XDIST_WORKER']}"
os.environ.setdefault("OMP_NUM_THREADS", "1")  # before torch: workers share the cores, and matrices are small

settings.register_profile("handrail", derandomize=True, deadline=None)
settings.load_profile("handrail")

_DRAW = """
import gymnasium, handrail.collect
env = gymnasium.make("handrail/Reach-v0", cameras=("scene",), image_size=(16, 16), disable_env_checker=True)
assert env.reset(seed=0)[0]["pixels"]["scene"].any(), "the picture is black"
"""


@pytest.hookimpl(optionalhook=True)  # pytest may run without xdist
def pytest_xdist_auto_num_workers() -> int:
    """Return what `-n auto` means: a worker a core that this process may use, within reason."""
    given = os.environ.get("PYTEST_XDIST_AUTO_NUM_WORKERS")
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return int(given) if given else min(allowed, MOST_WORKERS)


@pytest.fixture(autouse=True, scope="session")
def _checksums_elsewhere(tmp_path_factory: pytest.TempPathFactory):
    """Remember the checksums of tests' datasets below the tests' own folder, not in the user's cache."""
    from handrail.datasets import checksums

    folder = tmp_path_factory.mktemp("checksums")
    with mock.patch.object(checksums, "_folder", return_value=folder):
        yield


@functools.cache
def graphics_trouble() -> str:
    """Return why no picture can be drawn here, or nothing; tried in a process of its own, which may die."""
    done = subprocess.run([sys.executable, "-c", _DRAW], capture_output=True, text=True)
    if done.returncode == 0:
        return ""
    return (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("needs_gl") and graphics_trouble():
        pytest.skip(f"needs OpenGL: {graphics_trouble()}")
