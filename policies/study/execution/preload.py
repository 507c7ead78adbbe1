"""What the server that jobs are forked from loads: all that is heavy, and nothing that starts a thread."""

import os

for _name in ("OMP", "MKL", "OPENBLAS"):
    os.environ[f"{_name}_NUM_THREADS"] = "1"
os.environ.setdefault("HF_HUB_OFFLINE", "1")

import handrail.datasets.comparison.compare  # noqa: E402
import handrail.policies.imitation.evaluation.evaluation  # noqa: E402
import handrail.policies.imitation.training.run  # noqa: E402
import handrail.policies.imitation.training.training  # noqa: E402, F401
