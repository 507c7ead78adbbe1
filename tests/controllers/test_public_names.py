"""Public names: there, known to editors, and loaded only when they are used."""

import subprocess
import sys
from importlib import import_module

import pytest

PACKAGES = {  # each with a name that is loaded from another module
    "handrail.controllers": ("MaskedMpc", "handrail.controllers.mpc.masked_mpc", 18),
    "handrail.collect": ("HandrailEnv", "handrail.collect.world.env", 9),
    "handrail.collect.lerobot": ("HandrailSim", "handrail.collect.lerobot.sim", 9),
}
HEAVY = ("casadi", "pinocchio", "coal", "numba", "mujoco", "lerobot", "torch", "rerun")


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_is_loaded_where_editors_are_told(package):
    module, (name, home, count) = import_module(package), PACKAGES[package]
    assert getattr(module, name) is getattr(import_module(home), name)
    assert len(module.__all__) == len({*module.__all__}) == count
    assert None not in [getattr(module, each, None) for each in module.__all__]
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        module.nothing  # noqa: B018


@pytest.mark.parametrize("package", PACKAGES)
def test_importing_a_package_loads_nothing_heavy(package):
    asked = f"import sys, {package}; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
