"""The library without scripts: build a hand, bend a finger, deform the skin, write the surface.

python examples/python_api.py [folder]
"""

import sys
from pathlib import Path

import numpy as np

import warpjld as wj


def main(folder: Path) -> Path:
    """Write ``bend.npz`` into a folder and return its path."""
    hand = wj.build_hand("left")

    motion = wj.Motion(rate=30)
    for frame, degrees in ((0, 0), (15, 70), (30, 0)):
        for joint in ("index.base", "index.knuckle2", "index.knuckle3"):
            motion.set_key(f"{joint}.flexion", frame, np.radians(degrees))

    poses = motion.poses(hand.skeleton)
    covering = wj.bind(hand)

    path = folder / "bend.npz"
    with wj.open_cache(path, hand.surface, frames=len(poses), rate=motion.rate) as cache:
        for _, vertices in covering.blocks(poses):
            cache.write(vertices)

    tip = hand.skeleton.index("index.tip")
    travel = np.ptp(poses.positions[:, tip], axis=0).max()
    print(f"{path}: {len(poses)} frames of {len(hand.surface.vertices)} vertices; the fingertip travels {travel:.3f} m")
    return path


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
