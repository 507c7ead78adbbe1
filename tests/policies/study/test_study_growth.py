"""Success over updates, and over the operator's minutes."""

from dataclasses import replace

from compare_helpers import check_texts
from figure_helpers import shows
from made_study import DESIGN, MODES, SHARES

from handrail.policies.study import tables
from handrail.policies.study.contrasts import contrasts
from handrail.policies.study.figures import figures


def test_success_over_updates_is_a_figure_and_stands_beside_all_updates(gathered):
    results = gathered(replace(DESIGN, curve=(5,)))
    whole, less = (results.find("reach", "ee", treatment) for treatment in ("", "after 5 updates"))
    made = figures(results, contrasts(results))
    assert "robustness" not in made
    assert shows(made["updates"], [100 * less.value.estimate, 100 * whole.value.estimate])
    check_texts(made["updates"])
    assert {row[1] for row in tables.treatments_table("reach", results).rows} == {"after 5 updates"}


def test_success_over_the_operators_minutes_is_a_figure(gathered):
    shares = SHARES | {f"{mode} 2 min": (0.25,) * 4 for mode in MODES}
    tasks = {"reach": replace(DESIGN.tasks["reach"], sizes=(2.0,)), "tray": DESIGN.tasks["tray"]}
    results = gathered(replace(DESIGN, tasks=tasks), shares)
    made = figures(results, contrasts(results))
    less, whole = (results.find("reach", label).value.estimate for label in ("ee 2 min", "ee"))
    assert shows(made["amounts"], [100 * less, 100 * whole])
    check_texts(made["amounts"])
    assert "amounts" not in figures(gathered(), ())
