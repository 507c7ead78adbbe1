"""Training of the reinforcement-learning baseline with soft actor-critic from Stable-Baselines3."""

import itertools
import os
import platform
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from gymnasium.wrappers import TransformObservation
from stable_baselines3.common.callbacks import BaseCallback

from handrail.controllers.interrupts import Interrupts
from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.presentation.drawing import COLOURS, GREY, new_figure, png, tidy
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import write_whole
from handrail.datasets.storage.strict_json import write_json
from handrail.policies.rl.observation import conditioning
from handrail.policies.rl.policy import Actor
from handrail.scripts.bench.goal_reaching.tables import PUBLISHED
from handrail.scripts.bench.rl.checkpoint import Learner, begin_run
from handrail.scripts.bench.rl.config import TrainRlConfig
from handrail.scripts.bench.rl.env import (
    FINAL_SEED,
    GoalReachingEnv,
    evaluate,
    evaluation_goals,
    means,
    spreads,
)

_TARGET_ENTROPY = -3.0
BUFFER = 100_000  # transitions that are kept
_PLACES = ("output_dir", "resume")  # of a run, not of what came out
_SHOWN = {  # in the figure of the curve
    "success": "share of goals reached",
    "arm_effort": "arm effort Σ‖q̇‖² [rad²/s²]",
    "jerkiness": "jerkiness [m/s², rad/s²]",
}


def train(config: TrainRlConfig) -> dict[str, Any]:
    """Train, or go on training, and return the record that was written beside the actor.

    The folder holds `config.json`, `checkpoint.zip` (of the last evaluation or interrupt),
    `actors/<steps>.npz` (all), `tensorboard/`, and at the end `actor.npz`, `actor.json` and `curve.png`.

    Raises:
        HandrailError: a setting is wrong, there is a run already, or there is none to resume.
        KeyboardInterrupt: it was interrupted; a checkpoint is written, and it can be resumed.
    """
    config.check()
    torch.set_num_threads(1)
    if config.resume:
        model = Learner.resumed(config, environment(config))
    else:
        begin_run(config)
        model = new_model(config)
        if config.start_from:
            model.start_from(Path(config.start_from).expanduser())
        model.write(config.folder)  # what crashes before the first evaluation goes on, too
    _learn(config, model)
    last = sorted((config.folder / "actors").glob("*.npz"))[-config.average :]
    actor = Actor.mean([Actor.load(path) for path in last])
    actor.save(config.folder / "actor.npz")
    final = spreads(evaluate(actor, evaluation_goals(config.final_goals, FINAL_SEED), config.physics))
    record = _record(config, model.curve, final)
    write_json(config.folder / "actor.json", record)
    write_whole(config.folder / "curve.png", png(_figure(model.curve)))
    return record


def _learn(config: TrainRlConfig, model: Learner) -> None:
    """Make the steps that remain, until an interrupt."""
    remaining = max(config.steps - model.num_timesteps, 0)
    if not remaining and _is_evaluated(model):
        return
    try:
        with Interrupts() as interrupts, interrupts.deferred():
            callback = Watch(config, model.seconds, interrupts)
            model.learn(remaining, callback, log_interval=20, reset_num_timesteps=not config.resume)
    except KeyboardInterrupt:
        goes_on = f"--resume goes on after step {model.num_timesteps}"
        raise KeyboardInterrupt(f"training: interrupted; {goes_on}") from None


def _is_evaluated(model: Learner) -> bool:
    return bool(model.curve) and model.curve[-1]["steps"] == model.num_timesteps


def actor_of(model: Learner) -> Actor:
    """Return the actor of a model as plain arrays; it sees o itself, where the networks see P o."""
    layers = [each for each in (*model.actor.latent_pi, model.actor.mu) if isinstance(each, torch.nn.Linear)]
    first, *others = (each.weight.numpy(force=True) for each in layers)
    biases = tuple(each.bias.numpy(force=True) for each in layers)
    return Actor((first @ conditioning(), *others), biases)


class Watch(BaseCallback):
    """Evaluates and saves every so many steps, and prints how far the training is.

    Args:
        config: of the training.
        seconds: of training so far.
        interrupts: one of them ends the training, and an evaluation too.
    """

    model: Learner

    def __init__(self, config: TrainRlConfig, seconds: float, interrupts: Interrupts) -> None:
        super().__init__()
        self._config, self._interrupts = config, interrupts
        self._goals = evaluation_goals(config.goals)
        self._began = time.monotonic() - seconds

    def _on_step(self) -> bool:
        if self.num_timesteps % self._config.save_every == 0:
            self._evaluate_and_save()
        return not self._interrupts.asked

    def _on_training_end(self) -> None:
        if not _is_evaluated(self.model):
            self._evaluate_and_save()
        if not _is_evaluated(self.model):  # an interrupt does not wait for that
            self._save()

    def _save(self) -> None:
        self.model.seconds = time.monotonic() - self._began
        self.model.write(self._config.folder)

    def _evaluate_and_save(self) -> None:
        actor = actor_of(self.model)
        goals = itertools.takewhile(lambda _: not self._interrupts.asked, self._goals)
        scores = evaluate(actor, goals, self._config.physics)
        if self._interrupts.asked:
            return
        score, seconds = means(scores), time.monotonic() - self._began
        row = {"steps": self.num_timesteps, "updates": float(self.model._n_updates), "seconds": seconds}
        self.model.curve.append({**row, "learning_rate": self._config.learning_rate, **score})
        for name, value in score.items():
            self.logger.record(f"evaluation/{name}", value)
        self.logger.dump(self.num_timesteps)
        Terminal().print(
            f"{self.num_timesteps} of {self._config.steps} steps, {seconds:.0f} s: "
            f"{score['success']:.0%} of the goals, {_words(score)}"
        )
        actor.save(self._config.folder / "actors" / f"{self.num_timesteps:08d}.npz")
        self._save()


def _words(score: dict[str, float]) -> str:
    return f"effort {score['arm_effort']:.1f}, jerkiness {score['jerkiness']:.3f}"


def environment(config: TrainRlConfig) -> Any:
    """Return the task as the networks see it."""
    matrix = conditioning()
    space = spaces.Box(-np.inf, np.inf, (len(matrix),), np.float32)
    env = GoalReachingEnv(
        failure_cost=config.failure_cost, physics=config.physics, repeat_missed=config.repeat_missed
    )
    return TransformObservation(env, lambda values: (matrix @ values).astype(np.float32), space)


def new_model(config: TrainRlConfig) -> Learner:
    """Return an actor and critics that have learned nothing."""
    model = Learner(
        "MlpPolicy",
        environment(config),
        learning_rate=config.learning_rate,
        buffer_size=BUFFER,
        learning_starts=config.random_steps,
        batch_size=config.batch_size,
        tau=config.tau,
        train_freq=config.train_freq,
        ent_coef=f"auto_{config.temperature}",
        target_entropy=_TARGET_ENTROPY,
        policy_kwargs={"net_arch": list(config.layers), "optimizer_kwargs": {"fused": True}},
        tensorboard_log=config.tensorboard,
        seed=config.seed,
        device="cpu",
    )
    model.curve, model.seconds = [], 0.0
    return model


def _record(
    config: TrainRlConfig, curve: list[dict[str, float]], final: dict[str, dict[str, float]]
) -> dict[str, Any]:
    """Return what a reader needs to repeat a training, the seed too."""
    settings = {name: value for name, value in asdict(config).items() if name not in _PLACES}
    if config.start_from:
        settings["start_from"] = Path(config.start_from).name
    return {
        "algorithm": "soft actor-critic",
        "settings": settings,
        "seconds": curve[-1]["seconds"],
        "updates": curve[-1]["updates"],
        "hardware": {"processor": _processor(), "cores": os.cpu_count(), "threads": torch.get_num_threads()},
        "versions": {
            "python": platform.python_version(),
            **versions(*SIMULATION, "stable-baselines3", "torch"),
        },
        "final": final,
        "curve": curve,
    }


def _processor() -> str:
    """Return the processor's name, or at least its architecture."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.is_file() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _figure(curve: list[dict[str, float]]) -> Any:
    """Return what the evaluations said over steps, with the published figures, as a figure."""
    figure = new_figure(11, 3.4)
    axes = figure.subplots(1, len(_SHOWN))
    for ax, (name, title) in zip(axes, _SHOWN.items(), strict=True):
        published = PUBLISHED["paper: RL"][name]["mean"]
        ax.plot([row["steps"] / 1000 for row in curve], [row[name] for row in curve], color=COLOURS[0])
        ax.axhline(published, color=GREY, linestyle="--", label="published")
        ax.set(xlabel="thousand steps", title=title, ylim=(0.0, None))
        tidy(ax)
    axes[0].legend(loc="lower right")
    return figure


def main(config: TrainRlConfig) -> int:
    """Train and print how good the actor is."""
    record = train(config)
    score = {name: values["mean"] for name, values in record["final"].items()}
    console = Terminal()
    console.print(
        f"{score['success']:.1%} of new goals after {record['curve'][-1]['steps']} steps, {_words(score)}"
    )
    console.print(f"written: {config.folder}/actor.npz, actor.json, curve.png")
    return 0
