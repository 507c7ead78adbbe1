"""The actor that is shipped: small, described, and as good as it is said to be."""

import json

import numpy as np

from handrail.collect.world.tasks.goal_reaching import STEP, T_MAX, StraightPlanner, pose_error, reached
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import load_model
from handrail.policies.rl.controller import RlController
from handrail.policies.rl.policy import SHIPPED, Actor
from handrail.scripts.bench.rl.evaluation import FINAL_SEED, evaluate, evaluation_goals

MODEL = load_model()
CHANNELS = Channels.of(MODEL.description)


def reaches(controller, goal, speed=1.0) -> bool:
    """Run the controller on a robot that does exactly what it is told, fed with the planner's twists."""
    q, v = MODEL.description.home, np.zeros(MODEL.size)
    pose = MODEL.pose(q)
    planner = StraightPlanner.plan(pose.position, pose.rotation, goal, speed=speed)
    controller.reset()
    controller.aim(goal)
    for t in range(T_MAX):
        values = np.zeros(CHANNELS.size)
        values[CHANNELS.tool_slice] = planner.twist(t)
        command = controller.update(State(q, v, t * STEP), Intent(values, CHANNELS.mask("ee"), time=t * STEP))
        v = command.velocity(STEP)
        q = q + STEP * v
        pose = MODEL.pose(q)
        if reached(*pose_error(pose.position, pose.rotation, goal)):
            return True
    return False


def test_the_shipped_actor_reaches_goals():
    goals = evaluation_goals(10, seed=40_000)
    controller = RlController(MODEL)
    assert sum(reaches(controller, goal) for goal in goals) >= 9


def test_the_record_is_the_actor_s():
    """Law: what the record says of goals reached is true of goals drawn in the same way."""
    record = json.loads((SHIPPED / "actor.json").read_text())
    said = record["final"]
    scores = evaluate(Actor.load(), evaluation_goals(20, FINAL_SEED), record["settings"]["physics"])
    assert said["success"]["mean"] >= 0.9
    assert sum(score["success"] for score in scores) >= 18
    lengths = [score["length"] for score in scores]
    assert said["length"]["min"] <= min(lengths)
    assert max(lengths) <= said["length"]["max"]


def test_it_is_small():
    assert (SHIPPED / "actor.npz").stat().st_size < 3_000_000
