"""`handrail-evaluate`: run trained policies on declared seeds, protected or not, disturbed or not."""

from handrail.policies.imitation.config import check_installed
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.scripts import cli


@cli.command("handrail-evaluate", EvaluateConfig)
def main(config: EvaluateConfig) -> int:
    """Run the command."""
    config.check()
    check_installed("handrail-evaluate", ("torch",))
    from handrail.datasets.presentation.terminal import Terminal
    from handrail.policies.imitation.evaluation.evaluation import UnevaluatedError, evaluate
    from handrail.policies.imitation.evaluation.table import evaluation_table
    from handrail.policies.imitation.evaluation.video import film

    reasons: tuple[str, ...] = ()
    try:
        content = evaluate(config, Terminal(stderr=True))
    except UnevaluatedError as some:
        content, reasons = some.content, some.reasons
    console = Terminal()
    console.print(evaluation_table(content))
    if config.json:
        console.print(f"Written: {config.json}")
    if config.video:
        trouble = film(config, content)
        console.print(f"Without a video: {trouble}" if trouble else f"Video: {config.video}")
    for reason in reasons:
        Terminal(stderr=True).print(f"error: {reason}")
    return cli.FAILED if reasons else 0


if __name__ == "__main__":
    main()
