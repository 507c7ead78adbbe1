"""Handrail on the hub as an environment: `lerobot.envs.make_env("owner/name", trust_remote_code=True)`.

A copy of this file in a repository of the hub is all it takes; who uses it needs Handrail installed.
"""

from handrail.collect.lerobot import HandrailEnvConfig


def make_env(n_envs: int = 1, use_async_envs: bool = False, cfg=None):
    """Return environments, `{"handrail": {0: environments}}`.

    Args:
        n_envs: how many, side by side.
        use_async_envs: whether each has a process of its own.
        cfg: settings of LeRobot; its `task` is taken, `reach` by default.
    """
    task = getattr(cfg, "task", None) or "reach"
    config = cfg if isinstance(cfg, HandrailEnvConfig) else HandrailEnvConfig(task=task)
    return config.create_envs(n_envs, use_async_envs)
