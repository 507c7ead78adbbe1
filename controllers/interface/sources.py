"""Several sources ask at once, each with its own mask, weights and prediction: intents as one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray, frozen
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Prediction, after, constant

PERSON, POLICY = "person", "policy"  # names of the two that take-overs have
_ROUNDING = 1e-9  # of a time [s]


@dataclass(frozen=True)
class IntentSource:
    """One that asks: a person, a policy, a script."""

    name: str  # which one; what the controller's Ψ heard of it is remembered by it
    intent: Intent  # what it asks for
    weight: float | FloatArray = 1.0  # w ≥ 0 of its tracking term, one or one a channel, (m,)
    predict: Prediction | None = None
    """Ψ of this source, which remembers nothing; the controller's by default."""

    def share(self) -> FloatArray:
        """Return its weight on each channel, 0 where it owns none, (m,)."""
        return np.where(self.intent.mask, self.weight, 0.0)


class Term(NamedTuple):
    """A source that has some weight, and its part of all weight on each channel, (m,)."""

    source: IntentSource
    part: FloatArray
    alone: BoolArray | None  # where it has a part, if that is all of the weight everywhere, (m,)

    @classmethod
    def of(cls, source: IntentSource, share: FloatArray, total: FloatArray) -> "Term":
        """Return the term of a source with its share of a total, (m,) each."""
        part = np.divide(share, total, out=np.zeros_like(total), where=total > 0.0)
        owned = part > 0.0
        return cls(source, part, owned if np.all(part[owned] == 1.0) else None)

    def add(self, values: FloatArray, mean: FloatArray, largest: FloatArray | None = None) -> None:
        """Add its part of values, (…, m), cut to ± largest first, to a weighted mean.

        What it has alone is left as it is: nobody's part of it has to be cut to compare.
        """
        if self.alone is not None:
            np.copyto(mean, values, where=self.alone)
            return
        if largest is not None:
            values = np.minimum(np.maximum(values, -largest), largest)
        mean += self.part * np.where(self.part > 0.0, values, 0.0)


@dataclass(frozen=True)
class Intents(Intent):
    """The intents of several sources, as one intent.

    With `W = Σ_s w_s M_s` the tracking terms are one, `Σ_s w_s ‖M_s (c - û_s)‖² = W (c - ū)² + const` with
    `ū = Σ_s w_s M_s û_s / W`, channel by channel. `values` is ū, `mask` is W > 0, `time` the oldest of all:
    a source that owns a channel and is stale brakes the robot. Make it with `Intents.of`.
    """

    sources: tuple[IntentSource, ...] = ()
    terms: tuple[Term, ...] = ()  # of the sources that count
    share: FloatArray | None = None  # W, (m,); None where it is 1 wherever the mask is true
    last: float = 0.0  # when the last of those that count asked [s]
    of_grippers: tuple[str, ...] = ()  # name of the source that owns each gripper

    @classmethod
    def of(cls, sources: Sequence[IntentSource], grippers: tuple[float, ...], base: Intent) -> "Intents":
        """Return the intents of sources as one; those that own nothing are left out of the sum.

        Sources of another size, in other frames, or with a weight that is no number make an intent that no
        controller accepts: the robot brakes.

        Args:
            sources: all of them, each in the same frames.
            grippers: how far each is to be closed: whoever owns them says so.
            base: whose mode, frames and raw input it has; and its time, where no source owns a channel.
        """
        size = len(base.values)
        owners = [source for source in sources if np.any(source.intent.mask) and np.any(source.weight)]
        usable = all(_fits(source, base) for source in owners)
        shares = [(source, source.share()) for source in owners] if usable else []
        active = [(source, share) for source, share in shares if share.any()]
        total = np.sum([np.zeros(size), *(share for _, share in active)], axis=0)
        terms = tuple(Term.of(source, share, total) for source, share in active)
        values = np.zeros(size)
        for term in terms:
            term.add(term.source.intent.values, values)
        asking = [source.intent for source, _ in active] or [base]
        mask = total > 0.0
        return cls(
            values=values if usable else np.full(size, np.nan),
            mask=mask if usable else np.ones(size, dtype=bool),
            grippers=grippers,
            mode=base.mode,
            time=min(each.time for each in asking),
            frames=base.frames,
            raw=base.raw,
            sources=tuple(sources) if usable else (),
            terms=terms,
            share=None if np.all(total[mask] == 1.0) else frozen(total),
            last=max(each.newest for each in asking),
        )

    @property
    def newest(self) -> float:
        """When the last of those that count asked [s]."""
        return self.last

    def source(self, name: str) -> IntentSource | None:
        """Return a source by its name, if it is there."""
        return next((source for source in self.sources if source.name == name), None)


def _fits(source: IntentSource, base: Intent) -> bool:
    """Whether a source can be in a sum with others: sizes, frames, a weight that is a number, values."""
    intent, weight = source.intent, np.asarray(source.weight)
    sizes = intent.values.shape == base.values.shape and weight.shape in ((), base.values.shape)
    same = intent.frames is base.frames
    same = same or np.array_equal(intent.frames.parameters, base.frames.parameters)
    return sizes and same and intent.is_finite and bool(np.all(np.isfinite(weight) & (weight >= 0.0)))


@dataclass(frozen=True)
class OfSources:
    """Ψ of several sources: the weighted mean of each one's own prediction, cut to what is possible first.

    Of a plain intent it is the controller's Ψ. Its memory of a source begins when that first asks.
    """

    predict: Prediction  # the controller's Ψ
    largest: FloatArray  # what a command of each channel is cut to, (m,)
    first: Prediction | None = None
    """The controller's Ψ before it heard anything; None where that is `predict`."""
    own: tuple[tuple[str, Prediction], ...] = ()  # by source

    def after(self, intent: Intent) -> "OfSources":
        """Return the prediction that has heard an intent; itself where nothing is remembered."""
        if not hasattr(self.predict, "after"):
            return self
        first = self.first or self.predict
        if not isinstance(intent, Intents):
            return replace(self, predict=after(self.predict, intent), first=first)
        heard = dict(self.own)
        for source, *_ in intent.terms:
            heard[source.name] = after(heard.get(source.name, first), source.intent)
        return replace(self, first=first, own=tuple(heard.items()))

    def __call__(self, intent: Intent, times: FloatArray) -> FloatArray:
        """Return the predicted values, (N, m)."""
        if not isinstance(intent, Intents):
            return self.predict(intent, times)
        own, predicted = dict(self.own), np.zeros((len(times), len(self.largest)))
        for term in intent.terms:
            source = term.source
            predict = source.predict or own.get(source.name, self.predict)
            values = source.intent.values if predict is constant else predict(source.intent, times)
            term.add(values, predicted, self.largest)
        return predicted


@dataclass(frozen=True)
class Preview:
    """Ψ of a policy that has planned ahead: its chunk, each row held from its time to the next.

    `û(t) = row k` with `times[k] ≤ now + t < times[k + 1]`; after the last row that one.
    """

    values: FloatArray  # on every channel, (K, m), K ≥ 1
    times: FloatArray  # when each begins, on the clock of the state, ascending, (K,) [s]

    def __call__(self, intent: Intent, times: FloatArray) -> FloatArray:
        """Return the predicted values, (N, m)."""
        index = self.times.searchsorted(times + (intent.time + _ROUNDING), "right") - 1
        return self.values.take(index, 0, mode="clip")
