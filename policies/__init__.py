"""Imitation policies through LeRobot, the study, and the trained reinforcement-learning baseline."""
