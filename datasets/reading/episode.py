"""What an episode's line of metadata says, whether its rows are at hand or not."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from handrail.datasets.format.data_file import DataFiles
from handrail.datasets.reading.reader import DatasetInfo

if TYPE_CHECKING:
    from handrail.datasets.reading.demonstration import Demonstration


class Episode(ABC):
    """One episode of a dataset.

    Attributes:
        number: Of the episode in its dataset.
        info: What the dataset is.
        meta: The episode's line of metadata.
    """

    number: int
    info: DatasetInfo
    meta: Mapping[str, Any]

    @abstractmethod
    def opened(self, files: DataFiles) -> "Demonstration":
        """Return it with its rows.

        Args:
            files: Opens the file that they are in.
        """

    @property
    def fps(self) -> float:
        """Frames a second [Hz]."""
        return self.info.fps

    @property
    def count(self) -> int:
        """Number of frames."""
        return int(self.meta["length"])

    @property
    def seconds(self) -> float:
        """Duration, which is also the operator's time [s]."""
        return self.count / self.fps

    @property
    def success(self) -> bool | None:
        """How it ended, if that was recorded."""
        value = self.meta.get("success")
        return bool(value) if isinstance(value, bool | int | float) and math.isfinite(value) else None
