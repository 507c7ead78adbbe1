"""The report of people and scripted operators: a page, one JSON, the contrasts and the trials as CSV."""

from pathlib import Path
from typing import Any

from handrail.datasets.comparison.people import PeopleComparison
from handrail.datasets.comparison.report import write_report
from handrail.datasets.comparison.user_study import Trial
from handrail.datasets.presentation.markup import folded, items, page, paragraph, section

FORMAT = "handrail.people/2"
_HOW = (
    "A participant's value is the mean over their episodes of a task in a condition. A difference is taken"
    " within each participant, over the scenes that they met under both conditions, else of their means; then"
    " the mean over participants. Intervals are 95 %, by a bootstrap that resamples participants. p:"
    " permutation of the signs of the participants' differences, exact where there are few, adjusted by Holm"
    " over each table. A difference is detected if its interval leaves zero out and p stays below 0.05."
)


def write_people_report(comparison: PeopleComparison) -> list[Path]:
    """Write the report into the folder of its config and return the files."""
    source = {"source": comparison.study.source}
    content = source | {
        "format": FORMAT,
        "demo": comparison.study.demo,
        "baseline": comparison.baseline,
        "participants": comparison.participants,
        "cautions": comparison.cautions,
        "conditions": {
            part.title: {name: [mean.content for mean in means] for name, means in part.means.items()}
            for part in comparison.parts
        },
    }
    contrasts = [each for part in comparison.parts for each in part.contrasts]
    units = {"trials.csv": [source | _trial(trial) for trial in comparison.trials]}
    return write_report(comparison.config.folder, _page(comparison), content, contrasts, units, source)


def _page(comparison: PeopleComparison) -> str:
    study = comparison.study
    note = [study.source] if study.demo else []
    said = items(("caution", text) for text in (*note, *comparison.cautions))
    meanings = {each.title: each.meaning for part in comparison.parts for each in part.measures}
    told = items(("quiet", f"{title}: {meaning}.") for title, meaning in meanings.items())
    return page(
        f"{study.root.absolute().name}: people, compared",
        section("", said) if note or comparison.cautions else "",
        *(section("", table) for table in comparison.tables),
        section("How to read this", paragraph(_HOW), folded("What every measure means", told)),
        what=f"{len(comparison.participants)} participants; baseline {comparison.baseline}",
    )


def _trial(each: Trial) -> dict[str, Any]:
    return {
        "task": each.task,
        "condition": each.condition,
        "participant": each.participant,
        "operator": "person" if each.participant else "scripted",
        "scene": each.scene,
        "dataset": each.dataset.name if each.dataset else "",
        "episode": each.episode,
        **each.values,
    }
