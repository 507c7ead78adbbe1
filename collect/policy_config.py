"""The settings of a policy that drives beside the operator; light to import."""

from dataclasses import dataclass, field
from typing import Annotated

from handrail.collect.flags import one_of
from handrail.collect.operators.shared.catalogue import ARBITERS
from handrail.collect.operators.shared.settings import ArbiterSettings
from handrail.controllers.errors import HandrailError
from handrail.datasets.advanced import Advanced
from handrail.datasets.lists import Words

_SUPERVISORS = ("supervisor", "hand_supervisor")


@dataclass(frozen=True)
class PolicyConfig:
    """Which policy drives, and who owns what when the operator takes over."""

    policy: Advanced[Words] = ()
    """Let a trained policy drive while the operator supervises it: its folder; several are an ensemble."""
    arbiter: Advanced[Annotated[str, one_of(ARBITERS)]] = "by_mask"
    """With --policy: who owns what when the operator takes over."""
    arbitration: Advanced[ArbiterSettings] = field(default_factory=ArbiterSettings)

    def check_policy(self, operator: str) -> None:
        """Check that there is a policy to supervise, and an ensemble where its doubt decides."""
        ARBITERS.check(self.arbiter)
        if operator in _SUPERVISORS and not self.policy:
            raise HandrailError(f"--operator {operator}: expected --policy, the folder of one to supervise")
        if not self.policy and (self.arbiter, self.arbitration) != ("by_mask", ArbiterSettings()):
            raise HandrailError("--arbiter, --arbitration: expected --policy too, found none to share with")
        if self.arbiter == "risk" and len(self.policy) == 1:  # it never says how unsure it is
            raise HandrailError("--arbiter risk: expected several folders after --policy, got 1")
