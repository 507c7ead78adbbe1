"""Every quality metric, in the order of the report.

These numbers describe a dataset; they do not rank it. In a 2026 study the best defect detector gave the worst
policy, and five of seven metrics exploited the length of the episodes: look at them beside the outcome.
"""

from handrail.datasets.quality import effort, motion, safety, tracking
from handrail.datasets.quality.consistency import GROUP_METRICS

METRICS = (
    motion.length,
    motion.smoothness,
    motion.jerkiness,
    motion.directness,
    motion.idle_raw,
    motion.idle_pruned,
    *GROUP_METRICS,
    tracking.tracking_error,
    tracking.saturation,
    tracking.variation_ratio,
    safety.smallest_distance,
    safety.contacts,
    safety.impulse,
    safety.time_within_margin,
    safety.slack_used,
    effort.input_effort,
    effort.input_reversals,
    effort.mode_switches,
    effort.active_axes,
    effort.input_idle,
    effort.undos,
    effort.input_age,
    effort.round_trip,
)
