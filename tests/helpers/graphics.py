"""Whether pictures can be drawn here."""

import functools
import subprocess
import sys

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
