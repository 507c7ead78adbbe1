"""`handrail-train`: train an imitation policy with LeRobot's own training."""

from handrail.policies.imitation.config import TrainConfig
from handrail.policies.imitation.training.installed import check_installed
from handrail.scripts import cli


def main() -> None:
    """Run the command."""
    cli.run(lambda: _train(cli.parse(TrainConfig, "handrail-train")))


def _train(config: TrainConfig) -> int:
    config.check()
    check_installed("handrail-train", ("torch", "accelerate"), config.policy)
    from handrail.policies.imitation.training.training import train

    print(f"written: {train(config)}")
    return 0


if __name__ == "__main__":
    main()
