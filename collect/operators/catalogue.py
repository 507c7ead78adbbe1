"""The operators by name; light to import."""

from dataclasses import dataclass

from handrail.controllers.registry import Buildable, Registry


@dataclass(frozen=True)
class OperatorSpec(Buildable):
    """An operator: one entry makes it, by `(model, mode, task, human) -> Operator`.

    It gets the robot's model, the `TeleopMode`, the `TaskSpec`, and the `HumanSettings` of the person.
    """

    interactive: bool = False
    """Whether it is someone now at this computer: in real time, free to change the mode."""


_DEVICES = "handrail.collect.devices.open_devices"


def _device(name: str, help: str, opened: str = "open_device") -> OperatorSpec:
    return OperatorSpec(name, f"{_DEVICES}:{opened}", help, interactive=True)


OPERATORS = Registry(
    "operator",
    OperatorSpec,
    (
        OperatorSpec(
            "scripted",
            "handrail.collect.operators.scripted.scripted:scripted_operator",
            "a script with a human-like hand",
        ),
        OperatorSpec(
            "supervisor",
            "handrail.collect.operators.shared.supervisor:supervisor",
            "a script that watches a policy (--policy) and helps where it gets no further",
        ),
        OperatorSpec(
            "hand_supervisor",
            "handrail.collect.operators.shared.supervisor:hand_supervisor",
            "as supervisor, but helps with the hand alone and leaves the base to the policy",
        ),
        OperatorSpec(
            "browser",
            "handrail.collect.cockpit.cockpit:open_cockpit",
            "a person at a browser, with keys, a gamepad or touch",
            interactive=True,
        ),
        _device("gamepad", "a person with a gamepad at this computer"),
        _device("spacemouse", "a person with a SpaceMouse"),
        _device("keyboard", "a person with the keys of this terminal"),
        _device("leader_arm", "a person with a leader arm of LeRobot's (--teleop.type)", "open_leader_arm"),
    ),
)
