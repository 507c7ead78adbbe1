"""All that LeRobot finds by a name; importing this registers it.

```
robot.type   handrail_sim
teleop.type  handrail_scripted, handrail_cockpit, handrail_gamepad
env.type     handrail
a step of processors: handrail_masked_mpc
```
"""

import handrail.collect.lerobot.config_env
import handrail.collect.lerobot.configs
import handrail.collect.processor.mpc_step  # noqa: F401
