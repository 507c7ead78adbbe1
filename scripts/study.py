"""`handrail-study`: collect, train, evaluate and compare, modes × tasks × seeds, from one design."""

from handrail.policies.study.config import StudyConfig
from handrail.scripts import cli


def main() -> None:
    """Run the command."""
    cli.run(lambda: _study(cli.parse(StudyConfig, "handrail-study")))


def _study(config: StudyConfig) -> int:
    config.check()
    from handrail.policies.study.execution.run import run_study

    return run_study(config)


if __name__ == "__main__":
    main()
