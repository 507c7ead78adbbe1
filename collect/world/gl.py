"""Chooses how MuJoCo draws, before it is imported; import `mujoco` from here.

`import mujoco` itself dies when `MUJOCO_GL` names a library that is not there, so the choice is made first.
State-only environments never need a graphics library.
"""

import ctypes
import os
import subprocess
import sys
from typing import Any

from handrail.controllers.errors import HandrailError

_LIBRARIES = {"egl": ("libEGL.so.1",), "osmesa": ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")}

_PROBE = """
import mujoco
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
mujoco.Renderer(model, 16, 16).close()
"""


def _loads(backend: str) -> bool:
    for library in _LIBRARIES[backend]:
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        return True
    return False


def choose_backend() -> None:
    """Set `MUJOCO_GL` to one that can be imported; leave macOS, Windows and a person's good choice alone."""
    if not sys.platform.startswith("linux"):
        return
    wanted = os.environ.get("MUJOCO_GL", "").lower()
    if wanted in _LIBRARIES and not _loads(wanted):
        os.environ["MUJOCO_GL"] = "disable"
    elif not wanted and _loads("egl"):
        os.environ["MUJOCO_GL"] = "egl"
    elif not wanted and not os.environ.get("DISPLAY"):
        os.environ["MUJOCO_GL"] = "disable"


def missing_graphics(reason: object) -> HandrailError:
    """Return the error for cameras without a graphics library."""
    detail = " ".join(str(reason).split()) or type(reason).__name__
    backend = os.environ.get("MUJOCO_GL", "")
    return HandrailError(
        f"cameras need OpenGL, which is missing here (MUJOCO_GL={backend!r}: {detail}); "
        "install it with: apt-get install libegl1 libgl1-mesa-dri, and unset MUJOCO_GL; "
        "without cameras everything else works"
    )


def graphics_trouble() -> str:
    """Return why there can be no pictures on this machine, in one line; empty if there can.

    A small picture is drawn in a process of its own, since a broken driver ends the process.
    """
    done = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=120)
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines()
    return str(missing_graphics(lines[-1] if lines else f"exit code {done.returncode}"))


choose_backend()

import mujoco as _mujoco  # noqa: E402

mujoco: Any = _mujoco  # it comes without type stubs, and so do its classes
type MjSpec = Any
type MjsBody = Any
type MjModel = Any
type MjData = Any
