"""Settings of the teleoperator `handrail_scripted`."""

from dataclasses import dataclass

from lerobot.teleoperators import TeleoperatorConfig

from handrail.controllers.errors import HandrailError


@TeleoperatorConfig.register_subclass("handrail_scripted")
@dataclass(kw_only=True)
class HandrailScriptedConfig(TeleoperatorConfig):
    """A script with a human-like hand steers `handrail_sim`.

    Attributes:
        noise: how human the hand is: 0 perfect, 1 the default, partly from studies of people.
        person: which person it is; persons differ in delay, noise and all the rest.
        episode_time_s: the same as `--dataset.episode_time_s`; 0 to begin anew whenever the task is done.
        reset_time_s: the same as `--dataset.reset_time_s`.
    """

    noise: float = 1.0
    person: int = 0
    episode_time_s: float = 0.0
    reset_time_s: float = 1.0

    def check(self) -> None:
        """Check the settings."""
        if not 0.0 <= self.episode_time_s < float("inf"):
            raise HandrailError(f"--teleop.episode_time_s {self.episode_time_s}: expected 0 s or more")
        if not 0.5 <= self.reset_time_s < float("inf"):
            raise HandrailError(
                f"--teleop.reset_time_s {self.reset_time_s}: expected 0.5 s or more: the scene changes then"
            )
