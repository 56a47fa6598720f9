"""Flesh between skin and bones under gravity: a hand meshed with hexahedra, its bones fixed, gravity acting sideways.

python examples/hand_gravity.py [RIG] [folder] [spacing in mm]

RIG is a rig file, or builtin:left. Writes a picture, a VTK file, and the sagging skin in the rig's own topology.
"""

import sys
import time
from pathlib import Path

import numpy as np

import warpjld as wj
from warpjld.fem.flesh import flesh_of
from warpjld.fem.output.pictures import draw
from warpjld.fem.output.vtk import write_vtu


def main(rig_name: str, folder: Path, spacing: float) -> float:
    """Write the results into a folder and return the largest displacement of the skin [m]."""
    rig = wj.build_hand("left") if rig_name == "builtin:left" else wj.load_rig(rig_name)
    started = time.perf_counter()
    flesh = flesh_of(rig, spacing)
    meshed = time.perf_counter()
    laws = {
        "flesh": wj.fem.LinearElastic(young=60e3, poisson=0.48, density=1050.0),
        "bone": wj.fem.LinearElastic(young=17e9, poisson=0.3, density=1900.0),
    }
    body = wj.fem.Body(flesh.mesh, laws)
    found = wj.fem.solve(body, flesh.held(), wj.fem.Loads(gravity=(0.0, 0.0, -9.81)))
    solved = time.perf_counter()

    sag = flesh.skin.carry(found.displacement)
    np.save(folder / "skin.npy", (rig.surface.vertices + sag).astype(np.float32))
    write_vtu(folder / "hand.vtu", body, found.last)
    draw(folder / "hand.png", body, found.last, "displacement", f"{rig.name}: gravity sideways")
    for note in flesh.fit.notes:
        print("note:", note)
    print(
        f"{len(flesh.mesh.elements)} elements, {body.degrees} degrees of freedom, {len(flesh.bones)} bones; "
        f"least scaled Jacobian {flesh.fit.least:.2f}, volume {100 * flesh.fit.volume:.1f} % of the surface's\n"
        f"meshed in {meshed - started:.1f} s, solved in {solved - meshed:.1f} s ({found.last.iterations} iterations); "
        f"the skin sags by {1e3 * np.linalg.norm(sag, axis=1).max():.2f} mm at most"
    )
    return float(np.linalg.norm(sag, axis=1).max())


if __name__ == "__main__":
    given = sys.argv[1:]
    target = Path(given[1]) if len(given) > 1 else Path()
    target.mkdir(parents=True, exist_ok=True)
    main(given[0] if given else "builtin:left", target, 1e-3 * float(given[2]) if len(given) > 2 else 0.003)
