"""Runs a command that is killed, with SIGKILL, at its k-th change to what lies below a folder.

    python killed_command.py FOLDER K NAME ARGUMENT …

With K = 0 it lives, and says on stderr last how many changes there were.
"""

import contextlib
import os
import signal
import sys
from pathlib import Path

from datasets_guillotine import is_change

from handrail.scripts.__main__ import main as handrail_main
from handrail.scripts.commands import COMMANDS


def main(folder: str, k: int, name: str, arguments: list[str]) -> None:
    changes = 0

    def audit(event: str, details: tuple) -> None:
        nonlocal changes
        if is_change(event, details) and _concerns(folder, details):
            changes += 1
            if changes == k:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(audit)
    command, *verb = ("edit", name) if name in COMMANDS["edit"].verbs else (name,)
    sys.argv = [f"handrail-{command}", *verb, *arguments]
    with contextlib.suppress(SystemExit):
        handrail_main()
    print(changes, file=sys.stderr)


def _concerns(folder: str, details: tuple) -> bool:
    paths = [os.fspath(path) for path in details[:2] if isinstance(path, str | os.PathLike)]
    return any(path == folder or path.startswith(folder + os.sep) for path in paths)


if __name__ == "__main__":
    main(str(Path(sys.argv[1])), int(sys.argv[2]), sys.argv[3], sys.argv[4:])
