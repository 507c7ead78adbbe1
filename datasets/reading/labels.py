"""How an episode ended, from its frames where its line of metadata does not say.

LeRobot's own `next.success` survives its `delete_episodes` and `split`, which drop every column of an episode
that is not LeRobot's.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from handrail.datasets.format.schema import NUMBERS
from handrail.datasets.reading.reader import DatasetInfo, read_rows_of

SUCCESS, FRAME_SUCCESS = "success", "next.success"


def with_success(info: DatasetInfo, rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return lines of metadata with `success`, as they say it or else as their frames do.

    An episode succeeded if any of its frames did.

    Args:
        info: What the dataset is.
        rows: As `read_episodes` returns them.

    Raises:
        HandrailError: A file of the dataset cannot be read.
    """
    feature = info.features.get(FRAME_SUCCESS)
    if feature is None or feature.dtype not in NUMBERS:
        return list(rows)
    return [row if row.get(SUCCESS) is not None else row | {SUCCESS: _any(info, row)} for row in rows]


def _any(info: DatasetInfo, row: dict[str, Any]) -> bool:
    return bool(np.any(read_rows_of(info, row, [FRAME_SUCCESS])[FRAME_SUCCESS] > 0))
