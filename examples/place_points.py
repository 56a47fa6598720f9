"""The 25 points of a hand, proposed from its surface alone, and the hand animated by them (B §2.1, R12).

python examples/place_points.py out
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh

import warpjld as wj
from warpjld.io.points_file import write_points_file


def main(folder: Path) -> float:
    """Mean distance [mm] of what is proposed from where the joints are."""
    folder.mkdir(parents=True, exist_ok=True)
    hand = wj.build_hand("left", resolution=1500)
    surface = folder / "hand.obj"
    trimesh.Trimesh(hand.surface.vertices, hand.surface.faces, process=False).export(surface)
    points = wj.propose_points(hand.surface.vertices, hand.surface.faces)
    write_points_file(folder / "points.json", points)
    rig = wj.load_rig(surface, points=folder / "points.json")
    assert sorted(rig.skeleton.names) == sorted(points)
    rest = dict(zip(hand.skeleton.names, hand.skeleton.rest, strict=True))
    return 1e3 * float(np.mean([np.linalg.norm(place - rest[name]) for name, place in points.items()]))


if __name__ == "__main__":
    print(f"{main(Path(sys.argv[1] if len(sys.argv) > 1 else '.')):.1f} mm from the joints on the average")
