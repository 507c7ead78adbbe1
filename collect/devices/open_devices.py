"""The operators with a device at this computer, by the names of the command line."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack

from handrail.collect.config import RecordConfig
from handrail.collect.devices import gamepad, spacemouse
from handrail.collect.devices.calibration import (
    calibration_file,
    how_to_calibrate,
    load_calibration,
    same_arm,
)
from handrail.collect.devices.control_map import CLUTCH, HOLD, control_of, load_map
from handrail.collect.devices.device import StickShape
from handrail.collect.devices.device_reader import DeviceReader
from handrail.collect.devices.follower import Follower
from handrail.collect.devices.gamepad import Gamepad
from handrail.collect.devices.key_bytes import NAMES
from handrail.collect.devices.keyboard import Keyboard, has_terminal
from handrail.collect.devices.leader_arm import LeaderArm, make_teleoperator
from handrail.collect.devices.local_person import LocalPerson
from handrail.collect.devices.spacemouse import SpaceMice, SpaceMouse
from handrail.collect.operators.modes import TeleopMode
from handrail.collect.operators.person.inputs import Ask
from handrail.collect.operators.person.person import Person
from handrail.collect.session.build import build_modes
from handrail.collect.teleop_config import TeleopConfig
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels

Say = Callable[[str], None]


def open_device(
    config: RecordConfig,
    env: HandrailEnv,
    say: Say,
    modes: Mapping[str, TeleopMode] | None = None,
    with_keys: bool = True,
) -> LocalPerson:
    """Return a person with the device that the operator is named after.

    The keys of the terminal, if there is one, ask for what the device has no control for.

    Args:
        config: of the recording.
        env: of the recording.
        say: is told what to hold.
        modes: that one can change to; all by default.
        with_keys: whether the terminal's keys are free to be read.
    """
    hands = len(env.model.description.hands)
    main, beside = _reader(config.operator, config.teleop, hands, bool(config.policy)), None
    if with_keys and config.operator != "keyboard" and has_terminal():
        beside = _reader("keyboard", TeleopConfig(), hands)
        beside.controls = beside.controls.only()
    person = _person(config, env, modes or build_modes(config, env), main, beside)
    say(f"{config.operator}: hold {control_of([main.controls], HOLD) or 'a key or cap'} to move")
    return person


def open_leader_arm(config: RecordConfig, env: HandrailEnv, say: Say) -> LocalPerson:
    """Return a person with a leader arm in one hand, and keys or a gamepad in the other."""
    teleop, description = config.teleop, env.model.description
    modes = _led(build_modes(config, env), env, config.mode_name)
    arm, file = description.arm_joints, calibration_file(teleop, description.name)
    twin = None if file.is_file() else same_arm(teleop, arm)
    calibration = twin or load_calibration(file, arm, how_to_calibrate(teleop, config.robot))
    main = DeviceReader(LeaderArm(lambda: make_teleoperator(teleop), teleop.type, calibration.sources))
    beside = _reader(teleop.beside, teleop, len(description.hands), bool(config.policy))
    beside.controls = beside.controls.only("base")
    person = _person(config, env, modes, main, beside, Follower(env.model, calibration))
    say(f"{teleop.type}: hold {control_of([beside.controls], CLUTCH)} on the {teleop.beside} to move the arm")
    return person


def _reader(name: str, teleop: TeleopConfig, hands: int, shared: bool = False) -> DeviceReader:
    """Return the reader of a device, with the map of the settings for so many hands.

    Beside a policy nobody supervises with nothing held, unless what they have in hand answers.
    """
    shape = StickShape(teleop.dead_zone, teleop.exponent)
    known = {"gamepad": gamepad.CONTROLS, "spacemouse": spacemouse.CONTROLS, "keyboard": NAMES}[name]
    controls = load_map(name, known, teleop.map, hands)
    alone = shared and HOLD not in controls.actions.values()
    if alone and name != "keyboard":
        raise HandrailError(f'{name} beside --policy: expected a control to "hold" (--teleop.map), got none')
    device = {
        "gamepad": Gamepad(shape),
        "spacemouse": SpaceMice(shape) if hands > 1 else SpaceMouse(shape),
        "keyboard": Keyboard(stops=controls.stops, supervises=alone),
    }[name]
    return DeviceReader(device, controls)


def _person(
    config: RecordConfig,
    env: HandrailEnv,
    modes: Mapping[str, TeleopMode],
    main: DeviceReader,
    beside: DeviceReader | None,
    follower: Follower | None = None,
) -> LocalPerson:
    """Return the person, their devices opened; where one cannot be, those before are given back."""
    alone = config.policy and not control_of([main.controls], HOLD)  # with no dead-man to let go of
    person = Person(env.model, modes, config.mode_name, supervises=bool(alone))
    person.ask(Ask("frame", "base"))
    with ExitStack() as stack:
        for reader in filter(None, (main, beside)):
            stack.callback(reader.close)
            reader.start()
        tables = [reader.controls for reader in (main, beside) if reader]
        for actions in (("start", "start_or_pause"), ("stop",)):
            if not control_of(tables, *actions):
                raise HandrailError(f"{config.operator}: no control to {actions[0]}; use a terminal or a map")
        stack.pop_all()
    return LocalPerson(person, main, beside, follower, bool(config.policy))


def _led(modes: Mapping[str, TeleopMode], env: HandrailEnv, first: str) -> dict[str, TeleopMode]:
    """Return the modes in which the arm's joints can follow a leader."""
    channels = Channels.of(env.model.description)
    arm = channels.mask("arm")
    fit = {
        name: mode
        for name, mode in modes.items()
        if not mode.device.startswith("single_axis") and channels.mask(*mode.owned("hand"))[arm].all()
    }
    if first not in fit:
        raise HandrailError(
            f"--operator leader_arm: expected a mode that steers every joint of the arm: "
            f"{', '.join(fit)}; got {first}"
        )
    return fit
