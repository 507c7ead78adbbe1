"""Imitation policies through LeRobot, and the reinforcement-learning baseline.

Importing it registers the baseline's environment, `handrail/GoalReaching-v0`; nothing heavy is imported until
it is made.
"""

import gymnasium

gymnasium.register("handrail/GoalReaching-v0", entry_point="handrail.policies.rl.env:GoalReachingEnv")
