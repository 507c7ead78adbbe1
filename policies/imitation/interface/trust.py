"""The check of a checkpoint's content before LeRobot loads it: loading it never runs code of its maker's.

LeRobot imports and calls whatever `class` a processor's JSON names, reads what its paths lead to, and some of
its policies fetch networks and tokenizers, with code, from where their settings say. So here

- a policy and every step of its processors are called by the names under which they are registered,
- weights and numbers are safetensors in the folder itself, and no file is a link out of it,
- no setting names a file, a folder or a repository, but for those that are LeRobot's own defaults.
"""

import contextlib
import functools
import importlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, fields
from pathlib import Path, PurePath
from typing import Any

from handrail.controllers.errors import HandrailError, shown, unknown_name
from handrail.controllers.regular_file import is_inside, regular
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.strict_json import load_json

CONFIG, WEIGHTS = "config.json", "model.safetensors"
PROCESSORS = ("policy_preprocessor.json", "policy_postprocessor.json")
VIEW, ACT, COMPLETE = "handrail_policy_view", "handrail_policy_action", "handrail_policy_mpc"
ENCODE = "handrail_policy_encoder"
"""Our own steps (`steps.py`): their settings are names, which they check themselves."""
# notes, by which nothing is loaded
_NOTES = ("pretrained_path", "pretrained_revision", "repo_id", "license", "tags")
# what names no place: kinds are registered names, the device is the user's, a state file is checked by
# itself, the rest are names of numbers
_NO_PLACE = ("type", "device", "registry_name", "state_file", "action_names", "action_feature_names")


def check_links(folder: Path) -> None:
    """Check that everything in a folder lies in it, and is a file or a folder."""
    for path in sorted(folder.glob("*")):
        if not is_inside(path, folder):
            words = "expected a file in the folder, found a link out of it; copy it with cp -rL"
            raise HandrailError(f"{str(path)!r}: {words}")
        with explained(repr(str(path))):
            if not path.is_dir():
                regular(path)


def check_policy_folder(folder: Path, asked: Iterable[Any] = ()) -> dict[str, Any]:
    """Check all that LeRobot would load from a folder; return the settings of the policy, but for notes.

    Args:
        folder: `pretrained_model` of a checkpoint.
        asked: what the user gave themselves; it may name other places.
    """
    check_links(folder)
    path = folder / CONFIG
    settings, kinds = load_json(path, "a policy of LeRobot"), registered_policies()
    kind = settings.get("type") if isinstance(settings, dict) else None
    if not isinstance(kind, str) or kind not in kinds:
        raise HandrailError(f"{str(path)!r}: {unknown_name('policy', kind, kinds)}")
    settings = {key: value for key, value in settings.items() if key not in _NOTES}
    known = {*_texts(_defaults(kinds[kind])), *_texts(list(asked))}
    _check_places(path, settings, known)
    for path in (folder / name for name in PROCESSORS):
        for step in _steps(path, kinds[kind]):
            if step["registry_name"] not in (ENCODE, VIEW, ACT, COMPLETE):
                _check_places(path, step, known)
    if not (folder / WEIGHTS).is_file():
        raise HandrailError(f"policy {str(folder)!r}: expected weights in {WEIGHTS}, found none")
    return settings


@functools.cache  # LeRobot looks through all installed packages
def registered_policies() -> Mapping[str, type]:
    """Return the policies that LeRobot knows, by name; those of installed plugins too."""
    import lerobot.policies  # noqa: F401  (registers its own)
    from lerobot.configs.policies import PreTrainedConfig
    from lerobot.utils.import_utils import register_third_party_plugins

    register_third_party_plugins()
    return PreTrainedConfig.get_known_choices()


def _steps(path: Path, policy: type) -> list[dict[str, Any]]:
    """Return the steps of a processor, each registered, with its numbers in the folder."""
    from lerobot.processor.pipeline import ProcessorStepRegistry

    import handrail.policies.imitation.interface.steps  # noqa: F401  (registers those of handrail-train)

    content = load_json(path, "a processor of LeRobot")
    steps = content.get("steps") if isinstance(content, dict) else None
    if not isinstance(steps, list):
        raise HandrailError(f"{str(path)!r}: expected a processor with steps, got {shown(content)}")
    with contextlib.suppress(ImportError):  # what a policy's own steps lack is said when it is loaded
        importlib.import_module(policy.__module__.replace("configuration_", "processor_"))
    known = ProcessorStepRegistry.list()
    for number, step in enumerate(steps):
        where = f"{str(path)!r}: step {number}"
        entry = step if isinstance(step, dict) else {}
        if "class" in entry:
            raise HandrailError(f"{where}: expected a registered name, got the class {shown(entry['class'])}")
        if entry.get("registry_name") not in known:
            raise HandrailError(f"{where}: expected a registered name, got {shown(step)}")
        file = entry.get("state_file", "")
        plain = isinstance(file, str) and PurePath(file).name == file and file.endswith(".safetensors")
        if "state_file" in entry and not (plain and (path.parent / file).is_file()):
            raise HandrailError(f"{where}: expected a .safetensors file in the folder, got {shown(file)}")
    return steps


def _check_places(path: Path, settings: Any, known: Iterable[str]) -> None:
    """Check that settings name no other place."""
    for text in set(_texts(settings)).difference(known):
        if "/" in text or "\\" in text or (text and _is_there(text)):
            words = f"got {shown(text)}, which names a file, a folder or a repository elsewhere"
            raise HandrailError(f"{str(path)!r}: expected settings of the policy alone, {words}")


def _defaults(kind: type) -> Iterator[Any]:
    for entry in fields(kind):
        if entry.default is not MISSING:
            yield entry.default
        elif entry.default_factory is not MISSING:
            yield entry.default_factory()


def _texts(content: Any) -> Iterator[str]:
    """Yield every text in settings that may name a place, whatever holds it; not the keys."""
    if isinstance(content, str):
        yield str.__str__(content)  # the value of an enumeration too
    elif isinstance(content, PurePath):
        yield str(content)
    elif isinstance(content, Mapping):
        content = [value for key, value in content.items() if key not in _NO_PLACE]
    elif hasattr(content, "__dataclass_fields__"):
        content = vars(content).values()
    if isinstance(content, Iterable) and not isinstance(content, str | bytes):
        for each in content:
            yield from _texts(each)


def _is_there(text: str) -> bool:
    try:
        return Path(text).expanduser().exists()
    except (OSError, ValueError):
        return False
