"""Registers Handrail's robot, teleoperators, environment and the steps of its policies with LeRobot."""

import handrail.policies.lerobot  # noqa: F401
