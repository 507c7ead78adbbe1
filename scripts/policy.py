"""Commands that train policies and let them drive; PyTorch is loaded only where it is installed."""

from handrail.controllers.errors import FAILED, check_installed
from handrail.policies.imitation.config import TrainConfig, check_trainable
from handrail.policies.imitation.encoder.config import EncoderConfig
from handrail.policies.imitation.evaluation.config import EvaluateConfig


def train(config: TrainConfig) -> int:
    """Train a policy; return the exit code."""
    check_trainable("handrail-train", config.policy)
    from handrail.datasets.presentation.terminal import Terminal
    from handrail.policies.imitation.training import training

    Terminal().print(f"written: {training.train(config)}")
    return 0


def train_encoder(config: EncoderConfig) -> None:
    """Train an encoder."""
    check_installed("handrail-encoder", ("torch",), "train")
    from handrail.policies.imitation.encoder import training

    training.train(config)


def evaluate(config: EvaluateConfig) -> int:
    """Run trained policies on declared seeds; return the exit code."""
    check_installed("handrail-evaluate", ("torch",), "train")
    from handrail.datasets.presentation.terminal import Terminal
    from handrail.policies.imitation.evaluation.evaluation import UnevaluatedError, evaluate, film
    from handrail.policies.imitation.evaluation.file import evaluation_table

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
    return FAILED if reasons else 0
