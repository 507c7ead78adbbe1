"""Tasks: what is around the robot, what is to be done, and whether it was done."""
