"""Modules that the fork server loads first: one thread each, as they share the cores."""

import os

for _name in ("OMP", "MKL", "OPENBLAS"):
    os.environ[f"{_name}_NUM_THREADS"] = "1"
os.environ["LP_NUM_THREADS"] = "0"  # of Mesa's software rendering, besides the thread that asks for a picture
os.environ.setdefault("HF_HUB_OFFLINE", "1")
