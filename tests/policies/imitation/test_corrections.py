"""Learning from take-overs: a person's frames alone, or corrections as often as the rest; going on."""

import dataclasses
import shutil
from unittest import mock

import numpy as np
import pytest
import torch
from canned import canned, record_by_command
from command_helpers import ran
from lerobot.datasets.sampler import EpisodeAwareSampler
from safetensors.torch import load_file
from takeover_helpers import FRAMES, expected_owners, record_takeovers
from training_helpers import cut, refused, tiny, weights

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.reading.reader import read_episodes, read_info
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.policies.imitation.interface.checkpoint import MODEL, last_checkpoint, read_meta
from handrail.policies.imitation.training import run
from handrail.policies.imitation.training.corrections import Draws
from handrail.policies.imitation.training.presets import policy_config
from handrail.policies.imitation.training.selection import hold_out
from handrail.policies.imitation.training.source import read_source
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")
LENGTHS = (9, 1, 7, 12)


def drawn(seed, kind):
    marked = np.random.default_rng(seed).random(sum(LENGTHS)) < 0.3
    return Draws(kind, LENGTHS, marked), marked


@pytest.fixture(scope="module")
def takeovers():
    return canned(record_takeovers)


@pytest.fixture(scope="module")
def corrections(takeovers):
    """Whether a person commanded something in each of the frames, (N,)."""
    return np.tile((expected_owners(read_info(takeovers).features["owner"].names) == 2).any(axis=1), 2)


@pytest.mark.parametrize("dropped", [0, 2])
def test_all_frames_come_in_the_order_of_lerobot(dropped):
    frames = drawn(0, "all")[0].frames(dropped)
    ends = np.cumsum(LENGTHS)
    theirs = EpisodeAwareSampler([0, *ends[:-1]], ends, drop_n_last_frames=dropped, shuffle=True, seed=5)
    ours = EpisodeAwareSampler(frames, frames + 1, shuffle=True, seed=5)
    assert list(ours) == list(theirs)


@pytest.mark.parametrize("seed", range(5))
def test_both_classes_weigh_the_same_and_every_frame_of_one_alike(seed):
    draws, marked = drawn(seed, "weighted")
    count = np.bincount(draws.frames(), minlength=len(marked))
    assert count[marked].sum() == count[~marked].sum() > 0
    for each in (count[marked], count[~marked]):
        assert 1 <= each.min() <= each.max() <= each.min() + 1


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("dropped", [0, 2])
def test_actions_of_a_correction_are_of_it_alone(seed, dropped):
    draws, marked = drawn(seed, "only")
    episode = np.repeat(np.arange(len(LENGTHS)), LENGTHS)
    frames, (first, last) = draws.frames(dropped), draws.ends
    for frame in range(len(marked)):
        same = range(first[frame], last[frame] + 1)
        assert len({(marked[k], episode[k]) for k in same}) == 1
        assert (frame in frames) == (marked[frame] and last[frame] - frame >= dropped)
    assert len(set(frames)) == len(frames)


@pytest.mark.parametrize("kind", ["only", "weighted"])
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_there_has_to_be_something_to_learn_from(kind, share):
    marked = np.full(sum(LENGTHS), bool(share))
    if kind == "only" and share:
        assert len(Draws(kind, LENGTHS, marked).frames()) == len(marked)
        return
    with pytest.raises(HandrailError, match=f"--corrections {kind}: expected frames .*, got {marked.sum()}"):
        Draws(kind, LENGTHS, marked)


def batches(config):
    """Return what the policy is shown while it is trained."""
    seen = []

    def update(means, policy, batch, *others):
        seen.append({key: value.clone() for key, value in batch.items() if torch.is_tensor(value)})
        return run_update(means, policy, batch, *others)

    run_update = run.update_policy
    with mock.patch.object(run, "update_policy", update):
        train(config)
    return seen


@pytest.mark.parametrize("kind", ["all", "only", "weighted"])
def test_the_learner_sees_the_chosen_frames(kind, takeovers, corrections, tmp_path):
    """A chunk ends with the correction where nothing else is learnt, and with the episode elsewhere."""
    config = tiny(takeovers, tmp_path / "policy", corrections=kind, steps=9, batch_size=16)
    shown = batches(config)
    rows, pads = (torch.cat([each[key] for each in shown]).numpy() for key in ("index", "action_is_pad"))
    if kind != "all":
        assert corrections[rows].mean() == pytest.approx(1.0 if kind == "only" else 0.5, abs=0.1)
    for row, pad in zip(rows, pads, strict=True):
        ahead = corrections[row : row + len(pad)][: FRAMES - row % FRAMES]
        inside = int(np.argmin([*ahead, False])) if kind == "only" else len(ahead)
        assert (~pad).tolist() == [k < inside for k in range(len(pad))]
    assert read_meta(last_checkpoint(config.folder) / MODEL).training["corrections"] == kind


def test_demonstrations_that_are_merged_in_are_a_person_s_too(takeovers, tmp_path):
    plain = canned(record_takeovers, 1, shared=False)
    ran(plain, takeovers, "--output", tmp_path / "both", name="merge")
    found = {}
    for kind in ("only", "weighted"):
        config = tiny(tmp_path / "both", tmp_path / "policy", corrections=kind)
        draws = read_source(config).dataset(policy_config(config)).draws
        found[kind] = draws.marked[:FRAMES].mean()
    assert found == {"only": 1.0, "weighted": 0.0}


@pytest.mark.parametrize("kind", ["only", "weighted"])
def test_without_the_column_it_is_one_line(kind, recorded, tmp_path):
    words = f"--corrections {kind}: expected a column 'intervention' in .*, found none"
    refused(tiny(recorded, tmp_path / "policy", corrections=kind), words)
    assert not (tmp_path / "policy").exists()


def test_lerobot_s_own_take_overs_say_only_that_somebody_intervened(tmp_path):
    """Without owners, in a dataset of any columns."""
    vector = Feature("float32", (2,), ("a.pos", "b.pos"))
    features = {"observation.state": vector, "action": vector, "intervention": Feature("bool")}
    root, taken = tmp_path / "set", [False, True, True, False, False, False]
    with EpisodeWriter.create(root, Manifest("any/body", 20, "so101", features)) as writer:
        for index, each in enumerate(taken):
            rows = np.full(2, index, np.float32)
            writer.add_frame({"observation.state": rows, "action": rows, "intervention": each}, "wave")
        writer.save_episode({})
    for kind, expected in (("only", [1, 2]), ("weighted", [1, 1, 2, 2, 0, 3, 4, 5])):
        config = tiny(root, tmp_path / kind, corrections=kind, actions="recorded", steps=1)
        assert read_source(config).dataset(policy_config(config)).draws.frames().tolist() == expected
        assert train(config).is_dir()


@pytest.mark.parametrize("kind", ["only", "weighted"])
def test_a_resumed_training_draws_the_same(kind, takeovers, tmp_path):
    config = tiny(takeovers, tmp_path / "policy", corrections=kind)
    folder = train(config)
    assert weights(train(cut(config, tmp_path / "cut"))) == weights(folder)
    words = f"--corrections all: expected {kind} as the training began"
    refused(dataclasses.replace(cut(config, tmp_path / "other"), corrections="all"), words)


def statistics(folder):
    """Return the numbers with which a policy normalises, by file and name."""
    return {
        f"{path.name} {name}": values.tolist()
        for path in sorted(folder.glob("*normalizer*.safetensors"))
        for name, values in load_file(path).items()
    }


def test_a_training_goes_on_from_an_earlier_policy(takeovers, tmp_path):
    """With its weights and its normalisation, though the data are others; a resumed one is the same."""
    base = train(tiny(canned(record_takeovers, 1, shared=False), tmp_path / "base"))
    config = tiny(takeovers, tmp_path / "policy", corrections="only", init=str(tmp_path / "base"))
    first = {}

    def update(means, policy, *others):
        first.update(first or {key: value.clone() for key, value in policy.state_dict().items()})
        return run_update(means, policy, *others)

    run_update = run.update_policy
    with mock.patch.object(run, "update_policy", update):
        folder = train(config)
    earlier = load_file(base / "model.safetensors")
    assert all(torch.equal(first[key], earlier[key]) for key in earlier)
    assert statistics(folder) == statistics(base) != {}
    assert weights(folder) != weights(base)
    again = cut(config, tmp_path / "cut")
    shutil.rmtree(tmp_path / "base")  # no longer needed
    assert weights(train(again)) == weights(folder)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (
            {"policy": "diffusion", "policy_options": ()},
            "--init .*: expected a policy with policy diffusion, got act",
        ),
        ({"actions": "intent"}, "--init .*: expected a policy with actions intent, got realised"),
        ({"base_pose": False}, "--init .*: expected a policy of the dataset's base pose, got True"),
        ({"policy_options": ("chunk_size=6", "n_action_steps=2")}, "policy .*size mismatch"),
        ({"encoder": "ridgeback_ur10-reach"}, "--init .*: expected a policy with an --encoder"),
        ({"init": "nowhere"}, "policy 'nowhere': expected a checkpoint"),
    ],
)
def test_an_earlier_policy_has_to_fit(settings, words, takeovers, base_policy, tmp_path):
    refused(tiny(takeovers, tmp_path / "policy", **({"init": str(base_policy)} | settings)), words)


def test_an_earlier_policy_of_other_numbers_is_refused(recorded, base_policy, tmp_path):
    config = tiny(recorded, tmp_path / "policy", init=str(base_policy))
    refused(config, "--init .*: expected a policy of the dataset's state names, got")
    config = dataclasses.replace(config, output=str(base_policy), overwrite=True)
    refused(config, "expected a policy outside --output")
    assert (base_policy / "checkpoints").is_dir()


def test_an_intent_goes_on_with_the_masks_of_before(takeovers, tmp_path):
    line = "--task reach --mode ee --no_physics --time_limit 1 --dataset.num_episodes 1"
    hand = canned(record_by_command, line)
    train(tiny(hand, tmp_path / "hand", actions="intent"))
    both = tiny(takeovers, tmp_path / "both", actions="intent")
    refused(dataclasses.replace(both, init=str(tmp_path / "hand")), "masks; it has none of base.vx")
    masks = read_meta(train(both)).interface.masks
    less = tiny(hand, tmp_path / "less", actions="intent", init=str(tmp_path / "both"))
    assert read_meta(train(less)).interface.masks == masks


@pytest.fixture(scope="module")
def base_policy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("base") / "policy"
    train(tiny(canned(record_takeovers, 1, shared=False), folder))
    return folder


def test_held_out_episodes_without_a_correction_are_named_as_such(takeovers, tmp_path):
    plain = canned(record_takeovers, 6, shared=False)
    ran(plain, takeovers, "--output", tmp_path / "both", name="merge")
    rows = read_episodes(tmp_path / "both")
    for draw in range(50):
        config = tiny(
            tmp_path / "both", tmp_path / "policy", corrections="weighted", eval_split=0.1, draw=draw
        )
        if max(row["episode_index"] for row in hold_out(rows, config)[1]) < 6:
            break
    refused(config, f"--eval_split, as --draw {draw} holds out: --corrections weighted: expected frames with")
