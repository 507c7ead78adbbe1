"""`handrail-study`: collect, train, evaluate and compare, modes × tasks × seeds, from one design."""

from handrail.policies.study.config import StudyConfig
from handrail.scripts import cli


@cli.command("handrail-study", StudyConfig)
def main(config: StudyConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.policies.study.execution.run import run_study

    return run_study(config)


if __name__ == "__main__":
    main()
