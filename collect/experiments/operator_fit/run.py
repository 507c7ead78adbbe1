"""Reads the episodes, fits with a progress bar, and prints and writes what came out."""

from pathlib import Path

import numpy as np
from rich.progress import Progress

from handrail.collect.experiments.operator_fit.config import FitOperatorConfig
from handrail.collect.experiments.operator_fit.episodes import Steered, check_alike, read_steered
from handrail.collect.experiments.operator_fit.fit import ROUNDS, TRIED_BESIDE, fit_operator
from handrail.collect.experiments.operator_fit.report import as_json, fit_table, sentences
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.strict_json import write_json


def run_fit(config: FitOperatorConfig, console: Terminal) -> None:
    """Fit as configured.

    Raises:
        HandrailError: a setting is wrong, or a dataset cannot be used.
    """
    config.check()
    found, left_out = _episodes(config)
    with Progress(console=Terminal(stderr=True), transient=True) as progress:
        bar = progress.add_task("trying operators", total=ROUNDS * config.draws + TRIED_BESIDE)
        rng = np.random.default_rng(config.seed)
        fit = fit_operator(found, config.draws, rng, lambda: progress.advance(bar))
    console.print(fit_table(fit))
    for sentence in sentences(fit, left_out):
        console.print(sentence)
    if config.output:
        with explained(f"--output {config.output}"):
            write_json(Path(config.output).expanduser(), as_json(fit, left_out))
        console.print(f"Written: {config.output}")


def _episodes(config: FitOperatorConfig) -> tuple[list[Steered], list[str]]:
    """Return the episodes that are used, evenly chosen, and why others are not.

    Raises:
        HandrailError: a dataset cannot be used, or there is no episode of one device.
    """
    found: list[Steered] = []
    left_out: list[str] = []
    for root in config.datasets:
        for each in read_steered(Path(root).expanduser(), config.participant, config.device):
            (left_out if isinstance(each, str) else found).append(each)  # pyright: ignore[reportArgumentType]
    check_alike(found)
    count = min(config.episodes, len(found))
    chosen = np.linspace(0, len(found) - 1, count).round().astype(int)
    return [found[place] for place in chosen], left_out
