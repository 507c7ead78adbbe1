"""A study of made-up rollouts: four modes, two tasks, four draws, two declared pairs, and more beside."""

from handrail.policies.study.design import Beside, DeclaredPair, StudyDesign, TaskDesign

TASK = TaskDesign(minutes=1.0, episodes=5, steps=10)
MODES = ("ee", "decoupled", "joints", "direct")
PAIRS = (DeclaredPair("ee", "decoupled", margin=0.1, sd=0.05), DeclaredPair("ee", "direct", "number"))
LABELS = ["ee − decoupled", "ee − direct (same number)"]
DESIGN = StudyDesign(
    "made",
    MODES,
    {"reach": TASK, "tray": TASK},
    "direct",
    draws=4,
    rollouts=20,
    pairs=PAIRS,
    beside=Beside(("ee",), 4, 4),
)
SHARES = {
    "ee": (0.95, 0.9, 1.0, 0.9),
    "decoupled": (0.7, 0.6, 0.8, 0.75),
    "joints": (0.8, 0.75, 0.9, 0.8),
    "direct": (0.8, 0.7, 0.85, 0.75),
    "ee intent": (1.0, 1.0, 1.0, 1.0),
}
SHARES |= {f"{mode} same number": SHARES[mode] for mode in MODES}
