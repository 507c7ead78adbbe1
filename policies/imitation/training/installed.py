"""Whether what training and rollouts need is installed; light to import."""

from importlib.util import find_spec

from handrail.controllers.errors import not_installed

_OF_POLICY = {"diffusion": ("diffusers",)}


def check_installed(command: str, modules: tuple[str, ...], policy: str = "", extra: str = "train") -> None:
    """Check that modules can be imported, and those of a policy.

    Args:
        command: that needs them.
        modules: that every policy needs.
        policy: its name in LeRobot.
        extra: of Handrail that brings them.
    """
    for module in (*modules, *_OF_POLICY.get(policy, ())):
        if find_spec(module) is None:
            raise not_installed(command, module, extra)
