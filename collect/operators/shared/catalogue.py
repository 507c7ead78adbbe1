"""The arbiters by name; light to import."""

from handrail.controllers.registry import Buildable, Registry


class ArbiterSpec(Buildable):
    """An arbiter: one entry makes it, by `(groups, settings) -> Arbiter`.

    It gets the `Groups` of the robot's channels and the `ArbiterSettings`.
    """


_HERE = "handrail.collect.operators.shared"
ARBITERS = Registry(
    "arbiter",
    ArbiterSpec,
    (
        ArbiterSpec(
            "by_mask",
            f"{_HERE}.by_input:ByMask",
            "the person has the channels that they move, the policy the rest",
        ),
        ArbiterSpec("whole", f"{_HERE}.by_input:Whole", "any input of the person takes the whole robot"),
        ArbiterSpec("blend", f"{_HERE}.by_input:Blend", "where both ask, both are in the MPC's objective"),
        ArbiterSpec(
            "emics", f"{_HERE}.emics:emics", "the policy takes all back where the robot gains too little"
        ),
        ArbiterSpec(
            "hier_emics",
            f"{_HERE}.emics:hier_emics",
            "as emics, but never against a person with a purpose, nor to one who is away",
        ),
        ArbiterSpec("risk", f"{_HERE}.risk:Risk", "as by_mask, but the policy lets go while it is unsure"),
    ),
)
