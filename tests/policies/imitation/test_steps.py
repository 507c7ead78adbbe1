"""A checkpoint carries its view: plain loading runs it, to the same numbers, and completes its intents."""

import dataclasses
import json
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import torch
from gymnasium.vector import SyncVectorEnv
from lerobot.configs.policies import PreTrainedConfig
from lerobot.envs.factory import make_env, make_env_config
from lerobot.envs.utils import preprocess_observation
from lerobot.policies.factory import get_policy_class, make_pre_post_processors
from lerobot.processor import PolicyProcessorPipeline
from training_helpers import CHANNELS, ENVIRONMENT, STATE, frame, tiny

import handrail.collect.lerobot.plugins  # noqa: F401  (registers the environment)
from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_env
from handrail.collect.world.observation import to_numbers
from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.steps import (
    Completion,
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
BY = Completion("ridgeback_ur10", "pick_place", "ee", 20)
STEPS = 12


@pytest.fixture(scope="module")
def interface():
    env = build_env(SessionConfig(task=BY.task), BY.fps)
    mask = tuple(CHANNELS.mask("ee").tolist())
    return PolicyInterface("intent", env.agent_names, env.state_names, CHANNELS.names, (mask,))


def steps(interface, by=BY):
    """Return the steps that see through an interface, act through it, and complete its intents."""
    said = json.loads(json.dumps(dataclasses.asdict(interface)))
    view = PolicyViewStep(said)
    return view, PolicyActionStep(said), PolicyCompletionStep(said, dataclasses.asdict(by))


@pytest.fixture(scope="module", params=["realised", "intent"])
def checkpoint(request, recorded, tmp_path_factory):
    output = tmp_path_factory.mktemp(request.param) / "policy"
    return request.param, train(tiny(recorded, output, actions=request.param, steps=3))


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
        acted.append(ours.act(*ours.meta.interface.observe(state, environment)))
        meant = ours.meta.interface.decode(acted[-1], state)
        np.testing.assert_array_equal(theirs[:-1], meant.values[meant.mask])
        assert theirs[-1] == meant.grippers[0]
    assert not np.array_equal(acted[0], acted[1])  # the next of the chunk
    ours.reset()
    np.testing.assert_array_equal(ours.act(*ours.meta.interface.observe(state, environment)), acted[0])


def test_a_mask_becomes_the_focus_and_what_is_no_number_stays_none():
    interface = PolicyInterface("intent", STATE, ENVIRONMENT, CHANNELS.names, MASKS)
    view, act, _ = steps(interface)
    raw = {key: torch.from_numpy(values)[None] for key, values in seen().items()}
    view({"observation": raw})
    size = len(interface.action_names)
    for chosen, mask in enumerate(MASKS):
        action = torch.zeros(1, size)
        action[0, size - 3 + chosen] = 1.0
        assert act({"action": action})["action"][0, -2] == float(mask[0])
    assert act({"action": torch.full((1, size), torch.nan)})["action"].isnan().any()


def test_missing_or_misfit_observations_are_refused():
    view, act, _ = steps(PolicyInterface("realised", STATE, ENVIRONMENT, CHANNELS.names))
    with pytest.raises(HandrailError, match="to see something first"):
        act({"action": torch.zeros(1, 10)})
    with pytest.raises(HandrailError, match=rf"expected observation\.state with {len(STATE)} numbers"):
        view({"observation": {"observation.state": torch.zeros(1, 3)}})
    with pytest.raises(HandrailError, match="actions: expected one of realised, intent"):
        PolicyViewStep(view.interface | {"actions": "none"})


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
    begun = train(tiny(recorded, tmp_path / "policy", steps=2))
    gone_on = train(tiny(recorded, tmp_path / "policy", steps=4, resume=True))
    for processor in ("policy_preprocessor.json", "policy_postprocessor.json"):
        assert (gone_on / processor).read_bytes() == (begun / processor).read_bytes()


def driven(interface, completes, seeds=(5,), fail_at=None, by=BY):
    """Return the robot's states while a policy asks for the same twist all the time."""
    view, acts, completion = steps(interface, by)
    config = make_env_config("handrail", task=BY.task, mode="ee")  # LeRobot takes the policy's size from it
    env = make_env(config, n_envs=len(seeds), use_async_envs=False)["handrail"][0]
    assert isinstance(env, SyncVectorEnv)
    seen, _ = env.reset(seed=list(seeds))
    states = []
    for step in range(STEPS):
        view({"observation": preprocess_observation(seen)})
        asked = torch.tensor([[0.2, 0.1, -0.1, 0.0, 0.0, 0.2, 0.0]]).repeat(len(seeds), 1)
        if step == fail_at:
            asked[0, 0] = torch.nan
        action = (completion if completes else acts)({"action": asked})["action"]
        seen, *_ = env.step(action.numpy())
        states.append(seen["agent_pos"].copy())
    env.close()
    return np.array(states)


def test_the_step_completes_as_the_environment_does(interface):
    inside, outside = driven(interface, completes=False), driven(interface, completes=True)
    assert np.abs(np.diff(inside, axis=0)).max() > 1e-2
    np.testing.assert_allclose(outside, inside, atol=1e-4)


def test_every_robot_has_a_controller_of_its_own(interface):
    together = driven(interface, completes=True, seeds=(5, 6))
    for number, seed in enumerate((5, 6)):
        alone = driven(interface, completes=True, seeds=(seed,))
        np.testing.assert_array_equal(together[:, number], alone[:, 0])


def test_a_command_that_is_no_number_brakes(interface):
    braked, gone_on = (driven(interface, completes=True, fail_at=when) for when in (STEPS - 1, None))
    np.testing.assert_array_equal(braked[:-1], gone_on[:-1])
    assert np.abs(braked[-1] - gone_on[-1]).max() > 1e-3
    assert np.isfinite(braked).all()


def test_an_episode_that_begins_again_is_the_same_again(interface):
    view, _, completion = steps(interface)
    env = build_env(SessionConfig(task=BY.task), BY.fps)
    seen, _ = env.reset(seed=3)
    shown = {
        "observation.state": seen["agent_pos"],
        "observation.environment_state": seen["environment_state"],
        "observation.sent": np.zeros(env.model.size),
        "observation.obstacles": to_numbers(env.obstacles()),
    }

    def at(time):
        numbers = shown | {"observation.time": np.array([time])}
        shows = {key: torch.as_tensor(each, dtype=torch.float32)[None] for key, each in numbers.items()}
        view({"observation": shows})
        return completion({"action": torch.full((1, 7), 0.1)})["action"].numpy()

    first = [at(0.0), at(0.05)]
    np.testing.assert_array_equal([at(0.0), at(0.05)], first)


def test_an_observation_that_cannot_be_completed_is_refused(interface):
    view, _, completion = steps(interface)
    sizes = len(interface.state_names), len(interface.environment_names)
    names = ("observation.state", "observation.environment_state")
    seen = {name: torch.ones(1, size) for name, size in zip(names, sizes, strict=True)}
    view({"observation": seen | {"observation.sent": torch.zeros(1, 9)}})
    with pytest.raises(HandrailError, match=r"expected observation\.time of 1 robots, as --env.type=handr"):
        completion({"action": torch.zeros(1, 7)})
    with pytest.raises(HandrailError, match="fps"):
        steps(interface, dataclasses.replace(BY, fps=0))


def test_a_robot_that_says_nothing_of_what_stands_around_gets_the_intent(interface):
    """`handrail_sim` shows robot and scene as one vector, and completes what it is asked for itself."""
    view, acts, completion = steps(interface)
    env = build_env(SessionConfig(task=BY.task), BY.fps)
    seen, _ = env.reset(seed=5)
    state, environment = (torch.from_numpy(seen[name])[None] for name in ("agent_pos", "environment_state"))
    apart = {"observation.state": state, "observation.environment_state": environment}
    shown = [
        view({"observation": each})["observation"]
        for each in (apart, {"observation.state": torch.cat([state, environment], dim=1)})
    ]
    torch.testing.assert_close(*shown, rtol=0, atol=0)
    action = torch.tensor([[0.2, 0.1, -0.1, 0.0, 0.0, 0.2, torch.nan]])
    asked = [step({"action": action})["action"] for step in (acts, completion)]
    torch.testing.assert_close(*asked, rtol=0, atol=0, equal_nan=True)
    assert asked[0].shape == (1, 7)
    assert asked[0][0, -1].isnan()


@pytest.mark.parametrize("field", ["robot", "task", "mode"])
def test_a_name_that_would_be_imported_is_refused_and_never_written(field, interface):
    strange = dataclasses.replace(BY, **{field: "press_kit:PRESS"})
    view, _, completion = steps(interface, strange)
    state = torch.ones(1, len(interface.state_names))
    around = {"time": torch.zeros(1, 1), "sent": torch.zeros(1, 9), "obstacles": torch.zeros(1, 1, 21)}
    told = {f"observation.{name}": values for name, values in around.items()}
    seen = {"observation.environment_state": torch.ones(1, len(interface.environment_names))}
    view({"observation": {"observation.state": state} | seen | told})
    with pytest.raises(HandrailError, match="a file may not choose what is imported"):
        completion({"action": torch.zeros(1, 7)})

    pipeline = PolicyProcessorPipeline([])
    for by, kind in ((strange, PolicyActionStep), (BY, PolicyCompletionStep)):
        _, after = with_steps(pipeline, pipeline, interface, by)
        assert [type(step) for step in after.steps] == [kind]


def test_another_rate_and_a_controller_that_needs_the_goal_are_refused(interface):
    with pytest.raises(HandrailError, match=r"expected 10 actions a second \(--env\.fps=10\), .*; got 20"):
        driven(interface, completes=True, by=dataclasses.replace(BY, fps=10))
    with pytest.raises(HandrailError, match="in mode blended: its controller needs the goal"):
        driven(interface, completes=True, by=dataclasses.replace(BY, mode="blended"))
    plain = PolicyProcessorPipeline(steps=[], name="plain")
    for mode, step in (("ee", PolicyCompletionStep), ("blended", PolicyActionStep)):
        _, after = with_steps(plain, plain, interface, dataclasses.replace(BY, mode=mode))
        assert type(after.steps[-1]) is step
