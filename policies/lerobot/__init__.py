"""All that LeRobot's commands need to run what Handrail trains: the plugins, and the checkpoints' own steps.

`--env.discover_packages_path=handrail.policies.lerobot` for policies of `handrail-train`. All else that
`handrail.collect.lerobot.plugins` registers is there, too.
"""

import handrail.collect.lerobot.plugins
import handrail.policies.imitation.interface.steps  # noqa: F401  (registers the steps)
