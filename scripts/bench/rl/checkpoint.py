"""The folder of a training run: settings, the last checkpoint, every evaluated actor.

The checkpoint is Stable-Baselines3's own file, and the transitions are in it. Opening it runs what it says:
never resume a run that a stranger has made. `start_from` reads tensors alone.
"""

import io
from dataclasses import asdict
from pathlib import Path
from typing import Any

from stable_baselines3 import SAC
from stable_baselines3.common.save_util import load_from_zip_file

from handrail.controllers.errors import HandrailError, restated
from handrail.controllers.typed import decoded
from handrail.datasets.storage.atomic import write_whole
from handrail.datasets.storage.strict_json import load_json, write_json
from handrail.scripts.bench.rl.config import TrainRlConfig

_FILE = "checkpoint.zip"
_NONE = "expected a checkpoint of this run"  # whatever zipfile, pickle and PyTorch find wrong with it


class Learner(SAC):
    """Soft actor-critic that keeps beside its networks how its training went."""

    curve: list[dict[str, float]]
    """The evaluations so far."""
    seconds: float
    """Of training so far."""

    def set_random_seed(self, seed: int | None = None) -> None:
        """Seed everything; the goals with one beyond 2⁶⁴: evaluations and benchmarks have those below."""
        super().set_random_seed(seed)
        if seed is not None and self.env is not None:
            self.env.seed(2**64 + seed)

    def write(self, folder: Path) -> None:
        """Write the checkpoint of a run, in place of the one before."""
        stream = io.BytesIO()
        self.save(stream, include=["replay_buffer"])
        write_whole(folder / _FILE, stream.getvalue())

    def start_from(self, folder: Path) -> None:
        """Take the actor and critics of a run's last checkpoint, not the optimisers' memory."""
        path = _checkpoint(folder, "--start_from")
        with restated(f"{str(path)!r}: {_NONE}"):
            states: Any = load_from_zip_file(path, load_data=False, device="cpu")[1]
            self.policy.load_state_dict(states["policy"])
            self._require_finite()

    @classmethod
    def resumed(cls, config: TrainRlConfig, env: Any) -> "Learner":
        """Return the learner of a run that goes on with these settings, transitions and all.

        Args:
            config: of the training.
            env: that it goes on in.
        """
        path, settings = _checkpoint(config.folder, "--resume"), config.folder / "config.json"
        content = load_json(settings, "settings of a training run")
        config.check_continues(decoded(content, TrainRlConfig, repr(str(settings))))
        changed = {"learning_rate": config.learning_rate, "tensorboard_log": config.tensorboard}
        with restated(f"{str(path)!r}: {_NONE}"):
            model = cls.load(path, env, device="cpu", **changed)
            model._require_finite()
            if (layers := model.policy_kwargs["net_arch"]) != list(config.layers):
                raise ValueError(f"hidden layers {layers}, expected {config.layers}")
        model.set_random_seed(config.seed + model.num_timesteps)  # else the same goals would come again
        return model

    def _require_finite(self) -> None:
        if not all(bool(each.isfinite().all()) for each in self.policy.state_dict().values()):
            raise ValueError("NaN or infinity")


def begin_run(config: TrainRlConfig) -> None:
    """Make the folder of a new run and write its settings."""
    folder = config.folder
    if folder.exists() and any(folder.iterdir()):
        raise HandrailError(f"{folder}: there is something already; expected another folder, or --resume")
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / "config.json", asdict(config))


def _checkpoint(folder: Path, flag: str) -> Path:
    """Return the checkpoint of a run."""
    path = folder / _FILE
    if not path.is_file():
        raise HandrailError(f"{flag}: expected a run with a checkpoint in {folder}, found none")
    return path
