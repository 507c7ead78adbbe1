"""`handrail-study-session`: lead people through a user study in the cockpit."""

from handrail.collect.user_study.config import StudySessionConfig
from handrail.scripts import cli


@cli.command("handrail-study-session", StudySessionConfig)
def main(config: StudySessionConfig) -> int:
    """Run the command."""
    config.check()
    if config.verb == "run":
        cli.say_starting()
    from handrail.collect.user_study.run import (
        study_session,  # loads the simulator: only once the settings are right
    )

    return study_session(config)


if __name__ == "__main__":
    main()
