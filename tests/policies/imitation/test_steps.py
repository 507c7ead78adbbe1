"""A checkpoint of handrail-train carries its view: LeRobot's plain loading runs it, to the same numbers."""

import json
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import torch
from lerobot.configs.policies import PreTrainedConfig
from lerobot.policies.factory import get_policy_class, make_pre_post_processors
from training_helpers import CHANNELS, ENVIRONMENT, STATE, frame, tiny

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.steps import (
    PolicyActionStep,
    PolicyCompletionStep,
    PolicyViewStep,
    with_steps,
)
from handrail.policies.imitation.interface.trained import load_policy
from handrail.policies.imitation.training.training import train

MASKS = tuple(sorted(tuple(CHANNELS.mask(group).tolist()) for group in ("ee", "base")))
FRESH = """
import sys
import handrail.policies.lerobot
from lerobot.configs.policies import PreTrainedConfig
from lerobot.policies.factory import make_pre_post_processors
before, after = make_pre_post_processors(PreTrainedConfig.from_pretrained(sys.argv[1]), sys.argv[1])
print(*(step._registry_name for step in (*before.steps, *after.steps)))
"""


@pytest.fixture(scope="module", params=["realised", "intent"])
def checkpoint(request, recorded, tmp_path_factory):
    output = tmp_path_factory.mktemp(request.param) / "policy"
    return request.param, train(tiny(recorded, output, actions=request.param, steps=3), quiet=True)


def seen():
    row = frame(np.random.default_rng(7))
    return {
        key: np.asarray(row[key], np.float32)
        for key in ("observation.state", "observation.environment_state")
    }


def test_plain_loading_acts_as_the_interface_does(checkpoint):
    """What LeRobot's evaluation does with a checkpoint, and what ours does with it, are the same."""
    _, trained = checkpoint
    config = PreTrainedConfig.from_pretrained(trained)
    policy = get_policy_class(config.type).from_pretrained(trained, config=config)
    before, after = make_pre_post_processors(config, str(trained))
    steps: list[Any] = list(after.steps)
    if isinstance(steps[-1], PolicyCompletionStep):  # has a test of its own
        after.steps = [*steps[:-1], PolicyActionStep(steps[-1].interface)]
    ours, raw = load_policy(trained), seen()
    state, environment = raw.values()
    acted = []
    for _ in range(3):
        batch = before({key: torch.from_numpy(values)[None] for key, values in raw.items()})
        with torch.inference_mode():
            theirs = after(policy.select_action(batch))[0].numpy()
        acted.append(ours.act(*ours.interface.observe(state, environment)))
        meant = ours.interface.decode(acted[-1], state)
        np.testing.assert_array_equal(theirs[:-1], meant.values[meant.mask])
        assert theirs[-1] == meant.gripper
    assert not np.array_equal(acted[0], acted[1])  # the next of the chunk
    ours.reset()
    np.testing.assert_array_equal(ours.act(*ours.interface.observe(state, environment)), acted[0])


def steps_of(*masks):
    """Return an interface, and the steps that see and act through it."""
    interface = PolicyInterface("intent" if masks else "realised", STATE, ENVIRONMENT, CHANNELS.names, masks)
    described = json.loads(json.dumps(interface.__dict__, default=list))
    return interface, PolicyViewStep(described), PolicyActionStep(described)


def test_a_mask_becomes_the_focus_and_what_is_no_number_stays_none():
    interface, view, act = steps_of(*MASKS)
    raw = {key: torch.from_numpy(values)[None] for key, values in seen().items()}
    view({"observation": raw})
    size = len(interface.action_names)
    for chosen, mask in enumerate(MASKS):
        action = torch.zeros(1, size)
        action[0, size - 3 + chosen] = 1.0
        assert act({"action": action})["action"][0, -2] == float(mask[0])
    assert act({"action": torch.full((1, size), torch.nan)})["action"].isnan().any()


def test_what_was_not_seen_or_does_not_fit_is_said():
    _, view, act = steps_of()
    with pytest.raises(HandrailError, match="to see something first"):
        act({"action": torch.zeros(1, 10)})
    with pytest.raises(HandrailError, match=rf"expected observation\.state with {len(STATE)} numbers"):
        view({"observation": {"observation.state": torch.zeros(1, 3)}})
    with pytest.raises(HandrailError, match="actions: expected one of realised, intent"):
        PolicyViewStep(view.interface | {"actions": "none"})


def test_nothing_is_added_where_the_policy_reads_what_is_recorded():
    around = object(), object()
    assert with_steps(*around, None) == around


def test_a_checkpoint_of_intents_says_what_completes_them(checkpoint):
    actions, folder = checkpoint
    steps = json.loads((folder / "policy_postprocessor.json").read_text())["steps"]
    completes = [step["config"]["completion"] for step in steps if "completion" in step["config"]]
    by = {"robot": "ridgeback_ur10", "task": "reach", "mode": "ee", "fps": 20}
    assert completes == ([by] if actions == "intent" else [])


@pytest.mark.slow
def test_a_fresh_process_that_discovers_our_package_loads_it(checkpoint):
    actions, trained = checkpoint
    done = subprocess.run([sys.executable, "-c", FRESH, str(trained)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "handrail_policy_view" in done.stdout
    acts = {"intent": "handrail_policy_mpc", "realised": "handrail_policy_action"}
    assert acts[actions] in done.stdout


def test_a_training_that_goes_on_keeps_the_steps_and_adds_none(recorded, tmp_path):
    begun = train(tiny(recorded, tmp_path / "policy", steps=2), quiet=True)
    gone_on = train(tiny(recorded, tmp_path / "policy", steps=4, resume=True), quiet=True)
    for processor in ("policy_preprocessor.json", "policy_postprocessor.json"):
        assert (gone_on / processor).read_bytes() == (begun / processor).read_bytes()
