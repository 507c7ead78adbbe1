"""Drives a recording of its own through its web server, and takes times from what comes and what is saved."""

import asyncio
import contextlib
import os
import subprocess
import sys
import tempfile
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.errors import HandrailError, not_installed
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.datasets.storage.strict_json import write_json
from handrail.scripts.bench.latency.clients import DrivingPage, Spectator, connected
from handrail.scripts.bench.latency.config import LatencyConfig
from handrail.scripts.bench.latency.table import latency_table, write_page

FPS = 20  # [Hz]
_SLOW_PAUSE = 0.2  # of a page that takes things slowly [s]


_TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


def family(process: int) -> dict[int, str]:
    """Return a process and its descendants, with their command lines; nothing where there is no /proc."""
    parents, words = {}, {}
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            parents[int(place.name)] = int((place / "stat").read_text().rpartition(")")[2].split()[1])
            words[int(place.name)] = (place / "cmdline").read_bytes().decode(errors="replace")
    found = {process} & set(words)
    while more := {each for each, parent in parents.items() if parent in found} - found:
        found |= more
    return {each: words.get(each, "") for each in found}


def seconds(process: int) -> float:
    """Return how long a process has kept a processor busy [s]."""
    with contextlib.suppress(OSError):
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / _TICKS
    return 0.0


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


@dataclass(frozen=True)
class LatencyCase:
    """What goes on beside the one who drives.

    Attributes:
        name: of it.
        spectators: pages that watch.
        slow: pages that take what they are sent slowly.
        burners: programs that keep processors busy.
        browser: Chromium that watches; empty for none.
    """

    name: str
    spectators: int
    slow: int = 0
    burners: int = 0
    browser: str = ""


def cases(config: LatencyConfig) -> list[LatencyCase]:
    """Return what is to be measured."""
    chosen = [LatencyCase("as it should be", config.spectators)]
    if config.browser:
        chosen.append(LatencyCase("a browser watches too", config.spectators, browser=config.browser))
    if config.overload:
        cores = os.cpu_count() or 1
        chosen.append(LatencyCase("overload", config.spectators, config.slow_spectators, cores))
    return chosen


def measure(config: LatencyConfig) -> dict[str, Any]:
    """Measure; return everything as one dictionary.

    Args:
        config: how much to measure.
    """
    chosen, load = cases(config), os.getloadavg()[0]
    with tempfile.TemporaryDirectory(prefix="handrail-latency-") as folder:
        root = Path(folder) / "dataset"
        with _recording(root, config, len(chosen)) as (process, address):
            came = asyncio.run(_drive_all(config, chosen, address, process.pid))
            process.wait(300)
        for index, case in enumerate(chosen):
            came[case.name] |= _saved(root, index)
    return {
        "cases": came,
        "seconds": config.seconds,
        "machine": {"cores": os.cpu_count(), "load_before": load, "load_after": os.getloadavg()[0]},
    }


@contextlib.contextmanager
def _recording(root: Path, config: LatencyConfig, episodes: int) -> Iterator[tuple[Any, str]]:
    """Run `handrail-cockpit`; give its process and address."""
    command = [sys.executable, "-m", "handrail.scripts.cockpit", str(root), "--task", "reach"]
    command += ["--mode", "base", "--time_limit", str(config.seconds + 600), "--cockpit.no_open"]
    command += ["--cockpit.port", "0", "--dataset.num_episodes", str(episodes), "--dataset.fps", str(FPS)]
    if config.image_size:
        command += ["--cameras", "wrist,scene", "--image_size", str(config.image_size)]
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=log, text=True)
        try:
            yield process, _address(process)
        finally:
            if process.poll() is None:
                process.terminate()
            process.communicate(timeout=60)


def _address(process: "subprocess.Popen[str]") -> str:
    said = []
    for line in process.stderr or ():
        if "Drive at " in line:
            return line.split("Drive at ")[1].strip()
        said.append(line.strip())
    raise HandrailError(f"latency: the recording did not begin: {' '.join(said)[-300:]}")


async def _drive_all(
    config: LatencyConfig, chosen: list[LatencyCase], address: str, process: int
) -> dict[str, dict[str, Any]]:
    """Return what came of each case."""
    rng, came = np.random.default_rng(config.seed), {}
    async with connected(address, "page-that-drives") as socket, DrivingPage(socket) as page:
        for case in chosen:
            await page.until(lambda frame: frame["phase"] == "ready")
            with busy(case.burners):
                async with _watching(case, address) as spectators:
                    await page.ask("start")
                    await page.until(lambda frame: frame["phase"] == "driving")
                    came[case.name] = await _drive(page, spectators, config.seconds, rng, process)
                    await page.ask("success")
                    await page.until(lambda frame: frame["phase"] != "driving")
    return came


async def _drive(
    page: DrivingPage, watching: list[Spectator], duration: float, rng: np.random.Generator, process: int
) -> dict[str, Any]:
    page.begin()
    before = [dict(each.counts) for each in watching]
    spent = {each: seconds(each) for each in family(os.getpid())}
    start = asyncio.get_running_loop().time()
    await page.drive(duration, rng)
    took = asyncio.get_running_loop().time() - start
    gained = [
        {kind: each.counts[kind] - was[kind] for kind in was}
        for each, was in zip(watching, before, strict=True)
    ]
    return {
        "latencies_ms": {name: _spread(times) for name, times in page.times.items() if times},
        "driver_frames_hz": page.frames / took,
        "driver_pictures_hz": page.pictures / took / 2,
        "spectator_frames_hz": _mean(each["frames"] for each in gained) / took,
        "spectator_pictures_hz": _mean(each["pictures"] for each in gained) / took / 2,
        "dropped": page.frame["dropped"],
        "processor_shares": _shares(spent, process, took),
    }


def _shares(spent: dict[int, float], recording: int, took: float) -> dict[str, float]:
    """Return how much of one processor each program took."""
    shares: dict[str, float] = {}
    for process, words in family(os.getpid()).items():
        program = words.partition("\0")[0]
        name = "browser" if "chrom" in program else "burners" if "while True" in words else "clients"
        name = "web server" if "cockpit.server" in words else name
        name = "recording" if process == recording else name
        used = (seconds(process) - spent.get(process, 0.0)) / took
        shares[name] = shares.get(name, 0.0) + used
    return shares


@contextlib.asynccontextmanager
async def _watching(case: LatencyCase, address: str) -> AsyncIterator[list[Spectator]]:
    """Let pages watch; give those that take what they are sent at once."""
    quick = [Spectator(address, f"page-that-watches-{n}") for n in range(case.spectators)]
    slow = [Spectator(address, f"page-that-is-slow-{n}", _SLOW_PAUSE) for n in range(case.slow)]
    tasks = [asyncio.create_task(each.watch()) for each in (*quick, *slow)]
    try:
        async with _browser(case.browser, address):
            await asyncio.sleep(2.0)
            yield quick
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


@contextlib.asynccontextmanager
async def _browser(program: str, address: str) -> AsyncIterator[None]:
    """Let a browser watch, one that draws in software."""
    if not program:
        yield
        return
    try:
        from playwright.async_api import async_playwright
    except ImportError as error:
        raise not_installed("--browser", "playwright", "dev") from error
    async with async_playwright() as play:
        flags = ["chromium", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"][1:]
        browser = await play.chromium.launch(executable_path=program, args=flags)
        page = await browser.new_page(viewport={"width": 1280, "height": 720})
        await page.goto(address)
        await asyncio.sleep(5.0)
        yield
        await browser.close()


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


def _mean(values: Iterator[float]) -> float:
    numbers = list(values)
    return float(np.mean(numbers)) if numbers else 0.0


def _spread(times: list[float]) -> dict[str, float]:
    """Return the spread of times [ms]."""
    p50, p95, p99, worst = np.percentile(1e3 * np.array(times), [50, 95, 99, 100])
    return {"p50": float(p50), "p95": float(p95), "p99": float(p99), "worst": float(worst), "n": len(times)}


def main(config: LatencyConfig) -> int:
    """Measure and print the table."""
    results = measure(config)
    if config.json:
        write_json(Path(config.json).expanduser(), results)
    if config.page:
        write_page(results, config)
    Terminal().print(latency_table(results))
    return 0
