"""`handrail-trials`: let the scripted operators do every task in every mode, and count how it went."""

from handrail.collect.experiments.trials.config import TrialsConfig
from handrail.scripts import cli


@cli.command("handrail-trials", TrialsConfig)
def main(config: TrialsConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.collect.experiments.trials.table import trials_table, write_page
    from handrail.collect.experiments.trials.trials import run_trials
    from handrail.datasets.presentation.terminal import Terminal

    console = Terminal()
    trials = run_trials(
        config,
        lambda done: console.print(
            f"{done.task} {done.mode} {done.episode}: {done.failure_reason or 'done'}, {done.seconds:.1f} s"
        ),
    )
    for task in config.task_names:
        console.print(trials_table(trials, config.mode_names, task))
    if config.page:
        write_page(trials, config)
        console.print(f"Written: {config.page}")
    return 0


if __name__ == "__main__":
    main()
