"""`handrail-benchmark`: the paper's goal-reaching benchmark, every controller on the same goals."""

from handrail.collect.experiments.benchmark.config import BenchmarkConfig
from handrail.scripts import cli


@cli.command("handrail-benchmark", BenchmarkConfig)
def main(config: BenchmarkConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.collect.experiments.benchmark.benchmark import benchmark
    from handrail.collect.experiments.benchmark.catalogue import BASELINES
    from handrail.collect.experiments.benchmark.tables import benchmark_tables
    from handrail.datasets.presentation.terminal import Terminal

    console = Terminal()
    baselines = {name: BASELINES.find(name) for name in config.controller_names}
    results = benchmark(config, baselines, console)
    console.print(*benchmark_tables(results), sep="\n")
    for written in (config.json, config.report and f"{config.report}/benchmark.html", config.page):
        if written:
            console.print(f"Written: {written}")
    return 0


if __name__ == "__main__":
    main()
