"""What the server that jobs are forked from loads: all that is heavy, and nothing that starts a thread."""

import handrail.collect.execution.preload  # noqa: I001  (says how many threads there may be, before the rest)

import handrail.datasets.comparison.compare
import handrail.policies.imitation.evaluation.evaluation
import handrail.policies.imitation.training.run
import handrail.policies.imitation.training.training  # noqa: F401
