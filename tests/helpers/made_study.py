"""A study of made-up rollouts: a 2 × 2, two tasks, four draws, and everything beside."""

from handrail.policies.study.design import Beside, Factors, Flat, StudyDesign, TaskDesign

TASK = TaskDesign(minutes=1.0, episodes=5, steps=10)
MODES = ("ee", "decoupled", "joints", "direct")
FACTORS = Factors(*MODES)
DESIGN = StudyDesign(
    "made",
    MODES,
    {"reach": TASK, "tray": TASK},
    "direct",
    draws=4,
    rollouts=20,
    factors=FACTORS,
    beside=Beside(("ee",), 4, 4),
    flat=Flat(every=5, patience=1),
)
SHARES = {
    "ee": (0.95, 0.9, 1.0, 0.9),
    "decoupled": (0.7, 0.6, 0.8, 0.75),
    "joints": (0.8, 0.75, 0.9, 0.8),
    "direct": (0.8, 0.7, 0.85, 0.75),
    "ee intent": (1.0, 1.0, 1.0, 1.0),
}
SHARES |= {f"{mode} same number": SHARES[mode] for mode in MODES}
