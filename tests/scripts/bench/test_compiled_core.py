"""Laws of the core in C: it measures what coal measures, and its plans are those of the controller."""

import numpy as np
import pytest

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.scripts.bench.speed.compiled_core import CoreScene, CoreSolver, compiler
from handrail.scripts.bench.speed.timing_loop import SpeedCase, TimingLoop

if compiler() is None:
    pytest.skip("needs a C compiler", allow_module_level=True)

SHAPES = (
    Shape("box", (0.3, 0.2, 0.6)),
    Shape("capsule", (0.1, 0.6)),
    Shape("sphere", (0.2,)),
    Shape("cylinder", (0.12, 0.8)),
)


@pytest.mark.parametrize("robot", ["ridgeback_ur10", "ridgeback_panda", "lekiwi"])
def test_distances_are_coal_s(robot):
    rng, model = np.random.default_rng(1), load_model(robot)
    obstacles = [
        Obstacle(str(index), shape, rng.normal(size=3), turned(np.eye(3), rng.uniform(-3, 3)))
        for index, shape in enumerate(SHAPES)
    ]
    collision = CollisionModel(model, tuple(obstacles))
    scene, limits = CoreScene(model, collision, obstacles, 1), model.description.limits
    for _ in range(30):
        q = rng.uniform(np.maximum(limits.position_lower, -2), np.minimum(limits.position_upper, 2))
        # coal's own tolerance, which it needs for cylinders alone, is 1e-6 of a squared distance
        np.testing.assert_allclose(scene.distances(q), collision.values(q[None])[0], atol=1e-5)


@pytest.mark.parametrize(
    ("case", "seed"),
    [
        (SpeedCase("none", own="none"), 2),
        (SpeedCase("own"), 2),
        (SpeedCase("own", robot="ridgeback_panda"), 2),
        (SpeedCase("few", "few", 2), 5),
    ],
)
def test_plans_are_those_of_the_controller(case, seed):
    """Most are the same; where shapes overlap or rows are nearly parallel, rounding may lead elsewhere.

    Cylinders are left out: coal's normals to them are good to 1e-3.
    """
    loop = TimingLoop(case, seed)
    solver, differences = CoreSolver(loop.mpc), []
    for update in loop.run(60):
        assert "cylinder" not in {obstacle.shape.kind for obstacle in update.obstacles}
        plan = loop.mpc.solver.solve(update.problem, update.guess, solver.active)
        _, found = solver.solve(update.problem, update.obstacles, update.guess)
        assert bool(found.solved) == plan.solved
        differences.append(np.abs(found.u - plan.u).max())
    assert np.median(differences) < 1e-8
    assert np.mean(np.array(differences) < 1e-4) > 0.8
