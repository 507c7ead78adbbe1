"""How an actor was trained, in one JSON: settings, curve, versions, hardware, time."""

import importlib.metadata
import os
import platform
from dataclasses import asdict
from pathlib import Path
from typing import Any

from handrail.policies.rl.config import TrainRlConfig

_VERSIONED = ("handrail", "stable-baselines3", "torch", "gymnasium", "numpy", "pin")
_PLACES = ("output_dir", "resume", "overwrite")  # of a run, not of what came out


def training_record(
    config: TrainRlConfig, curve: list[dict[str, float]], final: dict[str, dict[str, float]]
) -> dict[str, Any]:
    """Return what a reader needs to repeat a training.

    Args:
        config: of the training; the seed is in there.
        curve: evaluations during the training.
        final: evaluation of the actor on goals that nobody looked at before.
    """
    settings = {name: value for name, value in asdict(config).items() if name not in _PLACES}
    if config.start_from:
        settings["start_from"] = Path(config.start_from).name
    return {
        "algorithm": "soft actor-critic",
        "settings": settings,
        "seconds": curve[-1]["seconds"],
        "updates": curve[-1]["updates"],
        "hardware": {"processor": _processor(), "cores": os.cpu_count(), "threads": config.threads},
        "versions": {
            "python": platform.python_version(),
            **{name: importlib.metadata.version(name) for name in _VERSIONED},
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
