"""The benches: `.venv/bin/python -m handrail.scripts.bench NAME`, from a clone; the wheel has none."""

import sys

from handrail.controllers.errors import unknown_name
from handrail.scripts import cli
from handrail.scripts.bench.report import PROGRAM
from handrail.scripts.commands import Verb


def _bench(help: str, settings: str, body: str) -> Verb:
    return Verb(help, f"scripts.bench.{settings}", f"scripts.bench.{body}")


BENCHES = {
    "goal_reaching": _bench(
        "the paper's Table I: controllers on the same goals",
        "goal_reaching.config:BenchmarkConfig",
        "goal_reaching.benchmark:main",
    ),
    "cases": _bench("the paper's cases A, B and C", "cases.showcase:ShowcaseConfig", "cases.showcase:main"),
    "speed": _bench(
        "the controller's update over degrees of freedom, pairs and stages, beside other solvers",
        "speed.config:SpeedConfig",
        "speed.speed:main",
    ),
    "operators": _bench(
        "scripted operators in every task and mode", "operators.file:TrialsConfig", "operators.trials:main"
    ),
    "rl": _bench(
        "trains the reinforcement-learning baseline (SAC)", "rl.config:TrainRlConfig", "rl.train:main"
    ),
    "latency": _bench(
        "how soon the robot does what the cockpit's page asks",
        "latency.measure:LatencyConfig",
        "latency.measure:main",
    ),
    "soak": _bench("hours of commands and faults", "soak.soak:SoakConfig", "soak.soak:main"),
}


def main() -> None:
    """Run the bench that the command line names; list them without one."""
    name, *arguments = sys.argv[1:] or ["--help"]

    def measure() -> int | None:
        if name in ("-h", "--help"):
            sys.stdout.write(f"usage: {PROGRAM} NAME [OPTIONS]\n\n")
            sys.stdout.writelines(f"{name:14} {bench.help}\n" for name, bench in BENCHES.items())
            return 0
        if name not in BENCHES:
            raise unknown_name("bench", name, BENCHES)
        bench = BENCHES[name]
        return bench.run(cli.parse(bench.config, f"{PROGRAM} {name}", arguments))

    cli.run(measure)


if __name__ == "__main__":
    main()
