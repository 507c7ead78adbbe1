"""Whether what training and rollouts need is installed; light to import."""

from importlib.util import find_spec

from handrail.controllers.errors import HandrailError

_OF_POLICY = {"diffusion": ("diffusers",)}


def check_installed(command: str, modules: tuple[str, ...], policy: str = "") -> None:
    """Check that modules can be imported, and those of a policy.

    Args:
        command: that needs them.
        modules: that every policy needs.
        policy: its name in LeRobot.

    Raises:
        HandrailError: one is not there.
    """
    for module in (*modules, *_OF_POLICY.get(policy, ())):
        if find_spec(module) is None:
            raise HandrailError(f"{command}: expected {module}, found none; pip install '.[train]'")
