"""`handrail-train`: train an imitation policy with LeRobot's own training."""

from importlib.util import find_spec

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.config import TrainConfig
from handrail.scripts import cli

_NEEDED = {"accelerate": "", "diffusers": "diffusion"}  # by policy; "" for all


def main() -> None:
    """Run the command."""
    cli.run(lambda: _train(cli.parse(TrainConfig, "handrail-train")))


def _train(config: TrainConfig) -> int:
    config.check()
    for module, policy in _NEEDED.items():
        if policy in ("", config.policy) and find_spec(module) is None:
            raise HandrailError(f"handrail-train: expected {module}, found none; pip install '.[train]'")
    from handrail.policies.imitation.training import train

    print(f"written: {train(config)}")
    return 0


if __name__ == "__main__":
    main()
