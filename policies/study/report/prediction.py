"""Which metric of a study's demonstrations says beforehand how its policies will do."""

from collections.abc import Iterator

import numpy as np

from handrail.datasets.comparison.prediction import MetricPrediction, PolicyCell, predictions
from handrail.policies.study.report.results import Results


def predicted(results: Results) -> list[MetricPrediction]:
    """Return how each metric of the recordings goes with the success of the main design's policies."""
    return predictions(list(_cells(results)), np.random.default_rng(results.progress.design.seed))


def _cells(results: Results) -> Iterator[PolicyCell]:
    for job in results.progress.jobs:
        cell, recorded = job.cell, results.progress.note(job).get("result")
        driven = results.find(cell.task, cell.mode, noise=cell.noise)
        if job.policy is None and recorded and driven and cell.draw in driven.draws:
            metrics = recorded["quality"] | recorded["learnability"]
            yield PolicyCell(cell.task, cell.mode, cell.draw, driven.shares[cell.draw], metrics)
