"""Scenes, tasks, the Gymnasium environments, operators and the session loop.

Importing it registers one environment a task, `handrail/<name>-v0`; nothing heavy is imported until one is
made.
"""

import gymnasium

from handrail.collect.tasks.catalogue import TASKS

for _spec in TASKS.built_in:
    gymnasium.register(
        f"handrail/{str(_spec.task).rpartition(':')[2]}-v0",
        entry_point="handrail.collect.envs.env:HandrailEnv",
        kwargs={"task": _spec.task},
    )
