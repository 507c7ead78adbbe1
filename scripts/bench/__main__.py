"""The benches: `.venv/bin/python -m handrail.scripts.bench NAME`, from a clone; the wheel has none."""

import sys
from dataclasses import dataclass
from typing import Any

from handrail.controllers.errors import unknown_name
from handrail.controllers.registry import resolved
from handrail.scripts import cli
from handrail.scripts.bench.report import PROGRAM

_HERE = "handrail.scripts.bench"


@dataclass(frozen=True)
class Bench:
    """One thing to measure."""

    help: str  # one line
    config: str  # `module:name` of its settings; light to import
    main: str  # `module:name` of `(config) -> exit code`

    @property
    def settings(self) -> type[Any]:
        """The class of its settings."""
        return resolved(f"{_HERE}.{self.config}")

    def run(self, config: Any) -> int:
        """Measure as configured; return the exit code."""
        config.check()
        return resolved(f"{_HERE}.{self.main}")(config)


BENCHES = {
    "goal_reaching": Bench(
        "the paper's Table I: controllers on the same goals",
        "goal_reaching.config:BenchmarkConfig",
        "goal_reaching.benchmark:main",
    ),
    "cases": Bench("the paper's cases A, B and C", "cases.showcase:ShowcaseConfig", "cases.showcase:main"),
    "speed": Bench(
        "the controller's update over degrees of freedom, pairs and stages, beside other solvers",
        "speed.config:SpeedConfig",
        "speed.speed:main",
    ),
    "operators": Bench(
        "scripted operators in every task and mode", "operators.file:TrialsConfig", "operators.trials:main"
    ),
    "rl": Bench(
        "trains the reinforcement-learning baseline (SAC)", "rl.config:TrainRlConfig", "rl.train:main"
    ),
    "latency": Bench(
        "how soon the robot does what the cockpit's page asks",
        "latency.measure:LatencyConfig",
        "latency.measure:main",
    ),
    "soak": Bench("hours of commands and faults", "soak.soak:SoakConfig", "soak.soak:main"),
}


def main() -> None:
    """Run the bench that the command line names; list them without one."""
    name, *arguments = sys.argv[1:] or ["--help"]

    def measure() -> int:
        if name in ("-h", "--help"):
            sys.stdout.write(f"usage: {PROGRAM} NAME [OPTIONS]\n\n")
            sys.stdout.writelines(f"{name:14} {bench.help}\n" for name, bench in BENCHES.items())
            return 0
        if name not in BENCHES:
            raise unknown_name("bench", name, BENCHES)
        bench = BENCHES[name]
        return bench.run(cli.parse(bench.settings, f"{PROGRAM} {name}", arguments))

    cli.run(measure)


if __name__ == "__main__":
    main()
