"""A policy of LeRobot's own, with random weights, drives the robot through the whole of evaluation."""

from handrail.collect.build import build_env
from handrail.collect.config import SessionConfig
from handrail.controllers.channels import Channels
from handrail.policies.imitation.checkpoint import PolicyMeta, write_meta
from handrail.policies.imitation.evaluate_config import EvaluateConfig
from handrail.policies.imitation.evaluation import evaluate
from handrail.policies.imitation.interface import PolicyInterface


def act(folder, actions):
    """Write a small ACT that nobody trained."""
    from lerobot.configs.types import FeatureType, PolicyFeature
    from lerobot.policies.act.configuration_act import ACTConfig
    from lerobot.policies.act.modeling_act import ACTPolicy
    from lerobot.policies.factory import make_pre_post_processors

    env = build_env(SessionConfig(task="reach"), 20)
    channels = Channels.of(env.model.description)
    masks = (tuple(channels.mask("ee").tolist()),) if actions == "intent" else ()
    interface = PolicyInterface(actions, env.agent_names, env.state_names, channels.names, masks)
    env.close()
    state, environment = map(len, interface.observation_names)
    config = ACTConfig(
        input_features={
            "observation.state": PolicyFeature(FeatureType.STATE, (state,)),
            "observation.environment_state": PolicyFeature(FeatureType.ENV, (environment,)),
        },
        output_features={"action": PolicyFeature(FeatureType.ACTION, (len(interface.action_names),))},
        dim_model=32,
        dim_feedforward=32,
        n_heads=2,
        chunk_size=5,
        n_action_steps=5,
        use_vae=False,
        device="cpu",
        push_to_hub=False,
        pretrained_backbone_weights=None,
    )
    ACTPolicy(config).save_pretrained(folder)
    for processor in make_pre_post_processors(config):
        processor.save_pretrained(folder)
    meta = PolicyMeta("reach", "ee", "ridgeback_ur10", 20, actions, 0, 0, {"episodes": 1}, "act", 0)
    write_meta(folder, interface, meta)
    return str(folder)


def test_an_untrained_act_drives_without_contact_and_repeatably(tmp_path):
    intent, realised = act(tmp_path / "intent", "intent"), act(tmp_path / "realised", "realised")
    config = EvaluateConfig(policy=(intent, realised), episodes=1, time_limit=1.0)
    first, again = evaluate(config), evaluate(config)
    assert set(first["arms"]) == {"ee intent", "ee"}
    for label, arm in first["arms"].items():
        (row,), (repeated,) = arm[0]["rollouts"], again["arms"][label][0]["rollouts"]
        assert row.pop("timing")["policy"] > 0
        del repeated["timing"]
        assert row == repeated
        assert row["length"] == 1.0
        assert row["malformed"] == row["brakes"] == row["contacts"] == 0
