"""Builds the compiled core: a shared library of the C beside this page, named after a hash of it.

It is the package's build backend (PEP 517): the library is built before the package, with the system's C
compiler; where there is none, zig's is installed first. It needs nothing but the standard library until then.
"""

import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
_FLAGS = ("-O3", "-std=c11", "-fPIC", "-shared", "-ffp-contract=off")


def library() -> Path:
    """Return the path of the library that belongs to the sources, built or not."""
    digest = hashlib.sha256(repr((_FLAGS, sys.platform, platform.machine())).encode())
    for source in sorted([*FOLDER.glob("*.c"), *FOLDER.glob("*.h")]):
        digest.update(source.read_bytes())
    return FOLDER / f"core-{digest.hexdigest()[:16]}.so"


def build() -> Path:
    """Build the library where it is missing; return its path. Other processes see all of it or nothing."""
    built = library()
    if built.is_file() and built.stat().st_size:  # a power cut leaves an empty one
        return built
    compiler = _compiler()
    if compiler is None:
        raise OSError(
            "the compiled core: expected a C compiler (cc, gcc or clang) or the package ziglang, found none"
        )
    with tempfile.TemporaryDirectory(dir=FOLDER) as folder:
        fresh = Path(folder) / built.name
        command = [*compiler, *_FLAGS, *map(str, sorted(FOLDER.glob("*.c"))), "-o", str(fresh), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise OSError(f"the compiled core: {compiler[0]} failed: {' '.join(done.stderr.split())[:300]}")
        os.replace(fresh, built)
    for old in FOLDER.glob("core-*.so"):
        if old != built:
            old.unlink(missing_ok=True)
    return built


def _compiler() -> list[str] | None:
    for name in ("cc", "gcc", "clang"):
        if path := shutil.which(name):
            return [path]
    zig = [sys.executable, "-m", "ziglang", "cc", "-mcpu=baseline"]
    return zig if importlib.util.find_spec("ziglang") else None


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """Return what pip has to install before a wheel is built."""
    return [] if _compiler() else ["ziglang"]


get_requires_for_build_editable = get_requires_for_build_wheel


def build_wheel(directory: str, config_settings: Any = None, metadata_directory: str | None = None) -> str:
    """Build the wheel of this platform; any Python runs it."""
    from setuptools import build_meta

    build()
    settings = {"--build-option": ["--plat-name", sysconfig.get_platform()]}
    return build_meta.build_wheel(directory, settings, metadata_directory)


def build_editable(directory: str, config_settings: Any = None, metadata_directory: str | None = None) -> str:
    """Build the library in its folder, and the wheel that leads to it."""
    from setuptools import build_meta

    build()
    return build_meta.build_editable(directory, config_settings, metadata_directory)


def build_sdist(directory: str, config_settings: Any = None) -> str:
    """Pack the sources."""
    from setuptools import build_meta

    return build_meta.build_sdist(directory, config_settings)
