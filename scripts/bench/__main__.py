"""The benches: `.venv/bin/python -m handrail.scripts.bench NAME`, from a clone; the wheel has none."""

import sys
import tomllib
from pathlib import Path

from handrail.controllers.errors import check_known
from handrail.scripts import cli
from handrail.scripts.bench.report import PROGRAM
from handrail.scripts.commands import Verb

_TABLE = tomllib.loads((Path(__file__).parent / "benches.toml").read_text(encoding="utf-8"))
BENCHES = {
    name: Verb(help, f"scripts.bench.{settings}", f"scripts.bench.{body}")
    for name, (help, settings, body) in _TABLE.items()
}


def main() -> None:
    """Run the bench that the command line names; list them without one."""
    name, *arguments = sys.argv[1:] or ["--help"]

    def measure() -> int | None:
        if name in ("-h", "--help"):
            sys.stdout.write(f"usage: {PROGRAM} NAME [OPTIONS]\n\n")
            sys.stdout.writelines(f"{name:14} {bench.help}\n" for name, bench in BENCHES.items())
            return 0
        check_known("bench", (name,), BENCHES)
        bench = BENCHES[name]
        return bench.run(cli.parse(bench.config, f"{PROGRAM} {name}", arguments))

    cli.run(measure)


if __name__ == "__main__":
    main()
