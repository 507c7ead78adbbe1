"""The robot model, intent, the masked optimal control problem, its solvers and the controllers."""
