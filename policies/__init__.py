"""Imitation policies through LeRobot."""
