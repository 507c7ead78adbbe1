"""The operators with a device at this computer, by the names of the command line."""

from collections.abc import Callable, Mapping

from handrail.collect.config import RecordConfig
from handrail.collect.devices import gamepad, spacemouse
from handrail.collect.devices.calibration import (
    calibration_file,
    how_to_calibrate,
    load_calibration,
    same_arm,
)
from handrail.collect.devices.card import Card
from handrail.collect.devices.control_map import ControlMap, control_of, load_map
from handrail.collect.devices.device import Device, StickShape
from handrail.collect.devices.device_reader import DeviceReader
from handrail.collect.devices.follower import Follower
from handrail.collect.devices.gamepad import Gamepad
from handrail.collect.devices.key_bytes import NAMES
from handrail.collect.devices.keyboard import Keyboard, has_terminal
from handrail.collect.devices.leader_arm import LeaderArm, make_teleoperator
from handrail.collect.devices.local_person import LocalPerson
from handrail.collect.devices.spacemouse import SpaceMouse
from handrail.collect.operators.modes import TeleopMode
from handrail.collect.operators.person.inputs import Ask
from handrail.collect.operators.person.person import Person
from handrail.collect.session.build import build_modes
from handrail.collect.teleop_config import TeleopConfig
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels

Say = Callable[[str], None]


def open_gamepad(
    config: RecordConfig, env: HandrailEnv, say: Say, modes: Mapping[str, TeleopMode] | None = None
) -> LocalPerson:
    """Return a person with a gamepad; the keys of the terminal, if there is one, ask for things too.

    Args:
        config: of the recording.
        env: of the recording.
        say: is told what to hold.
        modes: that one can change to; all by default.
    """
    return _with(config, env, say, _gamepad(config.teleop), modes)


def open_spacemouse(config: RecordConfig, env: HandrailEnv, say: Say) -> LocalPerson:
    """Return a person with a SpaceMouse; the keys of the terminal, if there is one, ask for things too."""
    return _with(config, env, say, _spacemouse(config.teleop))


def open_keyboard(config: RecordConfig, env: HandrailEnv, say: Say) -> LocalPerson:
    """Return a person with the keys of this terminal."""
    return _with(config, env, say, _keyboard(config.teleop))


def open_leader_arm(config: RecordConfig, env: HandrailEnv, say: Say) -> LocalPerson:
    """Return a person with a leader arm in one hand, and keys or a gamepad in the other."""
    teleop, description = config.teleop, env.model.description
    modes = _led(build_modes(config, env), env, config.mode_name)
    arm = description.arm_joints
    advice = how_to_calibrate(teleop, config.robot)
    file, twin = calibration_file(teleop, description.name), same_arm(teleop.type, teleop.options, arm)
    calibration = twin if twin and not file.is_file() else load_calibration(file, arm, advice)
    leader = LeaderArm(lambda: make_teleoperator(teleop), teleop.type, calibration.sources)
    device, controls = {"keyboard": _keyboard, "gamepad": _gamepad}[teleop.beside](teleop)
    main, beside = _opened(DeviceReader(leader), DeviceReader(device, controls.only("base")))
    say(f"{teleop.type}: hold {control_of([controls], 'clutch')} on the {teleop.beside} to move the arm")
    return _person(config, env, modes, main, beside, Follower(env.model, calibration))


def _with(
    config: RecordConfig,
    env: HandrailEnv,
    say: Say,
    made: tuple[Device, ControlMap],
    modes: Mapping[str, TeleopMode] | None = None,
) -> LocalPerson:
    """Return a person with a device, and the terminal's keys for what the device has no control for."""
    device, controls = made
    readers = [DeviceReader(device, controls)]
    if device.name != "keyboard" and has_terminal():
        readers.append(DeviceReader(Keyboard(), load_map("keyboard", NAMES).only()))
    _opened(*readers)
    say(f"{device.name}: hold {control_of([controls], 'hold') or 'what moves'} to move")
    modes = modes or build_modes(config, env)
    return _person(config, env, modes, readers[0], (readers[1:] or [None])[0], None)


def _person(
    config: RecordConfig,
    env: HandrailEnv,
    modes: Mapping[str, TeleopMode],
    main: DeviceReader,
    beside: DeviceReader | None,
    follower: Follower | None,
) -> LocalPerson:
    person = Person(env.model, modes, config.mode_name)
    person.ask(Ask("frame", "base"))
    tables = [source.controls for source in (main, beside) if source]
    card = Card(main.device.name, tables, len(env.model.description.base.joints))
    return LocalPerson(person, main, beside, follower, card)


def _opened(*readers: DeviceReader) -> tuple[DeviceReader, ...]:
    """Return devices that are open; where one is not, those before are given back."""
    try:
        return tuple(reader.start() for reader in readers)
    except BaseException:
        for reader in readers:
            reader.close()
        raise


def _shape(teleop: TeleopConfig) -> StickShape:
    return StickShape(teleop.dead_zone, teleop.exponent)


def _gamepad(teleop: TeleopConfig) -> tuple[Device, ControlMap]:
    return Gamepad(_shape(teleop)), load_map("gamepad", gamepad.CONTROLS, teleop.map)


def _spacemouse(teleop: TeleopConfig) -> tuple[Device, ControlMap]:
    return SpaceMouse(_shape(teleop)), load_map("spacemouse", spacemouse.CONTROLS, teleop.map)


def _keyboard(teleop: TeleopConfig) -> tuple[Device, ControlMap]:
    return Keyboard(), load_map("keyboard", NAMES, teleop.map)


def _led(modes: Mapping[str, TeleopMode], env: HandrailEnv, first: str) -> dict[str, TeleopMode]:
    """Return the modes in which the arm's joints can follow a leader."""
    channels = Channels.of(env.model.description)
    arm = channels.mask("arm")
    fit = {
        name: mode
        for name, mode in modes.items()
        if mode.device != "single_axis" and channels.mask(*mode.groups("hand"))[arm].all()
    }
    if first not in fit:
        raise HandrailError(
            f"--operator leader_arm: expected a mode that steers every joint of the arm: "
            f"{', '.join(fit)}; got {first}"
        )
    return fit
