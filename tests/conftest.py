"""What all tests share: no network, repeatable property tests, and a marker for those that draw pictures."""

import functools
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import settings

os.environ["HF_HUB_OFFLINE"] = "1"  # before anything of Hugging Face is imported
os.environ.setdefault("HF_DATASETS_CACHE", str(Path(tempfile.gettempdir()) / "handrail-test-datasets"))

settings.register_profile("handrail", derandomize=True, deadline=None)
settings.load_profile("handrail")

_DRAW = """
import gymnasium, handrail.collect
env = gymnasium.make("handrail/Reach-v0", cameras=("scene",), image_size=(16, 16), disable_env_checker=True)
assert env.reset(seed=0)[0]["pixels"]["scene"].any(), "the picture is black"
"""


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
