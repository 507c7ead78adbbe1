"""LeRobot's base classes load torch: ours are loaded when LeRobot asks, and all of them then."""

import subprocess
import sys

CODE = """
import sys
import gymnasium
import handrail.collect.lerobot
from handrail.collect import SessionConfig

env = gymnasium.make("handrail/LeRobot-v0", config=SessionConfig(task="reach"), fps=20)
env.reset(seed=0)
env.step(env.action_space.sample())
env.close()
print(sorted({"torch", "lerobot", "datasets", "handrail.collect.lerobot.sim"} & set(sys.modules)))

from lerobot.configs.parser import load_plugin
load_plugin("handrail.collect.lerobot")

from lerobot.envs import EnvConfig
from lerobot.processor import ProcessorStepRegistry
from lerobot.robots import RobotConfig
from lerobot.teleoperators import TeleoperatorConfig
for kind in (RobotConfig, TeleoperatorConfig, EnvConfig):
    print(sorted(name for name in kind.get_known_choices() if name.startswith("handrail")))
print([name for name in ProcessorStepRegistry.list() if name.startswith("handrail")])
print("lerobot.datasets" in sys.modules)
"""


def test_an_environment_needs_no_torch_and_lerobot_finds_all_that_there_is():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        "[]",
        "['handrail_sim']",
        "['handrail_cockpit', 'handrail_gamepad', 'handrail_scripted']",
        "['handrail']",
        "['handrail_masked_mpc']",
        "False",
    ]
