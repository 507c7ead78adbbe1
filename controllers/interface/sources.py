"""Several sources ask at once, each with its own mask, weights and prediction: intents as one."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Prediction, after, constant

_ROUNDING = 1e-9  # of a time [s]


@dataclass(frozen=True)
class Source:
    """One that asks: a person, a policy, a script."""

    name: str  # which one; its prediction is remembered by it
    intent: Intent  # what it asks for
    weight: float | FloatArray = 1.0  # w ≥ 0 of its tracking term, one or one a channel, (m,)
    predict: Prediction | None = None  # Ψ of this source; the controller's by default

    def share(self) -> FloatArray:
        """Return its weight on each channel, 0 where it owns none, (m,)."""
        return np.where(self.intent.mask, self.weight, 0.0)

    @property
    def owns(self) -> bool:
        """Whether it has channels and a weight, of whatever size."""
        return bool(np.any(self.intent.mask) and np.any(self.weight))

    @property
    def is_active(self) -> bool:
        """Whether it has a weight on some channel that it owns."""
        return self.owns and bool(np.any(self.intent.mask & (np.asarray(self.weight) != 0.0)))


@dataclass(frozen=True)
class Intents(Intent):
    """What several sources ask for, as one intent.

    With `W = Σ_s w_s M_s` the tracking terms are one, `Σ_s w_s ‖M_s (c - û_s)‖² = W (c - ū)² + const` with
    `ū = Σ_s w_s M_s û_s / W`, channel by channel. `values` is ū, `mask` is W > 0, `time` the oldest of all:
    a source that owns a channel and is stale brakes the robot. Make it with `Intents.of`.
    """

    sources: tuple[Source, ...] = ()
    share: FloatArray = field(default_factory=lambda: np.ones(0))  # W, (m,)
    of_grippers: tuple[str, ...] = ()  # name of the source that owns each gripper

    @classmethod
    def of(cls, sources: Sequence[Source], grippers: tuple[float, ...], base: Intent) -> "Intents":
        """Return the intents of sources as one; those that own nothing are left out of the sum.

        Sources of another size, in other frames, or with a weight that is no number make an intent that no
        controller accepts: the robot brakes.

        Args:
            sources: all of them, each in the same frames.
            grippers: how far each is to be closed: whoever owns them says so.
            base: whose mode, frames and raw input it has; and its time, where no source owns a channel.
        """
        size = len(base.values)
        owners = [source for source in sources if source.owns]
        usable = all(_fits(source, base) for source in owners)
        active = tuple(source for source in owners if source.is_active) if usable else ()
        shares = [source.share() for source in active]
        total = np.sum([np.zeros(size), *shares], axis=0) if usable else np.ones(size)
        values = merged([source.intent.values for source in active], shares, size)
        return cls(
            values=values if usable else np.full(size, np.nan),
            mask=total > 0.0,
            grippers=grippers,
            mode=base.mode,
            time=min((source.intent.time for source in active), default=base.time),
            frames=base.frames,
            raw=base.raw,
            sources=tuple(sources) if usable else (),
            share=frozen(total),
        )

    @property
    def active(self) -> tuple[Source, ...]:
        """The sources that own something, with some weight."""
        return tuple(source for source in self.sources if source.is_active)

    @property
    def newest(self) -> float:
        """When the last of these asked [s]."""
        return max((source.intent.time for source in self.active), default=self.time)

    def source(self, name: str) -> Source | None:
        """Return a source by its name, if it is there."""
        return next((source for source in self.sources if source.name == name), None)


def _fits(source: Source, base: Intent) -> bool:
    """Whether a source can be in a sum with others: sizes, frames, a weight that is a number, values."""
    intent, weight = source.intent, np.asarray(source.weight)
    sizes = intent.values.shape == base.values.shape and weight.shape in ((), base.values.shape)
    frames = intent.frames is base.frames or np.array_equal(intent.frames.parameters, base.frames.parameters)
    return sizes and frames and intent.is_finite and bool(np.all(np.isfinite(weight) & (weight >= 0.0)))


def merged(values: Sequence[FloatArray], shares: Sequence[FloatArray], size: int) -> FloatArray:
    """Return the weighted mean of values, (…, m) each, with shares, (m,) each; 0 where nobody has a share.

    A single source's values are left as they are, bit for bit.
    """
    if not values:
        return np.zeros(size)
    if len(values) == 1:
        return np.where(shares[0] > 0.0, values[0], 0.0)
    total = np.sum(shares, axis=0)
    part = [np.divide(share, total, out=np.zeros_like(total), where=total > 0.0) for share in shares]
    terms = [each * np.where(each > 0.0, value, 0.0) for each, value in zip(part, values, strict=True)]
    return np.sum(terms, axis=0)


@dataclass(frozen=True)
class OfSources:
    """Ψ of several sources: the weighted mean of each one's own prediction, cut to what is possible first.

    Of a plain intent it is the controller's Ψ. Each source's own memory begins when it first asks.
    """

    predict: Prediction  # the controller's Ψ
    largest: FloatArray  # what a command of each channel is cut to, (m,)
    first: Prediction | None = None  # the controller's Ψ before it heard anything
    own: tuple[tuple[str, Prediction], ...] = ()  # by source

    def after(self, intent: Intent) -> "OfSources":
        """Return the prediction that has heard an intent; itself where nothing is remembered."""
        if not isinstance(intent, Intents):
            heard = after(self.predict, intent)
            return (
                self
                if heard is self.predict
                else replace(self, predict=heard, first=self.first or self.predict)
            )
        fresh, known = self.first or self.predict, dict(self.own)
        own = {
            each.name: after(each.predict or known.get(each.name, fresh), each.intent)
            for each in intent.active
        }
        return replace(self, first=fresh, own=tuple((known | own).items()))

    def __call__(self, intent: Intent, times: FloatArray) -> FloatArray:
        """Return the predicted values, (N, m)."""
        if not isinstance(intent, Intents):
            return self.predict(intent, times)
        own, cut = dict(self.own), self.largest
        values = [
            np.clip((each.predict or own.get(each.name, self.predict))(each.intent, times), -cut, cut)
            for each in intent.active
        ]
        shares = [each.share() for each in intent.active]
        return merged(values, shares, len(cut)) if values else constant(intent, times)


@dataclass(frozen=True)
class Preview:
    """Ψ of a policy that has planned ahead: its chunk, each row held from its time to the next.

    `û(t) = row k` with `times[k] ≤ now + t < times[k + 1]`; after the last row that one.
    """

    values: FloatArray  # on every channel, (K, m), K ≥ 1
    times: FloatArray  # when each begins, on the clock of the state, ascending, (K,) [s]

    def __call__(self, intent: Intent, times: FloatArray) -> FloatArray:
        """Return the predicted values, (N, m)."""
        index = np.searchsorted(self.times, intent.time + times + _ROUNDING, side="right") - 1
        return self.values[np.clip(index, 0, len(self.values) - 1)]
