"""The slacks of the optimal control problem: one for each kind of soft limit.

One that all shared would let the robot come near itself for nothing, wherever a mover had come too close.
"""

OWN, STANDING, MOVING, LIMITS = range(4)
"""Distances [m] to the robot itself, to what stands still or is held, to movers; joint limits (core.h)."""

SLACKS = 4
