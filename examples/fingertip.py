"""A fingertip of the built-in hand pressed on a plate to 5 N: force, displacement and area, compared with people.

python examples/fingertip.py [folder] [spacing in mm] [angle between plate and finger in degrees]

Writes a plot over measurements on people, its numbers as a table, and a picture of the pressed fingertip.

Measurements on people:
- a plate at 20° to 40°, force exponential in displacement up to 2 N: Pawluk and Howe 1999, doi:10.1115/1.2800860;
- 1 N at 1.5 to 2 mm, then 3.5 N/mm or more: Serina et al. 1997, from memory;
- contact areas were measured from 0.25 to 7 N (Serina et al. 1998, doi:10.1016/S0021-9290(98)00067-0); their numbers
  are not available here, so only the range is shown.
"""

import csv
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import warpjld as wj
from warpjld.fem.contact import Pair, press
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.fem.hand import hand_laws
from warpjld.fem.hand.fingertip import Fingertip, build_fingertip
from warpjld.fem.output.vtk import grid_of

ENOUGH = 5.0  # N
STEP = 0.25e-3  # m
MEASURED = ((1.5e-3, 2.0e-3), 1.0, 3.5e3)  # displacement [m] at a force [N], and the slope from there on [N/m]


def pressed(tip: Fingertip, tilt: float, **law: float) -> list[SimpleNamespace]:
    """Push a plate into a fingertip until ``ENOUGH`` newtons; every instant's displacement, force, area and peak."""
    body = wj.fem.Body(tip.mesh, hand_laws(tip.mesh.region_names, **law))
    out = tip.facing(tilt)
    first = tip.mesh.nodes[int(np.argmax(tip.mesh.nodes @ out))]
    # time is the way of the plate in metres
    plate = Plane(first, -out, motion=lambda way: (-way * out, (0.0, 0.0, 0.0, 1.0)))
    steps = STEP * np.arange(1, 21)
    found = press(
        body,
        wj.fem.prescribe(tip.mesh, "held", x=0.0, y=0.0, z=0.0),
        [Pair("tip", plate, name="plate")],
        times=list(steps),
        watch=lambda instant: "enough" if instant.touches[0].normal_force > ENOUGH else None,
        check=False,
    )
    return [
        SimpleNamespace(
            way=instant.time,
            force=instant.touches[0].normal_force,
            area=instant.touches[0].contact_area,
            peak=instant.touches[0].peak,
            displacement=instant.displacement,
        )
        for instant in found.instants
    ]


def section(path: Path, tip: Fingertip, pressed_to: SimpleNamespace, tilt: float) -> None:
    """The fingertip cut along its bone, at rest and pressed: bone, pulp, skin and the plate."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    frame = np.stack([tip.along, tip.back], axis=1)
    out = tip.facing(tilt)
    touch = float((tip.mesh.nodes @ out).max())
    figure = Figure(figsize=(11.0, 4.4), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    still = np.zeros_like(pressed_to.displacement)
    panels = ((still, 0.0, "at rest"), (pressed_to.displacement, pressed_to.way, f"{pressed_to.force:.1f} N"))
    for axis, (displacement, way, title) in zip(figure.subplots(1, 2, sharey=True), panels, strict=True):
        grid = grid_of(tip.mesh)
        grid.points = tip.mesh.nodes + displacement
        cut = grid.slice(normal=np.cross(tip.back, tip.along), origin=tip.joint)
        for region, color in enumerate(("#e8a88a", "#c26b4f", "#f3efe2")):
            part = cut.threshold([region, region], scalars="region").extract_surface(algorithm="dataset_surface")
            flat = 1e3 * (np.asarray(part.points) - tip.joint) @ frame
            corners = [flat[face] for face in part.irregular_faces]
            axis.add_collection(PolyCollection(corners, facecolors=color, edgecolors="#00000030", linewidths=0.4))
        plate = np.array([out @ tip.along, out @ tip.back])
        foot = 1e3 * ((touch - way) - out @ tip.joint) * plate
        line = foot + 30.0 * np.array([[-plate[1], plate[0]], [plate[1], -plate[0]]])
        axis.plot(*line.T, color="#333333", lw=2.5)
        axis.set(title=title, aspect="equal", xlabel="mm", xlim=(-1, 28), ylim=(-10.5, 8.5))
    figure.savefig(path, metadata={"Software": None})


def plot(path: Path, curves: dict[str, list[SimpleNamespace]]) -> None:
    """Force over displacement and area over force."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 5.4), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    (low, high), force, slope = MEASURED
    end = high + (ENOUGH - force) / slope
    left.fill(
        1e3 * np.array([low, low, end, high]), [force, ENOUGH, ENOUGH, force], color="#9ecae1", alpha=0.45, lw=0,
        label="people: 1 N at 1.5–2 mm,\nthen 3.5 N/mm or more (from memory)",
    )  # fmt: skip
    left.plot([1e3 * low, 1e3 * high], [force, force], color="#3182bd", lw=3, solid_capstyle="butt")
    right.axvspan(0.25, 7.0, color="#9ecae1", alpha=0.3, lw=0, label="forces at which people's areas were measured")
    for (name, points), color in zip(curves.items(), ("#a63603", "#777777"), strict=False):
        way = np.array([0.0, *(p.way for p in points)])
        forces = np.array([0.0, *(p.force for p in points)])
        area = np.array([0.0, *(p.area for p in points)])
        left.plot(1e3 * way, forces, color=color, marker="o", ms=3.5, label=name)
        right.plot(forces, 1e6 * area, color=color, marker="o", ms=3.5, label=name)
    left.set(xlabel="displacement of the plate, mm", ylabel="force, N", xlim=(0, None), ylim=(0, ENOUGH))
    right.set(xlabel="force, N", ylabel="contact area, mm²", xlim=(0, ENOUGH), ylim=(0, None))
    for axis in (left, right):
        axis.grid(alpha=0.25)
        axis.legend(frameon=False, fontsize=9, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    figure.savefig(path, metadata={"Software": None})


def main(folder: Path, spacing: float, tilt: float) -> dict[str, float]:
    """Write the results into a folder; displacement at 1 N [m], stiffness from there to 5 N [N/m], areas [m²]."""
    started = time.perf_counter()
    tip = build_fingertip(wj.build_hand("left"), "index", spacing)
    curves = {}
    for name, law in (
        ("Fung β = 3; pulp 34 kPa, skin 80 kPa, ν .48", {}),
        ("neo-Hooke, the same moduli", {"stiffening": 0.0}),
    ):
        points = pressed(tip, tilt, **law)
        curves[name] = points
        if not law:
            section(folder / "fingertip.png", tip, points[-1], tilt)
    plot(folder / "force_and_area.png", curves)
    with (folder / "fingertip.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(["law", "displacement_m", "force_n", "area_m2", "peak_pressure_pa"])
        for name, points in curves.items():
            table.writerows([name, p.way, p.force, p.area, p.peak] for p in points)
    points = next(iter(curves.values()))
    way, force, area = (np.array([getattr(p, key) for p in points]) for key in ("way", "force", "area"))
    at_one, at_five = (float(np.interp(f, force, way)) for f in (1.0, ENOUGH))
    found = {
        "displacement_at_1N": at_one,
        "stiffness_1N_to_5N": (ENOUGH - 1.0) / (at_five - at_one),
        "area_at_1N": float(np.interp(1.0, force, area)),
        "area_at_5N": float(np.interp(ENOUGH, force, area)),
    }
    print(
        f"{len(tip.mesh.elements)} elements, pulp {1e3 * tip.thickness:.1f} mm, {time.perf_counter() - started:.0f} s\n"
        f"1 N at {1e3 * at_one:.2f} mm, then {1e-3 * found['stiffness_1N_to_5N']:.1f} N/mm to 5 N; "
        f"{1e6 * found['area_at_1N']:.0f} mm² at 1 N, {1e6 * found['area_at_5N']:.0f} mm² at 5 N"
    )
    return found


if __name__ == "__main__":
    given = sys.argv[1:]
    target = Path(given[0]) if given else Path()
    target.mkdir(parents=True, exist_ok=True)
    main(
        target,
        1e-3 * float(given[1]) if len(given) > 1 else 0.0012,
        np.radians(float(given[2]) if len(given) > 2 else 25.0),
    )
