"""Load a dataset and compute a metric: how smooth, how long and how near to a collision each episode was.

handrail-record outputs/reach --task reach
python docs/examples/dataset_metric.py outputs/reach
"""

import sys

import numpy as np

from handrail.datasets.quality.metrics import sparc
from handrail.datasets.reading.load import read_demonstrations


def main(folder: str) -> None:
    """Print a line an episode, and the mean smoothness."""
    values = []
    for episode in read_demonstrations(folder):  # of any LeRobot dataset that has these columns
        tool = episode.motion  # where the hand was, (N, 3) [m]
        speed = np.linalg.norm(np.diff(tool, axis=0), axis=1) * episode.fps
        values.append(sparc(speed, episode.fps))
        distance = float(np.min(episode.numbers("distance")))
        print(
            f"episode {episode.number}: {'done' if episode.success else 'failed'} in {episode.seconds:.1f} s,"
            f" smoothness {values[-1]:.2f}, smallest distance {distance:.2f} m"
        )
    print(f"Mean smoothness (SPARC): {np.mean(values):.2f}; a minimum-jerk motion has −1.4.")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
