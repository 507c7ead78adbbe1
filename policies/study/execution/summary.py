"""What is to be known of a dataset of a study when the dataset is gone."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from handrail.datasets.demonstrations.load import recorded_episodes
from handrail.datasets.quality.measure import measure
from handrail.datasets.reading.digest import digest_of_dataset


def summary(root: Path, seed: int) -> dict[str, Any]:
    """Return how much was recorded, how it ended, how good it is, and a digest of it all.

    Args:
        root: of the dataset.
        seed: of what the metrics draw.

    Raises:
        HandrailError: it cannot be read.
    """
    episodes = recorded_episodes(root)
    measured = measure({"all": episodes}, np.random.default_rng(seed)).values
    failed = (episode.meta.get("failure_reason") for episode in episodes if not episode.success)
    return {
        "episodes": len(episodes),
        "successes": sum(bool(episode.success) for episode in episodes),
        "minutes": sum(episode.seconds for episode in episodes) / 60.0,
        "frames": sum(episode.count for episode in episodes),
        "reasons": dict(Counter(str(reason or "not recorded") for reason in failed).most_common()),
        "digest": digest_of_dataset(root),
        "quality": {name: each["all"].mean for name, each in measured.items() if each["all"].applies},
    }
