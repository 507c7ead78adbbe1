"""Scenes, tasks, the Gymnasium environments, operators and the session loop."""
