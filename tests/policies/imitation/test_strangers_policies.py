"""A checkpoint from a stranger runs no code and leads nowhere: each attack is one line."""

import json
import os
import pickle
import shutil

import numpy as np
import pytest
from canned import copied
from policy_helpers import untrained_act
from safetensors.numpy import load_file, save_file
from training_helpers import cut, tiny, write_dataset
from training_helpers import refused as untrained

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.evaluation import evaluate
from handrail.policies.imitation.interface.checkpoint import model_folder
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")
PROCESSORS = ("policy_preprocessor.json", "policy_postprocessor.json")
MARKER = "marker"
DEEP = "[" * 200_000


@pytest.fixture
def policy(tmp_path):
    """A folder of a policy's own, for an attack."""
    return copied(tmp_path / "stranger", untrained_act, "realised")


def change(file, **entries):
    content = json.loads(file.read_text())
    file.write_text(json.dumps(content | entries))


def add_step(file, **entry):
    content = json.loads(file.read_text())
    change(file, steps=[*content["steps"], entry])


def refused(folder, words):
    """The law: one line for the loader and for the evaluation, before anything is run."""
    for read in (load_policy, lambda place: evaluate(EvaluateConfig(policy=(str(place),)))):
        with pytest.raises(HandrailError, match=words):
            read(folder)


class Touch:
    """Makes a file when it is unpickled."""

    def __init__(self, path):
        self._path = str(path)

    def __reduce__(self):
        return os.mkdir, (self._path,)


def test_files_and_folders_that_are_called_like_what_a_policy_reads_do_no_harm(policy, tmp_path, monkeypatch):
    """The names in a view are names of numbers, and lead nowhere; a policy's kind may be a folder's name."""
    (home := tmp_path / "home").mkdir()
    interface = json.loads((policy / "handrail.json").read_text())["interface"]
    for name in ("act", "cpu", "STATE", "ENV", "ACTION", "normalizer_processor"):
        (home / name).mkdir()
    for name in ("ridgeback_ur10", "reach", "ee", *interface["state_names"], *interface["channels"]):
        (home / name).touch()
    monkeypatch.chdir(home)
    assert load_policy(policy).meta
    steps = json.loads((policy / PROCESSORS[0]).read_text())["steps"]
    view = {"registry_name": "handrail_policy_view", "config": {"interface": interface}}
    change(policy / PROCESSORS[0], steps=[view, *steps])
    assert load_policy(policy).meta


@pytest.mark.parametrize("file", PROCESSORS)
@pytest.mark.parametrize(
    ("name", "config"),
    [
        ("subprocess.Popen", {"args": ["touch", MARKER]}),
        ("os.mkdir", {"path": MARKER}),
        ("lerobot.processor.normalize_processor.NormalizerProcessorStep", {}),
    ],
)
def test_a_step_named_by_its_class_is_never_made(file, name, config, policy, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    add_step(policy / file, **{"class": name, "config": config})
    refused(policy, f"{file}.*step .*expected a registered name, got the class")
    assert not (tmp_path / MARKER).exists()


NOT_REGISTERED = (
    *({"registry_name": "nothing"}, {"registry_name": ["normalizer_processor"]}, {"config": {}}),
    *({"registry_name": "device_processor", "class": "os.mkdir"}, "os.mkdir", "device_processor", None),
)


@pytest.mark.parametrize("entry", NOT_REGISTERED)
def test_a_step_has_to_be_registered(entry, policy):
    file = policy / PROCESSORS[0]
    change(file, steps=[*json.loads(file.read_text())["steps"], entry])
    refused(policy, "expected a registered")


@pytest.mark.parametrize("kind", ["subprocess.Popen", "os", "../act", ["act"], {"type": "act"}, None, 7, ""])
def test_a_policy_has_to_be_registered(kind, policy):
    change(policy / "config.json", type=kind)
    refused(policy, "unknown policy")


OUTSIDE = (*(f"{place}out.safetensors" for place in ("../", "{}/", "below/")), "link.safetensors", 7)


@pytest.mark.parametrize("place", OUTSIDE)
def test_the_numbers_of_a_step_lie_in_the_folder(place, policy, tmp_path):
    file, outside = policy / PROCESSORS[0], tmp_path / "out.safetensors"
    (policy / "below").mkdir()
    for path in (outside, policy / "below" / "out.safetensors"):
        save_file({}, path)
    if place == "link.safetensors":
        (policy / place).symlink_to(outside)
    steps = json.loads(file.read_text())["steps"]
    steps[-1]["state_file"] = place.format(tmp_path) if isinstance(place, str) else place
    change(file, steps=steps)
    linked = place == "link.safetensors"
    refused(policy, "a link out of it" if linked else "expected a .safetensors file in the folder")


@pytest.mark.parametrize("name", ["model.safetensors", "config.json", "handrail.json", *PROCESSORS])
def test_no_file_is_a_link_out_of_the_folder(name, policy, tmp_path):
    shutil.move(policy / name, tmp_path / "outside")
    (policy / name).symlink_to(tmp_path / "outside")
    refused(policy, f"{name}.*expected a file in the folder, found a link out of it")


@pytest.mark.parametrize("name", ["model.safetensors", "config.json", "handrail.json", "new", *PROCESSORS])
def test_a_file_of_a_checkpoint_is_no_named_pipe(name, policy):
    (policy / name).unlink(missing_ok=True)
    os.mkfifo(policy / name)
    refused(policy, "expected .* found")
    (policy / name).unlink()
    (policy / name).symlink_to(name)
    refused(policy, "expected|Too many levels")


def test_a_checkpoint_does_not_lead_out_of_the_training_s_folder(policy, tmp_path):
    step = tmp_path / "training" / "checkpoints" / "000001"
    step.mkdir(parents=True)
    (step / "pretrained_model").symlink_to(policy)
    with pytest.raises(HandrailError, match="found a link out of it"):
        model_folder(tmp_path / "training")
    assert model_folder(step / "pretrained_model") == step / "pretrained_model"  # asked for by name


@pytest.mark.parametrize("name", ["model.safetensors", "pytorch_model.bin"])
def test_weights_are_safetensors(name, policy, tmp_path):
    (policy / "model.safetensors").unlink()
    (policy / name).write_bytes(pickle.dumps(Touch(tmp_path / "marker")))
    refused(policy, "stranger")
    assert not (tmp_path / "marker").exists()


@pytest.mark.parametrize("place", ["repository", "folder", "absolute"])
def test_settings_name_nothing_that_lies_elsewhere(place, policy, tmp_path, monkeypatch):
    """A tokenizer of another place comes with code of its own."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "evil").mkdir()
    name = {"repository": "evil/evil", "folder": "evil", "absolute": str(tmp_path / "evil")}[place]
    config = {"action_tokenizer_name": name, "trust_remote_code": True}
    file = policy / PROCESSORS[0]
    before = file.read_text()
    add_step(file, registry_name="action_tokenizer_processor", config=config)
    refused(policy, "evil.*names .*elsewhere")
    file.write_text(before)
    change(policy / "config.json", vision_backbone=name)
    refused(policy, "evil.*names .*elsewhere")


@pytest.mark.parametrize("name", ["config.json", "handrail.json", *PROCESSORS])
def test_a_malformed_file_is_one_line(name, policy):
    for content in (DEEP, '{"a":' * 200_000, "", "[]", "nul", b"\xff", '{"fps": NaN}'):
        (policy / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        refused(policy, "stranger")


OF_A_POLICY = (
    *(("robot", value) for value in ("../evil.toml", "/etc/evil.toml")),
    *(("fps", value) for value in (0, "many", 10**9)),
    *(("mode", value) for value in ("[/x]", ["ee"])),
    *(("actions", value) for value in ("targets", "recorded", "intent")),  # targets: of an older Handrail
    *(("training_seed", value) for value in (-1, True)),
    *(("trained_on", value) for value in ({"episodes": "many"}, [])),
    *(("sizes", value) for value in ({"steps": "many"}, {"options": []})),
    *(("interface", value) for value in ([], {"actions": "realised"})),
    *(("environment", ["reach"]), ("nonsense", 1)),
)
OF_AN_INTERFACE = (
    *(("state_names", "abc"), ("channels", [1]), ("masks", [[True]]), ("masks", 3)),
    *(("actions", {}), ("actions", "targets")),
)


@pytest.mark.parametrize(("entry", "value"), OF_A_POLICY)
def test_a_policy_s_description_is_checked(entry, value, policy):
    change(policy / "handrail.json", **{entry: value})
    refused(policy, entry)


@pytest.mark.parametrize(("entry", "value"), OF_AN_INTERFACE)
def test_an_interface_s_description_is_checked(entry, value, policy):
    interface = json.loads((policy / "handrail.json").read_text())["interface"]
    change(policy / "handrail.json", interface=interface | {entry: value})
    refused(policy, f"interface: {entry}")


def test_a_training_that_goes_on_runs_no_code_either(tmp_path):
    config = tiny(write_dataset(tmp_path / "set"), tmp_path / "policy", steps=3)
    folder = train(config)
    step = {"class": "os.mkdir", "config": {"path": str(tmp_path / "marker")}}
    add_step(folder / PROCESSORS[0], **step)
    resumed = tiny(tmp_path / "set", tmp_path / "policy", steps=6, resume=True)
    untrained(resumed, "expected a registered name, got the class")
    assert not (tmp_path / "marker").exists()
    state = folder.parent / "training_state"
    shutil.move(state / "rng_state.safetensors", tmp_path / "outside")
    (state / "rng_state.safetensors").symlink_to(tmp_path / "outside")
    untrained(resumed, "rng_state.*found a link out of it")


def spoil(file, how):
    """Give one array of a safetensors file another name or a NaN, or leave it out."""
    arrays = {name: values.copy() for name, values in load_file(file).items()}
    name = "model.action_head.weight" if "model.action_head.weight" in arrays else "observation.state.mean"
    values = arrays[name]
    if how in ("foreign", "missing"):
        gone = {key for key in arrays if key.startswith(name.removesuffix("mean"))}
        arrays = {key: each for key, each in arrays.items() if key not in gone}
    if how == "foreign":
        arrays["stranger.mean"] = values
    if how == "nan":
        values.flat[0] = np.nan
    if how == "endless":
        values.flat[0] = np.inf
    save_file(arrays, file)


@pytest.mark.parametrize("how", ["foreign", "missing", "nan", "endless"])
@pytest.mark.parametrize("file", ["model", "policy_preprocessor_*_normalizer_processor"])
def test_weights_and_statistics_are_the_policy_s_and_finite(file, how, trained, tmp_path):
    """Law: a policy that would drive at random is refused, to be evaluated and to learn on."""
    config = cut(trained[1], tmp_path / "training")
    place = model_folder(config.folder)
    (spoilt,) = place.glob(f"{file}.safetensors")
    assert load_policy(place).meta
    spoil(spoilt, how)
    refused(place, "policy '.*training")
    untrained(config, "policy '.*training")
