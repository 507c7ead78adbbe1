"""A policy of LeRobot's own, with random weights, drives the robot through the whole of evaluation."""

from policy_helpers import untrained_act

from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.evaluation import evaluate


def test_an_untrained_act_drives_without_contact_and_repeatably(tmp_path):
    intent, realised = (
        untrained_act(tmp_path / "intent", "intent"),
        untrained_act(tmp_path / "realised", "realised"),
    )
    config = EvaluateConfig(policy=(intent, realised), episodes=1, time_limit=1.0, workers=1)
    first, again = evaluate(config), evaluate(config)
    assert set(first["arms"]) == {"ee intent", "ee"}
    for label, arm in first["arms"].items():
        (row,), (repeated,) = arm[0]["rollouts"], again["arms"][label][0]["rollouts"]
        assert row.pop("timing")["policy"] > 0
        del repeated["timing"]
        assert row == repeated
        assert row["length"] == 1.0
        assert row["malformed"] == row["brakes"] == row["contacts"] == 0
