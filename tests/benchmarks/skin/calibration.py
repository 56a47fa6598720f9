"""Whether a calibrated covering is worse than the default one in any pose of the benchmark."""

from __future__ import annotations

from tests.benchmarks.skin.measures import Measured

__all__ = ["worse"]

VOLUME, VOLUME_FREE = 0.2, 1.0  # growth of the error that does not count, error that may be [% of the whole]
FOLDS, FOLDS_MORE = 1.05, 3  # faces folded at joints: factor and number
ROUGHNESS, ROUGHNESS_MORE = 1.05, 0.1  # factor and degrees


def worse(before: Measured, after: Measured) -> list[str]:
    """What of one pose got worse, in words; nothing within the tolerances above."""
    out = []
    if abs(after.volume) > max(abs(before.volume) + VOLUME, VOLUME_FREE):
        out.append(f"volume {before.volume:+.2f} → {after.volume:+.2f} %")
    if after.joint > FOLDS * before.joint + FOLDS_MORE:
        out.append(f"{before.joint} → {after.joint} faces folded")
    if after.roughness > ROUGHNESS * before.roughness + ROUGHNESS_MORE:
        out.append(f"roughness {before.roughness:.2f} → {after.roughness:.2f} degrees")
    return out
