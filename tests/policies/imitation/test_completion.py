"""A checkpoint of intents completes them itself, as the environment would; names in it import nothing."""

import dataclasses
import json

import numpy as np
import pytest
import torch
from gymnasium.vector import SyncVectorEnv
from lerobot.envs.factory import make_env, make_env_config
from lerobot.envs.utils import preprocess_observation
from lerobot.processor import PolicyProcessorPipeline

from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_env
from handrail.collect.world.observation import MOST, from_numbers, to_numbers
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.policies.imitation.interface.completion import Completion
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.steps import (
    PolicyActionStep,
    PolicyCompletionStep,
    PolicyViewStep,
    with_steps,
)

BY = Completion("ridgeback_ur10", "pick_place", "ee", 20)
STEPS = 12


@pytest.fixture(scope="module")
def interface():
    env = build_env(SessionConfig(task=BY.task), BY.fps)
    channels = Channels.of(load_model(BY.robot).description)
    mask = tuple(channels.mask("ee").tolist())
    return PolicyInterface("intent", env.agent_names, env.state_names, channels.names, (mask,))


def steps(interface, by=BY):
    said = json.loads(json.dumps(dataclasses.asdict(interface)))
    view = PolicyViewStep(said)
    return view, PolicyActionStep(said), PolicyCompletionStep(said, dataclasses.asdict(by))


def driven(interface, completes, seeds=(5,), fail_at=None):
    """Return the robot's states while a policy asks for the same twist all the time."""
    view, acts, completion = steps(interface)
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


def test_what_is_no_number_brakes(interface):
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


def test_what_stands_around_becomes_numbers_and_back():
    env = build_env(SessionConfig(task="reach", moving_obstacles=2), 20)
    env.reset(seed=1)
    held = Obstacle("cup", Shape("cylinder", np.array([0.03, 0.1])), np.array([0, 0, 0.1]), frame="tool")
    there = (*env.obstacles(), held)
    back = from_numbers(to_numbers(there))
    assert len(back) == len(there) > 2
    for one, other in zip(there, back, strict=True):
        words = [(each.shape.kind, each.frame, each.work_surface) for each in (one, other)]
        assert words[0] == words[1]
        for name in ("position", "rotation", "velocity"):
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-6)
        np.testing.assert_allclose(one.shape.size, other.shape.size, atol=1e-6)
    with pytest.raises(HandrailError, match=f"expected {MOST} at most"):
        to_numbers((held,) * (MOST + 1))
    with pytest.raises(HandrailError, match="expected rows of"):
        from_numbers(np.full((2, 21), 0.5))


def test_what_cannot_be_completed_is_said(interface):
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
