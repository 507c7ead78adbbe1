"""Which piece of work a round is about."""

from pathlib import Path

import numpy as np

from handrail.scripts.bench.soak.edits import Editing
from handrail.scripts.bench.soak.faults import KILLED, Fault
from handrail.scripts.bench.soak.recordings import RayRecording, Recording
from handrail.scripts.bench.soak.runs import Evaluation, Replaying
from handrail.scripts.bench.soak.work import Work
from handrail.scripts.bench.soak.workshop import RECIPES, Recipe, Workshop

_RAY = 0.2  # share of the kills that befall a recording on a cluster


def any_work(
    folder: Path, workshop: Workshop, rng: np.random.Generator, fault: Fault, only: str = ""
) -> Work:
    """Return a piece of work.

    Args:
        folder: for it, empty.
        workshop: that it takes from.
        rng: chooses.
        fault: that it must be fit for.
        only: the only kind that is wanted; any when empty.
    """
    recipe = RECIPES[int(rng.integers(len(RECIPES)))]
    kinds = {"record": 5, "record_2": 4, "resume": 2, "packed": 2, "edit": 4, "evaluate": 1, "replay": 1}
    if fault.workers:
        kinds = {"record_2": 5, "evaluate_2": 1}
    if fault.cluster or (not only and rng.random() < _RAY and fault.codes >= KILLED):
        return RayRecording(folder, workshop, recipe)
    names = [only] if only else list(kinds)
    share = np.array([kinds.get(name, 1) for name in names], float)
    kind = str(rng.choice(names, p=share / share.sum()))
    if kind == "edit":
        return _any_edit(folder, workshop, rng, recipe)
    if kind.startswith("evaluate"):
        return Evaluation(folder, workshop, 2 if fault.workers or rng.random() < 0.5 else 1)
    if kind == "replay":
        return Replaying(folder, workshop, recipe)
    shared = ("--workers", "2") if kind == "record_2" or rng.random() < 0.2 else ()
    had = int(rng.choice((2, 4))) if kind in ("resume", "packed") else 0
    return Recording(folder, workshop, recipe, shared, had, packed=kind == "packed")


def _any_edit(folder: Path, workshop: Workshop, rng: np.random.Generator, recipe: Recipe) -> Work:
    whole, part = workshop.recorded(recipe), workshop.recorded(recipe, 4)
    edits = {
        "pack in place": (("pack", "{}/d"), {"d": whole}, "d"),
        "pack into another folder": (("pack", "{}/d", "--output", "{}/n"), {"d": whole}, "n"),
        "merge": (("merge", "{}/d", "{}/e", "--output", "{}/n"), {"d": whole, "e": part}, "n"),
        "merge into the first": (("merge", "{}/d", "{}/e", "--output", "{}/d"), {"d": whole, "e": part}, "d"),
        "edit delete": (("edit", "delete", "{}/d", "--episodes", "1", "3", "--in_place"), {"d": whole}, "d"),
        "edit trim": (("edit", "trim", "{}/d", "--in_place"), {"d": whole}, "d"),
        "edit keep": (
            ("edit", "keep", "{}/d", "--episodes", "2-5", "--output", "{}/n"),
            {"d": whole},
            "n",
        ),
    }
    name = str(rng.choice(list(edits)))
    words, sources, result = edits[name]
    return Editing(folder, workshop, f"{name}, {recipe.name}", words, sources, result)
