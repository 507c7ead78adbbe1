"""Objectives: what the robot does with the freedom that the operator leaves."""
