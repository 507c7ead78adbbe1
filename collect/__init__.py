"""Scenes, tasks, the Gymnasium environments, operators and the session loop.

Importing it registers one environment a task, `handrail/<name>-v0`; nothing heavy is imported until one is
made.
"""

import gymnasium

TASKS = {
    "Drawer": "handrail.collect.tasks.drawer:Drawer",
    "Reach": "handrail.collect.tasks.reach:Reach",
    "PickPlace": "handrail.collect.tasks.pick_place:PickPlace",
    "Tray": "handrail.collect.tasks.tray:Tray",
}

for _name, _entry in TASKS.items():
    gymnasium.register(
        f"handrail/{_name}-v0", entry_point="handrail.collect.envs.env:HandrailEnv", kwargs={"task": _entry}
    )
