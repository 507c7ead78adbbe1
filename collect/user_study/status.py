"""Who is where in a study."""

from handrail.collect.user_study.design import UserStudy
from handrail.collect.user_study.folder import StudyFolder
from handrail.collect.user_study.plan import plan
from handrail.datasets.presentation.table import Table


def status(folder: StudyFolder, study: UserStudy) -> Table:
    """Return a table of the participants: what is done, and what comes next.

    Raises:
        HandrailError: a file or a dataset is damaged.
    """
    rows = []
    for who in folder.participants():
        steps, left = plan(study, who.slot), folder.left(study, who)
        stands = "being erased" if who.erasing else str(left[0]) if left else "done"
        rows.append((who.name, ", ".join(who.modes), f"{len(steps) - len(left)} of {len(steps)}", stands))
    return Table(("participant", "order", "steps done", "next"), tuple(rows))
