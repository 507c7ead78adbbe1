"""Drives a recording of its own through its web server, and takes times from what comes and what is saved."""

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import psutil
from msgspec import Meta

from handrail.controllers.errors import HandrailError, imported
from handrail.controllers.typed import Count
from handrail.datasets.presentation.table import Table
from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.scripts.bench.latency.clients import DrivingPage, Spectator
from handrail.scripts.bench.report import ReportConfig, machine, report, spread

FPS = 20  # [Hz]
_QUICK, _SLOW = 4, 20  # pages that watch, and under load those that take things slowly
_SLOW_PAUSE = 0.2  # of a page that takes things slowly [s]
_LATENCIES = {
    "key to command": "key to commanded velocity",
    "key to page": "key to motion on the page",
    "round trip": "page to server and back",
    "release to brake": "release to commanded braking",
    "release to rest": "release to commanded rest",
}
_RATES = {
    "driver_frames_hz": "driver: frames a second",
    "driver_pictures_hz": "driver: pictures a second and camera",
    "spectator_frames_hz": "spectator: frames a second",
    "spectator_pictures_hz": "spectator: pictures a second and camera",
}


@dataclass(frozen=True)
class LatencyConfig(ReportConfig):
    """Measure how soon the robot does what a page asks, and whether its loop keeps time, also under load."""

    seconds: Annotated[int, Meta(ge=5)] = 30
    """How long each case is driven [s]."""
    overload: bool = True
    """Also measure with a busy program on every core, and pages that take what they are sent slowly."""
    browser: str = ""
    """Also measure with a browser that watches: where Chromium is, such as /usr/bin/chromium."""
    robot: str = "ridgeback_ur10"
    """A name, or a file, as `handrail-cockpit` takes it."""
    cameras: str = "wrist,scene"
    """Two of the robot's."""
    image_size: Count = 320
    """Height and width of the two cameras' pictures [pixels]; 0 for no cameras."""
    seed: Count = 0
    """Of the times at which a key is pressed."""

    def check(self) -> None:
        """Check the settings."""
        super().check()
        if self.browser and not os.access(self.browser, os.X_OK):
            raise HandrailError(f"--browser {self.browser}: expected a program, such as /usr/bin/chromium")


def _spent(recording: int) -> Mapping[str, float]:
    """Return how long our programs have kept a processor busy [s], by what they are."""
    spent, first = defaultdict[str, float](float), psutil.Process()
    for process in (first, *first.children(recursive=True)):
        with contextlib.suppress(psutil.Error):
            name = "recording" if process.pid == recording else _program("\0".join(process.cmdline()))
            spent[name] += sum(process.cpu_times()[:2])
    return spent


@contextlib.contextmanager
def busy(programs: int) -> Iterator[None]:
    """Keep processors busy with programs that do nothing else."""
    burners = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(programs)]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()


def measure(config: LatencyConfig) -> dict[str, Any]:
    """Measure; return everything as one dictionary.

    Args:
        config: how much to measure.
    """
    cases = {"as it should be": (0, 0, "")}  # slow pages, programs that keep processors busy, a browser
    if config.browser:
        cases["a browser watches too"] = (0, 0, config.browser)
    if config.overload:
        cases["overload"] = (_SLOW, os.cpu_count() or 1, "")
    load, rng, found = os.getloadavg()[0], np.random.default_rng(config.seed), {}
    with tempfile.TemporaryDirectory(prefix="handrail-latency-") as folder:
        root = Path(folder) / "dataset"
        with _recording(root, config, len(cases)) as (process, address):
            page = DrivingPage(address)
            for name, (slow, burners, browser) in cases.items():
                page.until(lambda frame: frame["phase"] == "ready")
                with busy(burners), _watching(slow, browser, address) as spectators:
                    page.ask("start")
                    page.until(lambda frame: frame["phase"] == "driving")
                    found[name] = _drive(page, spectators, config.seconds, rng, process.pid)
                    page.ask("success")
                    page.until(lambda frame: frame["phase"] != "driving")
            page.close()
            process.wait(300)
        for index, name in enumerate(cases):
            found[name] |= _saved(root, index)
    return {"cases": found, "seconds": config.seconds, "machine": machine(load)}


@contextlib.contextmanager
def _recording(root: Path, config: LatencyConfig, episodes: int) -> Iterator[tuple[Any, str]]:
    """Run `handrail-cockpit`; give its process and address."""
    command = [sys.executable, "-m", "handrail.scripts", "cockpit", str(root), "--task", "reach"]
    command += ["--robot", config.robot]
    command += ["--mode", "base", "--time_limit", str(config.seconds + 600), "--cockpit.no_open"]
    command += ["--cockpit.port", "0", "--dataset.num_episodes", str(episodes), "--dataset.fps", str(FPS)]
    if config.image_size:
        command += ["--cameras", config.cameras, "--image_size", str(config.image_size)]
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=log, text=True)
        try:
            lines = []
            for line in process.stderr or ():
                lines.append(line.strip())
                if "Drive at " in line:
                    yield process, line.split("Drive at ")[1].strip()
                    return
            raise HandrailError(f"latency: the recording did not begin: {' '.join(lines)[-300:]}")
        finally:
            if process.poll() is None:
                process.terminate()
            process.communicate(timeout=60)


def _drive(
    page: DrivingPage, watching: list[Spectator], duration: float, rng: np.random.Generator, process: int
) -> dict[str, Any]:
    counts = [(each.frames, each.pictures) for each in watching]
    spent, start = _spent(process), time.monotonic()
    page.drive(duration, rng)
    took = time.monotonic() - start
    shares = {name: (seconds - spent.get(name, 0.0)) / took for name, seconds in _spent(process).items()}
    counts = np.subtract([(each.frames, each.pictures) for each in watching], counts)
    frames, pictures = np.mean(counts, axis=0) / took
    return {
        "latencies_ms": {name: _spread(times) for name, times in page.times.items() if times},
        "driver_frames_hz": page.frames / took,
        "driver_pictures_hz": page.pictures / took / 2,
        "spectator_frames_hz": float(frames),
        "spectator_pictures_hz": float(pictures) / 2,
        "dropped": page.frame["dropped"],
        "processor_shares": shares,  # of one
    }


def _program(words: str) -> str:
    if "cockpit.server" in words:
        return "web server"
    if "while True" in words:
        return "burners"
    return "browser" if "chrom" in words.partition("\0")[0] else "clients"


@contextlib.contextmanager
def _watching(slow: int, browser: str, address: str) -> Iterator[list[Spectator]]:
    """Let pages watch; give those that take what they are sent at once."""
    pages = [Spectator(address, f"page-that-watches-{n}") for n in range(_QUICK)]
    late = [Spectator(address, f"page-that-is-slow-{n}", _SLOW_PAUSE) for n in range(slow)]
    try:
        with _browser(browser, address):
            time.sleep(2.0)
            yield pages
    finally:
        for each in (*pages, *late):
            each.close()


@contextlib.contextmanager
def _browser(program: str, address: str) -> Iterator[None]:
    """Let a browser watch, one that draws in software."""
    if not program:
        yield
        return
    with imported("playwright.sync_api", "--browser", "playwright", "dev").sync_playwright() as play:
        flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = play.chromium.launch(executable_path=program, args=flags)
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(address)
        time.sleep(5.0)
        yield
        browser.close()


def _saved(root: Path, episode: int) -> dict[str, Any]:
    """Return how the loop kept its time, as the saved episode says."""
    row = read_episodes(root)[episode]
    frames = read_frames(root, episode, ["wall_clock", "teleop.age", "controller.status"])
    jitter = np.abs(np.diff(frames["wall_clock"]) - 1.0 / FPS)
    return {
        "frames": int(row["length"]),
        "late_periods": int(row["late"]),
        "jitter_ms": _spread(jitter.tolist()),
        "input_age_ms": _spread(frames["teleop.age"].tolist()),
        "braked_updates": int(row["brakes"]),
    }


def _spread(times: list[float]) -> dict[str, float]:
    return {**spread(times, ("p50", "p95", "p99", "worst")), "n": len(times)}


def latency_table(results: Mapping[str, Any]) -> Table:
    """Return everything measured, a column for each case."""
    cases, computer = results["cases"], results["machine"]
    rows = [
        [words, *(_percentiles(case["latencies_ms"].get(name)) for case in cases.values())]
        for name, words in _LATENCIES.items()
    ]
    rows.append(["jitter of the loop, p99", *(f"{case['jitter_ms']['p99']:.1f}" for case in cases.values())])
    rows.append(["late periods", *(f"{each['late_periods']} of {each['frames']}" for each in cases.values())])
    rows += [[words, *(f"{case[name]:.1f}" for case in cases.values())] for name, words in _RATES.items()]
    rows.append(["share of a processor", *(_shares(case["processor_shares"]) for case in cases.values())])
    caption = (
        f"{computer['cores']} cores, load {computer['load_before']:.1f} before, {computer['load_after']:.1f} "
        f"after; {results['seconds']} s each, control at 20 Hz; times in ms as p50 / p95 / p99."
    )
    return Table(("", *cases), rows, "Latency of the cockpit", caption)


def _percentiles(times: Mapping[str, float] | None) -> str:
    return f"{times['p50']:.0f} / {times['p95']:.0f} / {times['p99']:.0f}" if times else "–"


def _shares(shares: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {100 * share:.0f} %" for name, share in shares.items() if share >= 0.005)


def main(config: LatencyConfig) -> int:
    """Measure and print the table."""
    results = measure(config)
    report("latency", config, [latency_table(results)], results)
    return 0
