"""Handrail in LeRobot's own terms: its robots, teleoperators, environments and processors."""
