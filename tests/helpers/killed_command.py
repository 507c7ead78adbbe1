"""Runs a command that is killed, with SIGKILL, at its k-th change to what lies below a folder.

    python killed_command.py FOLDER K NAME ARGUMENT …

With K = 0 it lives, and says on stderr last how many changes there were.
"""

import contextlib
import sys

from datasets_guillotine import kill_at

from handrail.scripts.__main__ import main
from handrail.scripts.commands import COMMANDS

if __name__ == "__main__":
    folder, k, name, *arguments = sys.argv[1:]
    changes = kill_at(folder, int(k))
    command, *verb = ("edit", name) if name in COMMANDS["edit"].verbs else (name,)
    sys.argv = [f"handrail-{command}", *verb, *arguments]
    with contextlib.suppress(SystemExit):
        main()
    print(len(changes), file=sys.stderr)
