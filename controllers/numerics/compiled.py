"""Compiles a CasADi function to machine code where a C compiler is at hand; many times faster.

The C code is CasADi's own; floating-point contraction is off, so that both give the same numbers, bit for
bit. The library is kept in the user's cache folder under the hash of its source. Without a compiler, or with
`HANDRAIL_COMPILE=0`, the function is returned as it came.
"""

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import casadi as ca

from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.first_use import compiling
from handrail.controllers.user_folder import user_folder

_FLAGS = ("-O2", "-fPIC", "-shared", "-ffp-contract=off")
_TIMEOUT = 120.0  # [s]


def compiled(function: ca.Function) -> ca.Function:
    """Return the function as machine code, or unchanged where that cannot be had."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None or os.environ.get("HANDRAIL_COMPILE") == "0":
        return function
    generator = ca.CodeGenerator(f"{function.name()}.c")
    generator.add(function)
    source = generator.dump()
    digest = hashlib.sha256(f"{compiler} {_FLAGS} {source}".encode()).hexdigest()[:24]
    try:
        library = user_folder("XDG_CACHE_HOME") / f"{function.name()}-{digest}.so"
        if not (library.is_file() and library.stat().st_size):  # a power cut leaves an empty one
            _build(source, library, compiler)
        return ca.external(function.name(), str(library))
    except (HandrailError, OSError, RuntimeError, subprocess.SubprocessError):
        return function  # a compiler that fails costs speed, nothing else


def _build(source: str, library: Path, compiler: str) -> None:
    """Compile to a temporary name beside the library, then rename: other processes see all or nothing."""
    compiling()
    library.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        code, built = Path(folder) / "function.c", Path(folder) / "function.so"
        code.write_text(source)
        command = [compiler, *_FLAGS, str(code), "-o", str(built), "-lm"]
        subprocess.run(command, check=True, capture_output=True, timeout=_TIMEOUT)
        os.replace(built, library)
