"""Recordings: with one process or several, anew or as an addition, on a cluster."""

import json
import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from handrail.datasets.format.layout import Layout
from handrail.datasets.format.lines import count_lines, rows_of_lines
from handrail.scripts.bench.soak.child import command, members, wait_until
from handrail.scripts.bench.soak.faults import CLUSTER
from handrail.scripts.bench.soak.whole import Saved, lines_of, saved_by
from handrail.scripts.bench.soak.work import Work
from handrail.scripts.bench.soak.workshop import EPISODES, Recipe, Workshop

os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"  # else Ray looks for 127.0.0.1 at another address
_CLUSTER_STARTS, _CLUSTER_ENDS = 600.0, 120.0  # [s]


class RecordingWork(Work):
    """`handrail-record`, with one process or several, anew or as an addition to what was recorded or packed.

    Args:
        folder: as for all.
        workshop: as for all.
        recipe: what is recorded.
        flags: how the work is shared.
        had: episodes that are there already.
        packed: whether these are packed.
    """

    def __init__(
        self,
        folder: Path,
        workshop: Workshop,
        recipe: Recipe,
        flags: tuple[str, ...] = (),
        had: int = 0,
        packed: bool = False,
    ) -> None:
        super().__init__(folder, workshop)
        self._place, self._recipe, self._flags = folder / "d", recipe, flags
        self._given: list[str] = []
        self.wanted = workshop.saved(workshop.recorded(recipe))
        self.many = int(flags[1]) if flags[:1] == ("--workers",) else 1
        self.name = "record" + (f" {' '.join(flags[:2])}" if flags else "")
        if had:
            source = workshop.packed(recipe, had) if packed else workshop.recorded(recipe, had)
            shutil.copytree(source, self._place)
            self.name += " --resume, packed before" if packed else " --resume"

    @property
    def root(self) -> Path | None:
        return self._place if Layout(self._place).manifest.is_file() else None

    def words(self) -> list[str] | None:
        if not (self.folder / f".{self._place.name}.shards" / "plan.json").exists():
            there = sum(map(count_lines, rows_of_lines(Layout(self._place)))) if self.root else 0
            if there == EPISODES:
                return None
            more = ["--resume"] if self.root else []
            self._given = [*more, "--dataset.num_episodes", str(EPISODES - there)]
        return [command("record"), str(self._place), *self._recipe.flags, *self._flags, *self._given]

    def progress(self) -> int:
        return lines_of(self._place)

    def saved(self) -> Saved:
        return saved_by(self._place)


class RayRecording(RecordingWork):
    """`handrail-record --ray` on a cluster of two computers, both here."""

    def __init__(self, folder: Path, workshop: Workshop, recipe: Recipe) -> None:
        said = folder / CLUSTER
        words, log = [str(Path(__file__).with_name("ray_nodes.py")), str(said)], folder / "cluster.log"
        with open(log, "w") as file:
            self._cluster = subprocess.Popen(
                [sys.executable, *words], stdout=file, stderr=file, start_new_session=True
            )
        wait_until(lambda: said.exists() or self._cluster.poll() is not None, _CLUSTER_STARTS)
        if not said.exists():
            self.close()
            raise TimeoutError(f"no Ray cluster: {log.read_text()[-300:]}")
        address = json.loads(said.read_text())["address"]
        super().__init__(folder, workshop, recipe, ("--ray", address))
        self.name = "record --ray"

    def close(self) -> None:
        self._cluster.terminate()
        try:
            self._cluster.wait(_CLUSTER_ENDS)
        except subprocess.TimeoutExpired:
            for pid in (*members(self._cluster.pid), self._cluster.pid):
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            self._cluster.wait()
