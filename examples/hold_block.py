"""Two soft pads squeeze a block: the gentlest grip at which it does not fall, and the readings of the pads.

python examples/hold_block.py [folder] [weight in N] [friction]

Writes the readings of the pads while they close and while the weight is applied, as a plot and a table, and a picture
of the block held. The exact force of each pad is weight / (2 × friction); here it is found by closing the pads.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import warpjld as wj
from warpjld.fem.contact import Pair
from warpjld.fem.hand import hand_laws
from warpjld.simulation.grip.prescribed_trials import PrescribedTrials
from warpjld.simulation.grip.search import Grip, GripStatus, gentlest_grip
from warpjld.simulation.report.tactile import tactile_of_pairs
from warpjld.simulation.report.tactile_files import draw_tactile, write_tactile

EDGE = 0.03  # of the block [m]
PAD = (0.004, 0.024, 0.024)  # [m]
GRAVITY = 9.81


def pads_and_block(weight: float, friction: float) -> PrescribedTrials:
    """Two soft pads on rigid backs touch a block from both sides; a grip is the way [m] by which each back closes."""
    half = 0.5 * EDGE
    block = wj.fem.box_hexes((EDGE, EDGE, EDGE), (3, 3, 3), origin=(-half, -half, -half), name="block")
    parts = [replace(block, faces={f"block.{side}": faces for side, faces in block.faces.items()})]
    for name, start, skin, back in (("left", -half - PAD[0], "x+", "x-"), ("right", half, "x-", "x+")):
        pad = wj.fem.box_hexes(PAD, (2, 4, 4), origin=(start, -0.5 * PAD[1], -0.5 * PAD[2]), name=f"{name}.flesh")
        parts.append(replace(pad, faces={f"pad.{name}": pad.faces[skin], f"{name}.back": pad.faces[back]}))
    mesh = wj.fem.merge(*parts)
    stuff = wj.fem.LinearElastic(1e6, 0.3, density=weight / GRAVITY / EDGE**3)
    body = wj.fem.Body(mesh, {"block": stuff} | hand_laws(mesh.region_names, poisson=0.3))

    def closed(way: float) -> wj.fem.Prescribed:
        left = wj.fem.prescribe(mesh, "left.back", x=way, y=0.0, z=0.0)
        return left + wj.fem.prescribe(mesh, "right.back", x=-way, y=0.0, z=0.0)

    pads = [
        Pair("pad.left", "block.x-", friction=friction, name="pad.left"),
        Pair("pad.right", "block.x+", friction=friction, name="pad.right"),
    ]
    return PrescribedTrials(body, closed, pads, "block", (0.0, 0.0, -GRAVITY))


def draw(path: Path, holding: PrescribedTrials, grip: float, title: str) -> None:
    """The deformed pads and block cut along the grip, before the weight came on and under it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    from warpjld.fem.output.vtk import grid_of

    instants = holding.found[grip].instants
    figure = Figure(figsize=(10.0, 5.0), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    mesh = holding.body.mesh
    panels = (("closed", instants[0]), ("under its weight", instants[-1]))
    for axis, (name, instant) in zip(figure.subplots(1, 2, sharey=True), panels, strict=True):
        grid = grid_of(mesh)
        grid.points = mesh.nodes + instant.displacement
        cut = grid.slice(normal=(0.0, 1.0, 0.0), origin=(0.0, 1e-6, 0.0))
        for region in range(len(mesh.region_names)):
            part = cut.threshold([region, region], scalars="region").extract_surface(algorithm="dataset_surface")
            flat = 1e3 * np.asarray(part.points)[:, [0, 2]]
            corners = [flat[face] for face in part.irregular_faces]
            color = "#9aa5b1" if mesh.region_names[region] == "block" else "#e8a88a"
            axis.add_collection(PolyCollection(corners, facecolors=color, edgecolors="#00000050", linewidths=0.6))
        axis.set(title=name, aspect="equal", xlabel="mm", xlim=(-23, 23), ylim=(-19, 19))
    figure.savefig(path, metadata={"Software": None})


def main(folder: Path, weight: float, friction: float) -> Grip:
    """Write the results into a folder; the gentlest grip."""
    started = time.perf_counter()
    holding = pads_and_block(weight, friction)
    found = gentlest_grip(holding, 2e-5, 1e-3, weight=weight, friction=friction, start=5e-5, tolerance=0.004)
    print(found.text)
    if found.status is not GripStatus.HELD:
        return found
    each = 0.5 * found.trial.force
    print(
        f"each pad presses with {each:.3f} N; {0.5 * weight / friction:.3f} N are needed; "
        f"backs closed by {1e3 * found.grip:.3f} mm; "
        f"{found.ended}, in {time.perf_counter() - started:.0f} s"
    )
    instants = holding.found[found.grip].instants
    felt = tactile_of_pairs(instants)
    draw_tactile(folder / "pads.png", felt, "What the pads feel")
    write_tactile(folder / "pads.csv", felt)
    draw(folder / "block.png", holding, found.grip, f"{weight:g} N held by {each:.2f} N from each side")
    return found


if __name__ == "__main__":
    given = sys.argv[1:]
    target = Path(given[0]) if given else Path()
    target.mkdir(parents=True, exist_ok=True)
    main(target, float(given[1]) if len(given) > 1 else 0.6, float(given[2]) if len(given) > 2 else 0.5)
