"""What measures of data take a policy to read and write is what it reads and writes."""

import numpy as np

from handrail.datasets.demonstrations.load import read_demonstrations
from handrail.datasets.learnability.learnability import learnability
from handrail.policies.imitation.interface.interface import COLUMNS, PolicyInterface
from handrail.policies.imitation.interface.policy_rows import policy_rows


def test_rows_are_those_of_a_policy_of_velocities(recorded):
    for episode in read_demonstrations(recorded):
        rows = policy_rows(episode)
        assert list(rows.actions) == ["realised", "intent"]
        assert all(each.values.shape == (episode.count, len(each.names)) for each in rows.actions.values())
        columns = {key: episode.frames[key] for key in COLUMNS}
        usual = PolicyInterface.of_dataset(episode.info.features, [], "realised")
        np.testing.assert_array_equal(rows.actions["realised"].values, usual.encode(columns))
        seen = usual.observe(columns["observation.state"], columns["observation.environment_state"])
        np.testing.assert_array_equal(rows.seen, np.hstack(seen))
        names = [name for part in usual.observation_names for name in part]
        assert [names[place] for place in rows.shown["base pose"]] == [
            "base.x",
            "base.y",
            "base.cos",
            "base.sin",
        ]


def test_learnability_takes_them(recorded):
    episodes = 3 * read_demonstrations(recorded)
    found = learnability(episodes, np.random.default_rng(0), policy_rows)
    assert set(found.spaces) == {"realised", "intent"}
