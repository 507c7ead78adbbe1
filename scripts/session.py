"""Commands in which a robot is driven; the simulator is loaded only once the settings are right."""

from handrail.collect.config import RecordConfig
from handrail.collect.execution.pool import RECORDING, begin_loading
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.user_study.config import StudySessionConfig
from handrail.controllers.errors import check_installed
from handrail.scripts import cli


def record(config: RecordConfig) -> int:
    """Record as configured; return the exit code."""
    if OPERATORS.find(config.operator).interactive:
        cli.say_starting()
    if config.is_shared and not config.ray:
        begin_loading(RECORDING)  # the workers' modules, beside this process's own
    share = None
    if config.policy:
        check_installed("--policy", ("torch",), "train")
        from handrail.policies.imitation.evaluation.copilot import share
    from handrail.collect.commands import record

    return record.record(config, share)


def user_study(config: StudySessionConfig) -> int:
    """Lead people through a user study; return the exit code."""
    if config.verb == "run":
        cli.say_starting()
    from handrail.collect.user_study.run import study_session

    return study_session(config)
