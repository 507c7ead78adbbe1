"""The paper's Table I, for comparison: 100 goals, mean ± SD, and min, max where it gives them."""

from collections.abc import Mapping

_STATISTICS = ("mean", "std", "min", "max")
_RL = {
    "success": (0.97,),
    "final_position_error": (0.129, 0.341, 0.021, 3.503),
    "final_orientation_error": (0.037, 0.089, 0.000, 0.903),
    "length": (340.5, 134.6),
    "arm_effort": (62.6, 82.4),
    "base_path": (1.35, 0.84),
    "jerkiness": (0.681, 0.277),
    "wall_time_s": (1.82, 0.66),
}
_PROPOSED = {
    "success": (0.97,),
    "final_position_error": (0.098, 0.047, 0.032, 0.416),
    "final_orientation_error": (0.028, 0.016, 0.000, 0.050),
    "length": (340.6, 136.8),
    "arm_effort": (16.7, 14.2),
    "base_path": (1.64, 0.72),
    "jerkiness": (0.074, 0.069),
    "wall_time_s": (3.40, 1.34),
}


def _named(table: Mapping[str, tuple[float, ...]]) -> dict[str, dict[str, float]]:
    return {metric: dict(zip(_STATISTICS, values, strict=False)) for metric, values in table.items()}


PUBLISHED: Mapping[str, Mapping[str, Mapping[str, float]]] = {
    "paper: RL": _named(_RL),
    "paper: proposed": _named(_PROPOSED),
}
"""Controller → measure → mean, std, min, max, as far as given."""
