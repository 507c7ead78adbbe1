"""`handrail-train`: train an imitation policy with LeRobot's own training."""

from handrail.policies.imitation.config import TrainConfig, check_installed
from handrail.scripts import cli


@cli.command("handrail-train", TrainConfig)
def main(config: TrainConfig) -> int:
    """Run the command."""
    config.check()
    check_installed("handrail-train", ("torch", "accelerate"), config.policy)
    from handrail.datasets.presentation.terminal import Terminal
    from handrail.policies.imitation.training.training import train

    Terminal().print(f"written: {train(config)}")
    return 0


if __name__ == "__main__":
    main()
