"""Other solvers on the problems of a loop: the converged one, differential inverse kinematics, QP solvers."""

from collections.abc import Callable
from dataclasses import replace
from time import monotonic
from typing import Any

import numpy as np
import pinocchio as pin
from scipy import sparse

from handrail.collect.world.mink import MinkController
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.shape_pairs import coal_shape
from handrail.controllers.core.library import Memory, functions
from handrail.controllers.errors import imported
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.sources import Intents, IntentSource, Preview
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.parts import PlacedShape, Placement
from handrail.controllers.solvers.converged import ConvergedSolver
from handrail.controllers.solvers.dense import dense
from handrail.controllers.solvers.real_time import NOTHING_ACTIVE, RealTimeSolver
from handrail.scripts.bench.speed.timing_loop import PERIOD, Times, TimingLoop, Update

Solve = Callable[[], FloatArray | None]
"""The timed call; returns the solution, or None."""
Take = Callable[[Update], Solve]
"""Takes the problem of an update; what this does is not timed."""

_PATIENCE = 20.0  # of a case, with one peer [s]
_TOLERANCE = 1e-6  # of the interior-point method
_NEAREST = 20  # pairs that pink's barrier looks at, at most
_KEPT = 0.02  # distance that it keeps, of all pairs alike [m]


class Peer:
    """One other solver on some problems of a loop; the first one, at which things are built, does not count.

    Args:
        name: of the solver.
        loop: whose problems.
    """

    def __init__(self, name: str, loop: TimingLoop) -> None:
        self._take = PEERS[name](loop)
        self._times, self._solved, self._ours = Times(), list[bool](), list[float]()
        self._spent = 0.0

    def solve(self, update: Update) -> None:
        """Time an update's problem, unless its patience with this case is over."""
        if self._spent > _PATIENCE:
            return
        begun = monotonic()
        self._solved.append(self._times.of(self._take(update)) is not None)
        self._ours.append(update.cpu)
        self._spent += monotonic() - begun

    def measured(self) -> dict[str, Any]:
        """Return its times, and our median over its own on the same problems; none where it was too slow."""
        solved, ours = self._solved[1:], self._ours[1:]
        counts = {"solves": len(solved), "failed": solved.count(False)}
        if not solved:
            return counts
        ratio = float(np.median(ours) / np.median(self._times.cpu[1:]))
        return {**counts, **self._times.spreads(1), "ratio": ratio}


def _ipopt(loop: TimingLoop) -> Take:
    """Return the converged solver, IPOPT, from the same guess."""
    settings = loop.mpc.settings
    solver = ConvergedSolver(loop.mpc.residuals, settings.horizon, loop.model.size, settings.dt)

    def take(update: Update) -> Solve:
        def solve() -> FloatArray | None:
            plan = solver.solve(update.problem, update.guess)
            return plan.u if plan.solved else None

        return solve

    return take


def _mink(loop: TimingLoop) -> Take:
    """Return one step of mink for the hand's part of an intent: same shapes, pairs, margins and limits."""
    controller = MinkController(loop.model, PERIOD)
    hand = Channels.of(loop.model.description).mask("ee")
    among: Any = None

    def take(update: Update) -> Solve:
        nonlocal among
        if among is not update.obstacles:
            among = update.obstacles
            controller.reset(among)

        def solve() -> FloatArray | None:
            command = controller.update(update.state, replace(update.intent, mask=hand))
            return None if command.diagnostics.status.brakes else command.velocity(PERIOD)

        return solve

    return take


def _pink(loop: TimingLoop) -> Take:
    """Return one step of pink for the hand: same shapes and limits; its barrier keeps 2 cm of the nearest."""
    pink, barriers = (imported(name, "pink", "pin-pink") for name in ("pink", "pink.barriers"))
    model, limits = loop.model.pinocchio.copy(), loop.model.description.limits
    model.lowerPositionLimit, model.upperPositionLimit = limits.position_lower, limits.position_upper
    model.velocityLimit = limits.velocity
    tool = loop.model.hand.named("tool")
    task = pink.FrameTask(tool, position_cost=1.0, orientation_cost=1.0)
    tasks = [task, pink.tasks.DampingTask(cost=0.01)]
    twist = Channels.of(loop.model.description).hand_slice()
    among: Any = None
    configuration: Any = None
    kept: list[Any] = []

    def take(update: Update) -> Solve:
        nonlocal among, configuration, kept
        if among is not update.obstacles:
            among = update.obstacles
            shapes = _geometry(loop, update)
            count = min(len(shapes.collisionPairs), _NEAREST)
            kept = [barriers.SelfCollisionBarrier(count, gain=1.0, d_min=_KEPT)] if count else []
            configuration = pink.Configuration(
                model, model.createData(), update.state.q, collision_model=shapes
            )

        def solve() -> FloatArray | None:
            configuration.update(update.state.q)
            here = configuration.get_transform_frame_to_world(tool)
            moved = PERIOD * update.intent.values[twist]
            target = pin.SE3(pin.exp3(moved[3:]) @ here.rotation, here.translation + moved[:3])
            task.set_target(target)
            try:
                return pink.solve_ik(configuration, tasks, PERIOD, solver="daqp", barriers=kept)
            except (pink.exceptions.PinkError, ValueError, RuntimeError):
                return None

        return solve

    return take


def _geometry(loop: TimingLoop, update: Update) -> pin.GeometryModel:
    """Return the shapes of a robot and its scene, and the same pairs, the floor left out."""
    around = [
        PlacedShape(each.name, "universe", each.shape, Placement(each.position, each.rotation))
        for each in update.obstacles
    ]
    found, index = pin.GeometryModel(), {}
    for placed in (*loop.model.description.collision, *around):
        thing = pin.GeometryObject(placed.name, *loop.model.mount(placed), coal_shape(placed.shape))
        index[placed.name] = found.addGeometryObject(thing)
    for first, second in update.problem.collision.pairs:
        if second in index:
            found.addCollisionPair(pin.CollisionPair(index[first], index[second]))
    return found


def _programs(loop: TimingLoop) -> Callable[[Update], Memory]:
    """Return what puts the QP of an update into a core of its own."""
    settings = loop.mpc.settings
    solver = RealTimeSolver(loop.mpc.residuals, settings.horizon, loop.model.size)
    return lambda update: solver.program(update.problem, update.guess)


def _own_qp(loop: TimingLoop) -> Take:
    """Return the controller's active-set method; begins with the rows that were active in the last QP."""
    program, active = _programs(loop), NOTHING_ACTIVE

    def take(update: Update) -> Solve:
        core, scene = program(update), update.problem.collision.memory
        core.active[: len(active)], core.fields.active_rows, core.fields.work = active, len(active), np.inf
        solve_program = functions().solve_program

        def solve() -> FloatArray | None:
            nonlocal active
            solved = solve_program(core, scene)
            active = core.active[: core.fields.active_rows].copy()
            return np.append(core.s, core.slacks) if solved else None

        return solve

    return take


def _daqp(loop: TimingLoop) -> Take:
    """Return DAQP, a dual active-set method for dense QPs; begins like our own."""
    import daqp

    program, active = _programs(loop), np.zeros(0, dtype=np.int64)

    def take(update: Update) -> Solve:
        qp = dense(program(update), update.problem.collision.memory)
        sense, least = np.isin(qp.rows, active).astype(np.int32), np.full(len(qp.upper), -1e30)

        def solve() -> FloatArray | None:
            nonlocal active
            x, _, flag, info = daqp.solve(qp.hessian, qp.gradient, qp.matrix, qp.upper, least, sense)
            active = qp.rows[np.abs(info["lam"]) > 0.0]
            return x if flag > 0 else None

        return solve

    return take


def _piqp(loop: TimingLoop) -> Take:
    """Return PIQP, a proximal interior-point method, on sparse matrices; it cannot begin with a guess."""
    piqp = imported("piqp", "PIQP", "piqp", "profile")
    program = _programs(loop)

    def take(update: Update) -> Solve:
        qp = dense(program(update), update.problem.collision.memory)
        hessian, matrix = sparse.csc_matrix(qp.hessian), sparse.csc_matrix(qp.matrix)

        def solve() -> FloatArray | None:
            solver = piqp.SparseSolver()
            solver.settings.kkt_solver = piqp.KKTSolver.sparse_ldlt_cond  # the fastest of its methods here
            solver.settings.eps_abs = solver.settings.eps_rel = _TOLERANCE
            solver.setup(hessian, qp.gradient, None, None, matrix, None, qp.upper)
            done = solver.solve() == piqp.Status.PIQP_SOLVED
            return np.array(solver.result.x) if done else None

        return solve

    return take


def _two_sources(loop: TimingLoop) -> Take:
    """Return our own update where a policy that plans ahead asks for half of the channels."""
    mpc = MaskedMpc(loop.model, loop.mpc.settings)

    def take(update: Update) -> Solve:
        mpc.loop = update.before
        intent, owned = update.intent, update.intent.mask.cumsum()
        its = intent.mask & (owned <= owned[-1] // 2)
        plan = Preview(np.tile(intent.values, (20, 1)), intent.time + PERIOD * np.arange(20))
        person = IntentSource("person", replace(intent, mask=intent.mask & ~its))
        policy = IntentSource("policy", replace(intent, mask=its), 1.0, plan)
        both = Intents.of((person, policy), intent.grippers, intent)

        def solve() -> FloatArray | None:
            mpc.update(update.state, both)
            return None if mpc.plan is None else mpc.plan.u

        return solve

    return take


PEERS: dict[str, Callable[[TimingLoop], Take]] = {
    each.__name__.strip("_"): each for each in (_ipopt, _mink, _pink, _own_qp, _daqp, _piqp, _two_sources)
}
"""The solvers by name."""
