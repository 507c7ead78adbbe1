"""The design of a study: modes, tasks and draws, from a TOML file; light to import.

modes = ["ee", "direct"]        teleop modes; ee_and_leader: the first half of the minutes ee, then leader
baseline = "direct"             the mode that the others are compared with
policy = "act"                  that LeRobot has registered
draws = 8                       replicates: each a fresh recording with persons of its own, a training seed,
                                and beginnings of its own for the rollouts; the same for all modes
rollouts = 50                   of each policy
persons = 5                     scripted operators of a recording, who take turns
seed = 0                        of recordings and rollouts: another seed is another study of the same kind;
                                trainings have the number of the draw
curve = [5000, 10000]           optional: what policies have learnt after fewer updates drives, too; multiples
                                of the first

[tasks.reach]
minutes = 10.0                  of the operator's time in each mode, failed attempts included
episodes = 50                   successful demonstrations in each mode, at least; with [rounds] those that fit
                                into the minutes
steps = 4000                    updates of each policy
batch_size = 0                  samples an update; 0 for the preset's
rollout_limit = 20.0            after which a policy's rollout has failed [s]; that of the demonstrations
                                without it
time_limit = 60.0               of a demonstration [s]; the task's own without it
sizes = [3.0, 5.0]              optional, exploratory: more policies, of only so many of the minutes
round_minutes = 0.0             with [rounds]: of the operator's time in each way in each round

[[pairs]]                       optional: success of one mode − another, declared before the run, tested
one = "ee"
other = "direct"
budget = "number"               of policies of the same number of demonstrations, as in [beside]; else "time"
margin = 0.1                    optional: whether they are equivalent, nearer than this, is tested too
sd = 0.1                        of a policy's success from draw to draw, for the power

[beside]                        optional, exploratory: more policies
intents = ["ee"]                of these modes also the operator's intent is learnt, completed when it drives
draws = 2                       on the first so many draws
same_number = 1                 draws of which policies also learn from `episodes` demonstrations each
numbered = ["ee", "direct"]     of these modes; of all without it

[encoders]                      optional: policies look through these, one a task, when they drive: nobody
reach = "ridgeback_ur10-reach"  tells them where things are

[rounds]                        optional: all begin with a policy of the one mode; then the same operator time
count = 2                       is spent in several ways, in so many rounds; after each a policy learns anew
primary = [["whole", "more"]]   pairs of ways, compared after the last round and tested; [] for none
sd = 0.1                        from all data of its way so far. Policies write intents and drive alone.

[rounds.ways.whole]             a way, by its name; attempts that do not fit into the time are left out
operator = "supervisor"         the operator: scripted, or a supervisor of the policy of the round before
arbiter = "whole"               owners of channels beside that policy; "" if none drives beside the operator
corrections = "weighted"        how corrections are learnt from: all, only or weighted

[robustness]                    optional, exploratory: what else policies go through
perturbations = ["push", "shift", "delay"]      each a condition of its own; [] for none
protections = ["mpc", "filter"] of policies that command joint velocities; "none": of intents, without the MPC
rollouts = 50                   under each condition
draws = 1                       the first so many
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations
from typing import Annotated, Literal

from msgspec import Meta

from handrail.collect.operators.modes import MODES
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError, check_known
from handrail.controllers.typed import AtLeastOne, Count, Fraction

MOST_DRAWS = 1000
MIXED = "_and_"  # between the modes of a recording that has several
_Few = Annotated[int, Meta(ge=1, le=MOST_DRAWS)]
_Draws = Annotated[int, Meta(ge=0, le=MOST_DRAWS)]


@dataclass(frozen=True)
class TaskDesign:
    """One task of a study; its settings are explained above."""

    minutes: Annotated[float, Meta(gt=0, le=1e6)]
    episodes: Annotated[int, Meta(ge=2, le=10**6)] = 2
    steps: AtLeastOne = 4000
    batch_size: Count = 0
    rollout_limit: float = 0.0
    time_limit: float = 0.0
    sizes: tuple[float, ...] = ()
    round_minutes: Annotated[float, Meta(ge=0, le=1e6)] = 0.0


@dataclass(frozen=True)
class DeclaredPair:
    """Two modes whose difference is tested; explained above."""

    one: str
    other: str
    budget: Literal["time", "number"] = "time"
    margin: Fraction = 0.0
    sd: Fraction = 0.1


@dataclass(frozen=True)
class Beside:
    """More policies than the main design has; explained above."""

    intents: tuple[str, ...] = ()
    draws: _Draws = 0
    same_number: _Draws = 0
    numbered: tuple[str, ...] = ()


@dataclass(frozen=True)
class Robustness:
    """Further treatments of policies of the main design; explained above."""

    perturbations: tuple[str, ...] = ("push", "shift", "delay")
    protections: tuple[str, ...] = ("filter",)
    rollouts: Count = 50
    draws: _Draws = 1


@dataclass(frozen=True)
class Way:
    """How an operator's time is spent; explained above."""

    operator: str = "scripted"
    arbiter: str = ""
    corrections: Literal["all", "only", "weighted"] = "all"


@dataclass(frozen=True)
class Rounds:
    """Rounds of recording and learning, in several ways; explained above."""

    ways: Mapping[str, Way]
    count: Annotated[int, Meta(ge=1, le=20)] = 2
    primary: tuple[tuple[str, str], ...] = ()
    sd: Fraction = 0.1

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """All pairs of ways, those that are tested as they are declared."""
        found = combinations(self.ways, 2)
        return [(two, one) if (two, one) in self.primary else (one, two) for one, two in found]


@dataclass(frozen=True)
class StudyDesign:
    """A whole study, called after its file; its settings are explained above."""

    name: str
    modes: tuple[str, ...]
    tasks: Mapping[str, TaskDesign]
    baseline: str
    policy: str = "act"
    draws: _Few = 3
    rollouts: Count = 100
    persons: _Few = 5
    seed: Annotated[int, Meta(ge=0, le=10**5)] = 0
    curve: tuple[AtLeastOne, ...] = ()
    pairs: tuple[DeclaredPair, ...] = ()
    beside: Beside | None = None
    rounds: Rounds | None = None
    encoders: Mapping[str, str] = field(default_factory=dict)
    robustness: Robustness | None = None
    digest: str = ""  # of what its file says, comments left out; "" where it comes from no file

    def check(self) -> None:
        """Check names, and how the settings fit each other; `check_jobs` checks the settings of its jobs."""
        if (len(self.modes) != 1 if self.rounds else len(self.modes) < 2) or not self.tasks:
            wanted = "one mode" if self.rounds else "two modes or more"
            raise HandrailError(
                f"study {self.name}: expected {wanted} and a task, "
                f"got {', '.join(self.modes) or 'no mode'}; {', '.join(self.tasks) or 'no task'}"
            )
        check_known("mode", (part for mode in self.modes for part in mode.split(MIXED)), MODES)
        check_known("task", self.tasks, TASKS)
        check_known("baseline", (self.baseline,), self.modes)
        if self.encoders and self.encoders.keys() != self.tasks.keys():
            words = f"expected one of each task ({', '.join(self.tasks)}) or none"
            raise HandrailError(f"study {self.name}: encoders: {words}, got {', '.join(self.encoders)}")
        if self.rounds:
            self._check_rounds(self.rounds)
        beside = self.beside or Beside()
        check_known(
            "mode of a pair", (mode for each in self.pairs for mode in (each.one, each.other)), self.modes
        )
        pairs = [(each.one, each.other, each.budget) for each in self.pairs]
        told_apart = {(frozenset(two), budget) for *two, budget in pairs if len(set(two)) > 1}
        if len(told_apart) < len(pairs):
            raise HandrailError(f"study {self.name}: pairs: expected two modes each, once, got {pairs}")
        counted = beside if beside.same_number == self.draws else Beside()
        numbered = counted.numbered or (self.modes if counted.same_number else ())
        by_number = (mode for *two, budget in pairs if budget == "number" for mode in two)
        check_known("mode of a pair by number, which same_number has in all draws", by_number, numbered)
        for name, task in self.tasks.items():
            told = {f"{size:g}" for size in task.sizes if 0.0 < size < task.minutes}
            if len(told) < len(task.sizes):
                words = f"expected each once, between 0 and its {task.minutes:g} minutes"
                raise HandrailError(f"study {self.name}: sizes of {name}: {words}, got {task.sizes}")
        most = min(task.steps for task in self.tasks.values())
        if any(updates % self.curve[0] or updates >= most for updates in self.curve):
            words = f"expected multiples of the first below {most} updates"
            raise HandrailError(f"study {self.name}: curve {words}, got {self.curve}")
        completed = [mode for mode in self.modes if mode in MODES and MODES[mode].controller == "mpc"]
        check_known("mode of same_number", beside.numbered, self.modes)
        check_known("mode of intents, which the MPC completes", beside.intents, completed)
        once = {"modes": self.modes}
        draws = {"beside.draws": beside.draws, "beside.same_number": beside.same_number}
        if robust := self.robustness:
            once["robustness"] = (*robust.perturbations, *robust.protections)
            draws["robustness.draws"] = robust.draws
            idle = {"none"} & {*robust.perturbations} | {"own", "all"} & {*robust.protections}
            if idle:
                words = "robustness: expected what changes something, got"
                raise HandrailError(f"study {self.name}: {words} {', '.join(sorted(idle))}")
        for name, chosen in once.items():
            if not chosen or len(set(chosen)) < len(chosen):
                raise HandrailError(f"study {self.name}: {name} expected some, each once, got {chosen}")
        for name, count in draws.items():
            if count > self.draws:
                raise HandrailError(
                    f"study {self.name}: {name} expected at most {self.draws} draws, got {count}"
                )

    def _check_rounds(self, rounds: Rounds) -> None:
        """Check that there are ways to compare, and nothing that rounds do not know of."""
        where = f"study {self.name}: rounds"
        for other in ("curve", "pairs", "beside", "encoders", "robustness"):
            if getattr(self, other):
                raise HandrailError(f"{where}: expected no {other} beside them")
        check_known("mode of rounds", self.modes, MODES)
        if len(rounds.ways) < 2:
            raise HandrailError(f"{where}: expected two ways or more, got {', '.join(rounds.ways) or 'none'}")
        for way in rounds.ways:
            if not way.isidentifier():
                raise HandrailError(f"{where}: expected ways whose names are words, got {way!r}")
        for pair in rounds.primary:
            check_known("way", pair, rounds.ways)
            if len(set(pair)) < 2 or [set(each) for each in rounds.primary].count(set(pair)) > 1:
                raise HandrailError(f"{where}: primary: expected two ways each, once, got {rounds.primary}")
        for task, each in self.tasks.items():
            if not each.round_minutes or each.sizes:
                found = f"got sizes {each.sizes}" if each.sizes else "found none"
                raise HandrailError(f"{where}: expected round_minutes of task {task}, {found}")
