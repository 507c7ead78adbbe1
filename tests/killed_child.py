"""A command that kills its own process, as SIGKILL does, at its k-th change below a folder.

    killed_child.py FOLDER K MODULE [FLAG …]

A change is an `open` for writing, a rename, a removal, a link or a new folder.
"""

import importlib
import os
import signal
import sys

from datasets_guillotine import CHANGES, WRITING


def main() -> None:
    folder, left, module, *flags = sys.argv[1:]
    remaining = int(left)

    def audit(event: str, arguments: tuple) -> None:
        nonlocal remaining
        opened = event == "open" and bool((arguments[2] or 0) & WRITING)
        if not opened and event not in (*CHANGES, "os.symlink"):
            return
        places = [os.fspath(path) for path in arguments[:2] if isinstance(path, str | os.PathLike)]
        if any(place.startswith(folder) for place in places):
            remaining -= 1
            if not remaining:
                os.kill(os.getpid(), signal.SIGKILL)

    if module == "handrail.scripts.evaluate":
        from handrail.policies.imitation import evaluation

        evaluation._SAVE_EVERY = 0.0  # after every rollout, so that there is much to write
    sys.argv = [module, *flags]
    entry = importlib.import_module(module).main
    sys.addaudithook(audit)
    entry()


if __name__ == "__main__":
    main()
