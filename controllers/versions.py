"""Versions of the software that data, policies and measurements depend on."""

from importlib import metadata

SIMULATION = ("handrail", "lerobot", "mujoco", "pin", "coal", "casadi", "daqp", "numpy", "gymnasium")
TRAINING = ("handrail", "lerobot", "torch", "numpy")


def versions(*names: str) -> dict[str, str]:
    """Return the installed version of each distribution."""
    return {name: metadata.version(name) for name in names}
