"""`handrail-train-rl`: train the reinforcement-learning baseline."""

from handrail.policies.imitation.training.installed import check_installed
from handrail.policies.rl.config import TrainRlConfig
from handrail.scripts import cli


@cli.command("handrail-train-rl", TrainRlConfig)
def main(config: TrainRlConfig) -> int:
    """Run the command."""
    config.check()
    check_installed("handrail-train-rl", ("stable_baselines3", "tensorboard"), extra="rl")
    from handrail.datasets.presentation.terminal import Terminal
    from handrail.policies.rl.train import train

    record = train(config)
    score = {name: values["mean"] for name, values in record["final"].items()}
    say = Terminal().print
    say(
        f"{score['success']:.1%} of new goals after {record['curve'][-1]['steps']} steps, "
        f"effort {score['arm_effort']:.1f}, jerkiness {score['jerkiness']:.3f}"
    )
    say(f"written: {config.folder}/actor.npz, actor.json, curve.png")
    return 0


if __name__ == "__main__":
    main()
