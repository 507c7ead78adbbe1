"""One recorded episode, read by what its columns mean rather than by what they are called."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.errors import HandrailError
from handrail.datasets.format.data_file import DataFiles
from handrail.datasets.reading import naming
from handrail.datasets.reading.columns import ColumnNames
from handrail.datasets.reading.reader import DatasetInfo


class DoesNotApply(HandrailError):  # noqa: N818, it says what the report says
    """A metric has no value for an episode or a dataset; the message says why, for the report.

    Raised instead of a NaN or a zero: "no contact was recorded" is not "no contact".
    """


class Episode(ABC):
    """One episode of a dataset: its row of metadata, whether its rows are at hand or not."""

    number: int
    info: DatasetInfo
    meta: Mapping[str, Any]

    @abstractmethod
    def opened(self, files: DataFiles) -> "Demonstration":
        """Return it with its rows; `files` opens the file that they are in."""

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


@dataclass(frozen=True)
class Demonstration(Episode):
    """One episode with its rows. A column that it lacks raises `DoesNotApply` with the reason."""

    number: int
    info: DatasetInfo
    """Its dataset; it also tells the units of the numbers, as far as anything does."""
    frames: Mapping[str, np.ndarray]
    """Columns, `(N,)` or `(N, d)`; no pictures."""
    meta: Mapping[str, Any]
    columns: ColumnNames = field(default_factory=ColumnNames)
    hand: str = ""
    """Of which hand alone motion and gripper are meant; of all by default."""

    def opened(self, files: DataFiles) -> "Demonstration":
        """Return itself: its rows are at hand."""
        return self

    def some(self, frames: IntArray) -> "Demonstration":
        """Return some of its frames."""
        rows = {name: values[frames] for name, values in self.frames.items()}
        return replace(self, frames=rows, meta={**self.meta, "length": len(frames)})

    @cached_property
    def hands(self) -> tuple[str, ...]:
        """Names of the hands that state and action tell apart; () of one hand, which has none."""
        return naming.hand_names((*self.entries("state"), *self.entries("action")))

    def of_hand(self, hand: str) -> "Demonstration":
        """Return it with motion and gripper of one hand of several."""
        if hand not in self.hands:
            raise DoesNotApply(f"no entry of action or state is called {hand}")
        return replace(self, hand=hand)

    @cached_property
    def motion(self) -> FloatArray:
        """The motion: the tools' positions, `(N, 3 h)` [m], or else the configuration, in the state's units.

        Of h hands one after the other.
        """
        state, entries = self.matrix("state"), naming.point_entries(self.entries("state"), self.hand)
        return state[:, entries] if entries else self.configuration

    @property
    def speed(self) -> FloatArray:
        """How fast `motion` changes, `(N − 1,)` [1/s]."""
        return np.linalg.norm(np.diff(self.motion, axis=0), axis=1) * self.fps

    @property
    def motion_is_tool(self) -> bool:
        """Whether `motion` is the tool's position [m]."""
        return bool(naming.point_entries(self.entries("state"), self.hand))

    @cached_property
    def configuration(self) -> FloatArray:
        """Where the robot is: the positions in the state, `(N, c)`, or all of it where no name says."""
        state, entries = self.matrix("state"), naming.position_entries(self.entries("state"), self.hand)
        if self.hand and not entries:
            raise DoesNotApply(f"no position in the state is of {self.hand}")
        return state[:, entries] if entries else state

    @cached_property
    def observation(self) -> FloatArray:
        """The input of a policy, pictures aside: all numbers under `observation.`, `(N, s)`."""
        known = [values for name, values in self.frames.items() if name.startswith("observation")]
        found = [_rows(values) for values in known if values.dtype.kind in "fiub"]
        if not found:
            raise DoesNotApply("no column 'observation.…' with numbers")
        return np.hstack(found)

    @cached_property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Entries of action and state that mean the same in the same unit."""
        found = naming.same_thing(self.entries("action"), self.entries("state"))
        if not found:
            raise DoesNotApply("no entry of the action has its counterpart in the state, by name")
        return tuple(found)

    @cached_property
    def commanded(self) -> FloatArray:
        """The entries of the action that the state measures too, `(N, p)`."""
        return self.matrix("action")[:, [place for place, _ in self.pairs]]

    @cached_property
    def reached(self) -> FloatArray:
        """The measured state of `commanded`, `(N, p)`."""
        return self.matrix("state")[:, [place for _, place in self.pairs]]

    @cached_property
    def relative_action(self) -> FloatArray:
        """The action, positions taken relative to where the robot is, `(N, a)`."""
        action, names = self.matrix("action").copy(), self.entries("action")
        for place, measured in naming.same_thing(names, self.entries("state")):
            if not naming.is_velocity(names[place]):
                action[:, place] -= self.matrix("state")[:, measured]
        return action

    @cached_property
    def grippers(self) -> FloatArray:
        """The opening of each hand's gripper, commanded or else measured, `(N, h)`."""
        for part in ("action", "state"):
            if places := naming.gripper_entries(self.entries(part), self.hand):
                return self.matrix(part)[:, places]
        raise DoesNotApply("no entry of action or state is called gripper")

    @property
    def modes(self) -> str:
        """The teleop modes that the frames name, in the order in which they first occur; "" for none."""
        found = self.column("mode") if self.has("mode") else np.empty(0, str)
        known = dict.fromkeys(found.tolist() if found.dtype.kind == "U" else ())
        return " → ".join(mode for mode in known if mode)

    @cached_property
    def inputs(self) -> FloatArray:
        """The operator's input, zero on axes that they did not own and without the gripper, `(N, u)`."""
        values = self.matrix("asked")
        for part, least in (("owned", 1), ("owner", 2)):  # beside a policy 1 is the policy
            held = self.matrix(part)[:, : values.shape[1]] if self.has(part) else np.empty(0)
            if held.shape == values.shape:  # those of the grippers come after the channels
                values = np.where(held >= least, values, 0.0)
        axes = self.entries("asked") or map(str, range(values.shape[1]))
        return values[:, [place for place, name in enumerate(axes) if "gripper" not in name]]

    def has(self, part: str) -> bool:
        """Return whether a part is there."""
        return bool(self._name(part))

    def column(self, part: str) -> np.ndarray:
        """Return the column that plays a part, as it is.

        Raises:
            DoesNotApply: There is none.
        """
        if not self.has(part):
            raise DoesNotApply(f"no column {' or '.join(map(repr, self.columns.choices(part)))}")
        return self.frames[self._name(part)]

    def numbers(self, part: str) -> FloatArray:
        """Return the numbers of a part as `(N, d)`, finite or not.

        Raises:
            DoesNotApply: There is none, or it holds text.
        """
        values = self.column(part)
        if values.dtype.kind not in "fiub" or not values.size:
            raise DoesNotApply(f"the column of {part} holds no numbers")
        return _rows(values)

    def matrix(self, part: str) -> FloatArray:
        """Return the numbers of a part as `(N, d)`.

        Raises:
            DoesNotApply: There is none, it holds text, or a number that is not finite.
        """
        rows = self.numbers(part)
        if not np.isfinite(rows).all():
            raise DoesNotApply(f"the column of {part} holds numbers that are not finite")
        return rows

    def entries(self, part: str) -> tuple[str, ...]:
        """Return the names of a part's entries; none where the dataset names none."""
        return self.info.features[self._name(part)].names or () if self.has(part) else ()

    def _name(self, part: str) -> str:
        """Return the name of the column that plays a part, or ""."""
        return next((name for name in self.columns.choices(part) if name in self.frames), "")


def _rows(values: np.ndarray) -> FloatArray:
    return values.reshape(len(values), -1).astype(np.float64)
