"""The slacks of the optimal control problem: one for each kind of soft limit.

One that all shared would let the robot come near itself for nothing, wherever a mover had come too close.
"""

OWN, STANDING, MOVING, LIMITS = range(4)
"""Distances [m] to the robot itself, to what stands still or is held, to what moves; limits of the joints."""

SLACKS = 4
VELOCITY_SLACK = 1e-3  # share of the limits' slack that velocity limits get: they can always be kept
