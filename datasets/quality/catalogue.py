"""Every quality metric, in the order of the report: what `@metric` made in these modules.

Installed packages add theirs by entry points of the group `handrail.metrics`; one that cannot be imported is
left out with a warning.

These numbers describe a dataset; they do not rank it. In a 2026 study the best defect detector gave the worst
policy, and five of seven metrics exploited the length of the episodes: look at them beside the outcome.
"""

from handrail.controllers.registry import Registry, importable
from handrail.datasets.quality import consistency, effort, motion, safety, takeover, tracking
from handrail.datasets.quality.metric import Metric

_MODULES = (motion, consistency, tracking, safety, effort, takeover)
_OURS = (each for module in _MODULES for each in vars(module).values() if isinstance(each, Metric))
METRICS = tuple(spec for _, spec in importable(Registry("metric", Metric, _OURS)))
