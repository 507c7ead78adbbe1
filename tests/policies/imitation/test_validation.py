"""Training until the loss on held-out episodes is flat: one rule, the same to the bit, nothing peeked at."""

import dataclasses
import shutil

import numpy as np
import pytest
from canned import canned
from hypothesis import given
from hypothesis import strategies as st
from training_helpers import refused, tiny, weights, write_dataset

from handrail.policies.imitation.interface.checkpoint import last_checkpoint, read_meta
from handrail.policies.imitation.training.plateau import Plateau
from handrail.policies.imitation.training.selection import hold_out
from handrail.policies.imitation.training.source import read_source
from handrail.policies.imitation.training.training import train

pytestmark = pytest.mark.filterwarnings("ignore:.*(torchcodec|pin_memory|video).*")
FLAT = {"eval_split": 0.1, "eval_steps": 2, "patience": 1, "improvement": 0.5, "steps": 40, "save_freq": 4}


@pytest.fixture(scope="session")
def many():
    return canned(write_dataset, lengths=(9, 7, 8, 6, 5, 9, 8))


@pytest.fixture(scope="session")
def flat(many, tmp_path_factory):
    """A training that ended by itself, and its settings."""
    config = tiny(many, tmp_path_factory.mktemp("flat") / "policy", "dropout=0.1", **FLAT)
    return train(config, quiet=True), config


losses = st.lists(st.floats(0.01, 10.0), max_size=30)


@given(losses, st.integers(1, 5), st.floats(0.0, 0.5), st.integers(1, 40))
def test_the_first_measurement_that_is_flat_decides_whatever_comes_later(values, patience, improvement, kept):
    def plateau(found):
        return Plateau({10 * (k + 1): v for k, v in enumerate(found)}, patience, improvement, 10**6, 5)

    whole, early = plateau(values).flat, plateau(values[:kept]).flat
    assert early in (None, whole)
    if whole:
        count = whole // 10
        before, lately = values[: count - patience], values[count - patience : count]
        assert min(lately) > (1 - improvement) * min(before) - 1e-12
        assert whole >= 10 * (patience + 1)


@given(losses, st.integers(1, 500), st.integers(1, 20_000))
def test_the_rate_rises_stays_and_falls_to_nothing_within_the_most_updates(values, warmup, most):
    plateau = Plateau({10 * (k + 1): v for k, v in enumerate(values)}, 2, 0.02, most, warmup)
    rates = [plateau.rate(step) for step in range(plateau.end + 1)]
    assert 1 <= plateau.end <= most
    assert rates[-1] == 0.0 < min(rates[:-1])
    assert max(rates) <= 1.0
    falling = rates[plateau.falls :]
    assert falling == sorted(falling, reverse=True) or plateau.falls < warmup
    assert rates[warmup : plateau.falls] == [1.0] * len(rates[warmup : plateau.falls])


@pytest.mark.parametrize(("episodes", "share", "held"), [(7, 0.1, 5), (60, 0.1, 6), (100, 0.2, 20)])
def test_episodes_are_held_out_by_draw_alone_and_none_twice(episodes, share, held, tmp_path):
    rows = [{"episode_index": number, "length": 3} for number in range(episodes)]
    config = tiny(tmp_path, tmp_path, eval_split=share)
    learnt, out = hold_out(rows, config)
    assert (len(learnt), len(out)) == (episodes - held, held)
    assert sorted(row["episode_index"] for row in (*learnt, *out)) == list(range(episodes))
    assert hold_out(rows, dataclasses.replace(config, seed=5)) == (learnt, out)
    others = [hold_out(rows, dataclasses.replace(config, draw=draw))[1] for draw in range(1, 6)]
    assert any(other != out for other in others)


def test_too_few_episodes_to_hold_some_out_is_one_line(recorded, tmp_path):
    config = tiny(recorded, tmp_path / "policy", eval_split=0.1)
    refused(config, r"--eval_split 0\.1: expected more than 5 episodes")
    assert not (tmp_path / "policy").exists()


def test_held_out_episodes_teach_nothing_not_even_a_scale(many, tmp_path):
    config = tiny(many, tmp_path, eval_split=0.1)
    source = read_source(config)
    learnt, out = (source.only(rows) for rows in source.split)
    numbers = [{row["episode_index"] for row in part.selection.rows} for part in (learnt, out)]
    assert not numbers[0] & numbers[1]
    assert len(learnt.columns["action"]) + len(out.columns["action"]) == len(source.columns["action"])
    whole = source.columns
    frames = np.concatenate([np.full(row["length"], row["episode_index"]) for row in source.selection.rows])
    inside = np.isin(frames, list(numbers[0]))
    np.testing.assert_array_equal(learnt.columns["action"], whole["action"][inside])
    np.testing.assert_array_equal(learnt.columns["index"], np.arange(inside.sum()))
    assert source.trained_on["episodes"] == len(numbers[0])
    assert source.trained_on["attempts"] == 7


def test_it_ends_where_the_rule_says_and_says_so(flat):
    folder, config = flat
    meta = read_meta(folder)
    found = {int(step): loss for step, loss in meta.validation.items()}
    plateau = Plateau(found, 1, 0.5, 40, 4)
    assert plateau.flat is not None
    assert meta.steps == plateau.end == max(found) < config.steps
    assert int(last_checkpoint(config.folder).name) == meta.steps
    assert train(dataclasses.replace(config, resume=True), quiet=True) == folder  # nothing is left to do


def test_measuring_changes_nothing(flat, many, tmp_path):
    """The same updates with and without measurements in between: nothing random is used up."""
    config = tiny(many, tmp_path / "often", "dropout=0.1", eval_split=0.1, eval_steps=1)
    rarely = dataclasses.replace(config, output=str(tmp_path / "rarely"), eval_steps=100)
    assert weights(train(config, quiet=True)) == weights(train(rarely, quiet=True))


def test_cut_off_anywhere_it_ends_the_same_to_the_bit(flat, tmp_path):
    folder, config = flat
    whole = sorted(path.name for path in (config.folder / "checkpoints").glob("[0-9]*"))
    assert len(whole) > 1
    for kept in range(1, len(whole)):
        cut = tmp_path / whole[kept]
        shutil.copytree(config.folder, cut, symlinks=True)
        for name in whole[kept:]:
            shutil.rmtree(cut / "checkpoints" / name)
        again = train(dataclasses.replace(config, output=str(cut), resume=True), quiet=True)
        assert weights(again) == weights(folder)
        assert read_meta(again).validation == read_meta(folder).validation
