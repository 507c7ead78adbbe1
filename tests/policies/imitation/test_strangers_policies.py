"""A checkpoint from a stranger runs no code and leads nowhere: each attack is one line."""

import json
import os
import pickle
import shutil

import pytest
from command_helpers import command
from policy_helpers import untrained_act
from safetensors.numpy import save_file
from training_helpers import tiny, write_dataset

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.evaluation import evaluate
from handrail.policies.imitation.interface.checkpoint import model_folder
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")
PROCESSORS = ("policy_preprocessor.json", "policy_postprocessor.json")
DEEP = "[" * 200_000


@pytest.fixture(scope="module")
def honest(tmp_path_factory):
    return untrained_act(tmp_path_factory.mktemp("honest") / "policy", "realised")


@pytest.fixture
def policy(honest, tmp_path):
    """A folder of a policy's own, for an attack."""
    return shutil.copytree(honest, tmp_path / "stranger")


def change(file, **entries):
    content = json.loads(file.read_text())
    file.write_text(json.dumps(content | entries))


def add_step(file, **entry):
    content = json.loads(file.read_text())
    change(file, steps=[*content["steps"], entry])


def refused(folder, words):
    """The law: one line for the loader and for the evaluation, before anything is run."""
    for read in (load_policy, lambda place: evaluate(EvaluateConfig(policy=(str(place),)))):
        with pytest.raises(HandrailError, match=words) as raised:
            read(folder)
        assert "\n" not in str(raised.value)


class Touch:
    """Makes a file when it is unpickled."""

    def __init__(self, path):
        self._path = str(path)

    def __reduce__(self):
        return os.mkdir, (self._path,)


def test_what_is_honest_is_loaded(policy):
    assert load_policy(policy).meta


def test_files_that_are_called_like_what_a_policy_reads_do_no_harm(policy, tmp_path, monkeypatch):
    """The names in a view are names of numbers, and lead nowhere."""
    (home := tmp_path / "home").mkdir()
    interface = json.loads((policy / "handrail.json").read_text())["interface"]
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
        ("subprocess.Popen", lambda marker: {"args": ["touch", marker]}),
        ("subprocess.check_call", lambda marker: {"args": ["touch", marker]}),
        ("os.mkdir", lambda marker: {"path": marker}),
        ("lerobot.processor.normalize_processor.NormalizerProcessorStep", lambda marker: {}),
    ],
)
def test_a_step_named_by_its_class_is_never_made(file, name, config, policy, tmp_path):
    marker = tmp_path / "marker"
    add_step(policy / file, **{"class": name, "config": config(str(marker))})
    refused(policy, f"{file}.*step .*expected a registered name, got the class")
    assert not marker.exists()


@pytest.mark.parametrize(
    "entry",
    [
        {"registry_name": "nothing"},
        {"registry_name": ["normalizer_processor"]},
        {"registry_name": "device_processor", "class": "os.mkdir"},
        {"config": {}},
        "os.mkdir",
        None,
    ],
)
def test_a_step_has_to_be_registered(entry, policy):
    file = policy / PROCESSORS[0]
    change(file, steps=[*json.loads(file.read_text())["steps"], entry])
    refused(policy, "expected a registered")


@pytest.mark.parametrize("kind", ["subprocess.Popen", "os", "../act", ["act"], {"type": "act"}, None, 7, ""])
def test_a_policy_has_to_be_registered(kind, policy):
    change(policy / "config.json", type=kind)
    refused(policy, "unknown policy")


@pytest.mark.parametrize("where", ["above", "absolute", "below", "link", "number"])
def test_the_numbers_of_a_step_lie_in_the_folder(where, policy, tmp_path):
    file = policy / PROCESSORS[0]
    steps = json.loads(file.read_text())["steps"]
    outside = tmp_path / "outside.safetensors"
    (policy / "below").mkdir()
    for place in (outside, policy / "below" / "outside.safetensors"):
        save_file({}, place)
    (policy / "link.safetensors").symlink_to(outside)
    steps[-1]["state_file"] = {
        "above": "../outside.safetensors",
        "absolute": str(outside),
        "below": "below/outside.safetensors",
        "link": "link.safetensors",
        "number": 7,
    }[where]
    change(file, steps=steps)
    refused(policy, "stranger")


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
    with pytest.raises(HandrailError, match="stranger") as raised:
        load_policy(policy)
    assert "\n" not in str(raised.value)
    assert command("--policy", policy, "--episodes", 1, name="evaluate").returncode == 2
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


def test_a_policy_is_loaded_beside_folders_of_any_name(policy, tmp_path, monkeypatch):
    """Its kind is `act`, and so may be the folder that it was trained into."""
    monkeypatch.chdir(tmp_path)
    for name in ("act", "cpu", "STATE", "ENV", "ACTION", "normalizer_processor"):
        (tmp_path / name).mkdir()
    assert load_policy(policy).meta


def test_what_pytorch_says_at_length_is_cut(policy):
    change(policy / "config.json", dim_model=64)
    with pytest.raises(HandrailError, match=r"size mismatch .* …$") as raised:
        load_policy(policy)
    assert len(str(raised.value)) < 600


@pytest.mark.parametrize("name", ["config.json", "handrail.json", *PROCESSORS])
def test_a_malformed_file_is_one_line(name, policy):
    for content in (DEEP, '{"a":' * 200_000, "", "[]", "nul", b"\xff", '{"fps": NaN}'):
        (policy / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        refused(policy, "stranger")


@pytest.mark.parametrize(
    ("entry", "value"),
    [
        ("robot", "../evil.toml"),
        ("robot", "/etc/evil.toml"),
        ("fps", 0),
        ("fps", "many"),
        ("fps", 10**9),
        ("mode", "[/x]"),
        ("mode", ["ee"]),
        ("environment", ["reach"]),
        ("actions", "targets"),  # joint positions, which an older Handrail had
        ("training_seed", -1),
        ("training_seed", True),
        ("trained_on", {"episodes": "many"}),
        ("trained_on", []),
        ("sizes", {"steps": "many"}),
        ("sizes", {"options": []}),
        ("actions", "recorded"),
        ("actions", "intent"),
        ("nonsense", 1),
        ("interface", []),
        ("interface", {"actions": "realised"}),
    ],
)
def test_what_a_policy_says_of_itself_is_checked(entry, value, policy):
    change(policy / "handrail.json", **{entry: value})
    refused(policy, entry)


@pytest.mark.parametrize(
    ("entry", "value"),
    [
        ("state_names", "abc"),
        ("channels", [1]),
        ("masks", [[True]]),
        ("masks", 3),
        ("actions", {}),
        ("actions", "targets"),
    ],
)
def test_what_an_interface_says_is_checked(entry, value, policy):
    interface = json.loads((policy / "handrail.json").read_text())["interface"]
    change(policy / "handrail.json", interface=interface | {entry: value})
    refused(policy, "interface|action space")


def test_a_training_that_goes_on_runs_no_code_either(tmp_path):
    config = tiny(write_dataset(tmp_path / "set"), tmp_path / "policy", steps=3)
    folder = train(config, quiet=True)
    step = {"class": "os.mkdir", "config": {"path": str(tmp_path / "marker")}}
    add_step(folder / PROCESSORS[0], **step)
    resumed = tiny(tmp_path / "set", tmp_path / "policy", steps=6, resume=True)
    with pytest.raises(HandrailError, match="expected a registered name, got the class"):
        train(resumed, quiet=True)
    assert not (tmp_path / "marker").exists()
    state = folder.parent / "training_state"
    shutil.move(state / "rng_state.safetensors", tmp_path / "outside")
    (state / "rng_state.safetensors").symlink_to(tmp_path / "outside")
    with pytest.raises(HandrailError, match=r"rng_state.*found a link out of it"):
        train(resumed, quiet=True)
