"""The trace of a case's run, and its numbers."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from handrail.collect.session.outcome import Outcome
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.scripts.bench.cases.cases import PaperCase
from handrail.scripts.bench.report import spread


@dataclass(frozen=True)
class CaseTrace:
    """The trace, after each of the T control periods."""

    case: PaperCase
    times: FloatArray  # [s], (T,)
    q: FloatArray  # positions, (T, n)
    asked: FloatArray  # what the operator asks for at these times on the commanded channels, (T, c)
    realised: FloatArray  # measured on these channels, (T, c)
    hands: FloatArray  # position of each tool [m], (T, H, 3)
    pairs: tuple[tuple[str, str], ...]  # names of the pairs that keep apart, (P,)
    own_margin: BoolArray  # which of them keep a smaller margin than the controller's, (P,)
    distances: FloatArray  # signed [m], (T, P)
    solve_times: list[float]  # of the updates [s], (T,)
    outcome: Outcome  # of the session

    @property
    def tracking_error(self) -> FloatArray:
        """‖realised - asked‖ over the commanded channels, (T,)."""
        return np.linalg.norm(self.realised - self.asked, axis=1)

    @property
    def held_error(self) -> FloatArray:
        """How far the farthest hand is from its held point, (T,) [m]."""
        return np.linalg.norm(self.hands - np.array(self.case.held), axis=2).max(axis=1)

    @property
    def cruise(self) -> float:
        """The largest speed that is asked for."""
        return float(np.linalg.norm(self.asked, axis=1).max())

    def summary(self) -> dict[str, Any]:
        """Return the figures of the run, ready for JSON; lengths in [m], speeds in [m/s] and [rad/s].

        `tracking` is the error at every moment, from the start on; `share` is its mean over the cruise.
        """
        error, every = self.tracking_error, np.ones(len(self.pairs), dtype=bool)
        result = {
            "case": self.case.name,
            "title": self.case.title,
            "channels": list(self.case.channels),
            "seconds": self.outcome.seconds,
            "frames": self.outcome.frames,
            "contacts": self.outcome.contact_onsets,
            "brakes": self.outcome.brakes,
            "tracking": {
                **_mean_and_max(error),
                "cruising_speed": self.cruise,
                "share": float(error.mean() / self.cruise) if self.cruise else 0.0,
            },
            "smallest_distance": self._closest(every),
            "smallest_distance_at_full_margin": self._closest(~self.own_margin),
            "solve_time_ms": spread(self.solve_times, ("median", "p95", "p99", "worst")),
        }
        return result | ({"hold": _mean_and_max(self.held_error)} if self.case.held else {})

    def _closest(self, which: BoolArray) -> dict[str, Any]:
        smallest = np.where(which, self.distances.min(axis=0), np.inf)
        index = int(np.argmin(smallest))
        return {"value": float(smallest[index]), "pair": list(self.pairs[index])}


def _mean_and_max(values: FloatArray) -> dict[str, float]:
    return {"mean": float(values.mean()), "max": float(values.max())}
