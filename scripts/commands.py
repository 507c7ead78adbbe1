"""The commands, by what a person wants to do; a command imports its own parts alone."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from handrail.controllers.registry import resolved

ENTRY = "handrail.scripts.__main__:main"  # of all commands


@dataclass(frozen=True)
class Verb:
    """What a command, or one of its words, does."""

    help: str
    """One line."""
    settings: str
    """`module:name` of the dataclass that its command line becomes; light to import."""
    body: str
    """`module:name` of `(settings) -> exit code or None`."""

    @property
    def config(self) -> type[Any]:
        """The class of its settings."""
        return resolved(f"handrail.{self.settings}")

    def run(self, config: Any) -> int | None:
        """Do it as configured; return the exit code."""
        if callable(check := getattr(config, "check", None)):
            check()
        return resolved(f"handrail.{self.body}")(config)


@dataclass(frozen=True)
class Program:
    """One command: `handrail-NAME`, or `handrail NAME`."""

    help: str
    """One line."""
    verbs: Mapping[str, Verb]
    """What it does, by the word that says it; what does one thing has it under the empty word."""


def _alone(help: str, settings: str, body: str) -> Program:
    return Program(help, {"": Verb(help, settings, body)})


def _edit(config: str, help: str) -> Verb:
    return Verb(help, f"datasets.editing.config:{config}", "scripts.dataset:edit")


GROUPS: Mapping[str, Mapping[str, Program]] = {
    "try it": {
        "demo": _alone(
            "record five episodes and show what came out",
            "collect.commands.config:DemoConfig",
            "collect.commands.demo:demo",
        ),
        "cockpit": _alone(
            "drive a robot in a browser, and record it",
            "collect.config:DriveConfig",
            "scripts.session:record",
        ),
    },
    "record": {
        "record": _alone(
            "record demonstrations as a LeRobot dataset",
            "collect.config:RecordConfig",
            "scripts.session:record",
        ),
        "replay": _alone(
            "run a recorded episode again, and measure the deviation",
            "collect.commands.config:ReplayConfig",
            "collect.commands.replay:replay",
        ),
        "devices": Program(
            "gamepad, SpaceMouse, keyboard and leader arms at this computer",
            {
                "list": Verb(
                    "what is plugged in",
                    "collect.teleop_config:ListDevicesConfig",
                    "collect.commands.devices:list_devices",
                ),
                "test": Verb(
                    "show what a device says",
                    "collect.teleop_config:ShowDeviceConfig",
                    "collect.commands.devices:show_device",
                ),
                "calibrate": Verb(
                    "which joint of a leader arm drives which joint of a robot",
                    "collect.teleop_config:CalibrateConfig",
                    "collect.devices.guided_calibration:calibrate",
                ),
            },
        ),
        "robot": Program(
            "make a robot of a URDF, and check its description",
            {
                "new": Verb(
                    "write the description of a robot from its URDF",
                    "collect.robot_config:NewRobotConfig",
                    "collect.commands.robot:new_robot",
                ),
                "check": Verb(
                    "say what is wrong with a robot's description, and draw it",
                    "collect.robot_config:CheckRobotConfig",
                    "collect.commands.robot:check_robot",
                ),
            },
        ),
        "lekiwi": Program(
            "a LeKiwi on the network",
            {
                "host": Verb(
                    "simulate one, in LeRobot's own protocol",
                    "collect.lekiwi.host_config:HostConfig",
                    "collect.lekiwi.host:serve",
                ),
            },
        ),
    },
    "look after datasets": {
        "inspect": _alone(
            "print the episodes, check them, find the worst",
            "collect.commands.config:InspectConfig",
            "scripts.dataset:inspect",
        ),
        "edit": Program(
            "change, repair, pack and send datasets; every column stays",
            {
                "delete": _edit("DeleteConfig", "leave out some --episodes"),
                "keep": _edit("KeepConfig", "leave out all but some --episodes"),
                "split": _edit("SplitConfig", "write --parts into folders of their own"),
                "merge": Verb(
                    "write several datasets into one",
                    "datasets.editing.config:MergeConfig",
                    "scripts.dataset:pack",
                ),
                "trim": _edit("TrimConfig", "cut off what is idle at both ends"),
                "relabel": _edit("RelabelConfig", "say with --label how --episodes ended"),
                "rename": _edit("RenameConfig", "give the task another sentence, --task"),
                "render": Verb(
                    "add pictures, drawn while the episodes' commands run again",
                    "collect.commands.config:RenderConfig",
                    "scripts.dataset:render",
                ),
                "pack": Verb(
                    "write a dataset into few large files",
                    "datasets.editing.config:PackConfig",
                    "scripts.dataset:pack",
                ),
                "repair": Verb(
                    "mend what a crash or a disk did",
                    "collect.commands.config:RepairConfig",
                    "scripts.dataset:repair",
                ),
                "push": Verb(
                    "write its card, and send it to the hub or elsewhere",
                    "collect.commands.config:PushConfig",
                    "scripts.dataset:push",
                ),
            },
        ),
    },
    "train policies": {
        "train": _alone(
            "train an imitation policy on a dataset",
            "policies.imitation.config:TrainConfig",
            "scripts.policy:train",
        ),
        "encoder": _alone(
            "train what reads pictures for policies",
            "policies.imitation.encoder.config:EncoderConfig",
            "scripts.policy:train_encoder",
        ),
        "evaluate": _alone(
            "let trained policies drive, protected and disturbed",
            "policies.imitation.evaluation.config:EvaluateConfig",
            "scripts.policy:evaluate",
        ),
    },
    "compare": {
        "compare": _alone(
            "compare datasets, teleop modes or people, and write a report",
            "datasets.comparison.config:CompareConfig",
            "scripts.dataset:compare",
        ),
        "study": _alone(
            "collect, train, evaluate and compare, from one design",
            "policies.study.config:StudyConfig",
            "policies.study.run:run_study",
        ),
        "user-study": _alone(
            "lead people through trials and forms",
            "collect.user_study.config:StudySessionConfig",
            "scripts.session:user_study",
        ),
    },
}
COMMANDS = {name: command for group in GROUPS.values() for name, command in group.items()}
