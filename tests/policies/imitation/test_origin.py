"""A policy is evaluated as its demonstrations were made, whichever command trained it."""

import json

import pytest
from canned import canned, record_by_command
from command_helpers import ran
from training_helpers import tiny, write_dataset

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_task
from handrail.collect.session.recorded import settings_json
from handrail.controllers.errors import HandrailError
from handrail.datasets.reading.reader import read_episodes, read_info
from handrail.policies.imitation.evaluation.conditions import policy_conditions
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.rollout import run_rollout
from handrail.policies.imitation.interface.checkpoint import NAME
from handrail.policies.imitation.interface.origin import origin_of
from handrail.policies.imitation.interface.trained import TrainedPolicy, load_policy
from handrail.policies.imitation.training.training import train


@pytest.fixture(scope="module")
def recorded():
    words = "--task reach --robot bi_so101 --hand right --time_limit 33 --no_physics"
    return canned(record_by_command, f"{words} --dataset.num_episodes 1")


def test_a_policy_without_our_file_has_the_hand_and_the_time_of_its_demonstrations(recorded, tmp_path):
    """Law: as `lerobot-train` leaves it, a checkpoint is evaluated as `handrail-train`'s own is."""
    folder = train(tiny(recorded, tmp_path / "policy", actions="recorded", steps=1))
    asked, seen = EvaluateConfig(policy=(str(folder),)), []
    for _ in range(2):
        (condition,), _ = policy_conditions(asked)
        meta = condition.checkpoint.meta
        seen.append((meta.hand, condition.time_limit, meta.robot, meta.environment, meta.fps))
        (folder / NAME).unlink(missing_ok=True)
    assert seen == [("right", 33.0, "bi_so101", "reach", 20)] * 2


@pytest.mark.parametrize("name", ["", "operator", "task", "mode"])
def test_hand_and_time_are_read_also_where_a_module_is_named(name, recorded):
    """Law: nothing is imported for it, and nothing is lost."""
    said = SessionConfig(task="reach", robot="bi_so101", hand="right", time_limit=77.0)
    change = {name: "missing_module:SPEC"} if name else {}
    rows = [{"settings": json.dumps(json.loads(settings_json(said)) | change)}]
    origin = origin_of(read_info(recorded), rows)
    assert (origin["hand"], origin["time_limit"]) == ("right", 77.0)


def test_a_policy_hears_the_sentence_that_it_learnt_with(recorded, tmp_path, monkeypatch):
    """Law: what its dataset calls the task, where that is one sentence."""
    ran(recorded, "--task", "touch the ball", "--output", tmp_path / "renamed", name="edit rename")
    heard, act = set(), TrainedPolicy.act
    monkeypatch.setattr(TrainedPolicy, "act", lambda *given: heard.add(given[-1]) or act(*given))

    def heard_by(folder):
        heard.clear()
        (condition,), _ = policy_conditions(EvaluateConfig(policy=(str(folder),), time_limit=0.2))
        run_rollout(condition, 0, load_policy)
        return set(heard)

    folder = train(tiny(tmp_path / "renamed", tmp_path / "policy", steps=1))
    assert heard_by(folder) == {"touch the ball"}
    content = json.loads((folder / NAME).read_text())
    del content["task"]
    (folder / NAME).write_text(json.dumps(content))  # as of an older checkpoint
    assert heard_by(folder) == {build_task(SessionConfig(task="reach")).description}
    rows = read_episodes(recorded)
    assert origin_of(read_info(recorded), [*rows, rows[0] | {"tasks": ["another"]}])["task"] == ""
    both = [rows[0] | {"tasks": ["open", "close"]}]
    assert origin_of(read_info(recorded), both)["task"] == "open; close"  # as it is taught


def test_a_policy_of_recordings_with_a_mask_is_evaluated(tmp_path):
    """Law: the recorded mode, `mask:` and the mask, is no `module:name`."""
    mode = "mask:000111111000000000"
    folder = train(tiny(write_dataset(tmp_path / "set", modes=[mode] * 3), tmp_path / "policy", steps=1))
    (condition,), _ = policy_conditions(EvaluateConfig(policy=(str(folder),)))
    assert condition.checkpoint.meta.mode == condition.label == mode
    for refused in ("os:system", "os.path:_x1"):
        with pytest.raises(HandrailError, match="may not choose what is imported"):
            MODES.admit(refused, (mode,))
