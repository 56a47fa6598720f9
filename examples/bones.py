"""A finger with bones of a surface file: a fingertip presses on a plate, over round bones and over waisted ones (R105).

python examples/bones.py OUT
"""

import sys
from pathlib import Path

import numpy as np
import trimesh

import warpjld as wj

PHALANGES = ("base", "knuckle2", "knuckle3", "tip")
HEAD, SHAFT = 0.0042, 0.0028  # radii of the proximal phalanx at its ends and in the middle [m]
BACK = np.array([0.0, 0.0035, 0.0])  # from the joints towards the back of the hand, where bones lie under the skin [m]
BONES = (("proximal", 1.0, 0.001), ("middle", 0.85, 0.001), ("distal", 0.6, 0.004))
"""Names, thickness per that of the proximal phalanx, and how far short of the far joint the bone ends [m]."""


def phalanx(start: np.ndarray, end: np.ndarray, thick: float, short: float) -> trimesh.Trimesh:
    """A bone from one joint to the next: a waisted body of revolution, closed, that begins a millimetre behind one."""
    length = float(np.linalg.norm(end - start)) - 0.001 - short
    along = np.linspace(0.0, 1.0, 13)
    radius = thick * (SHAFT + (HEAD - SHAFT) * (2.0 * along - 1.0) ** 2)
    profile = np.column_stack([radius, length * along])
    profile = np.vstack([[0.0, 0.0], profile, [0.0, length]])
    bone = trimesh.creation.revolve(profile, sections=24)
    bone.apply_transform(trimesh.geometry.align_vectors([0.0, 0.0, 1.0], end - start))
    bone.apply_translation(start + 0.001 * (end - start) / np.linalg.norm(end - start))
    return bone


def write_bones(rig: wj.Rig, path: Path) -> None:
    """An OBJ file with an object for each phalanx of the index finger, in the rig's unit and axes."""
    places = dict(zip(rig.skeleton.names, rig.skeleton.rest, strict=True))
    chain = [places[f"left.index.{joint}"] for joint in PHALANGES]
    lines, count = [], 0
    for (name, thick, short), start, end in zip(BONES, chain, chain[1:], strict=False):
        bone = phalanx(start + thick * BACK, end + thick * BACK, thick, short)
        lines += [f"o {name} phalanx", *(f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in bone.vertices)]
        lines += [f"f {a} {b} {c}" for a, b, c in bone.faces + count + 1]
        count += len(bone.vertices)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def main(out: Path, element: float = 0.0025) -> dict[str, float]:
    """Force on the finger [N] over each kind of bones, with elements of so many metres."""
    out.mkdir(parents=True, exist_ok=True)
    rig, frames = wj.build_hand("left"), 9
    write_bones(rig, out / "bones.obj")
    down = np.zeros((frames, 3))
    down[:, 1] = np.linspace(0.0, -0.0063, frames)  # the hand goes down by 6.3 mm [m]
    hand = wj.RecordedActor("hand", rig, angles=np.zeros((frames, len(rig.skeleton), 4)), root=down)
    plate = wj.RecordedObject("plate", trimesh.creation.box((0.036, 0.006, 0.036)), positions=(0.034, -0.0275, -0.165))
    forces = {}
    for kind, bones in (("round", None), ("waisted", out / "bones.obj")):
        flesh = wj.FleshMaterial(digits=("index",), element=element, bones=bones)
        contact = wj.ContactSpecification(flesh={"hand": flesh}, pressing=wj.SolveSpecification(0, 8, every=4))
        found = wj.simulate(contact, wj.RecordedAnimation([hand], [plate]))
        forces[kind] = float(found.force("hand")[-1, 1])
        print(f"{kind} bones: {forces[kind]:.3f} N on the finger, {found.solved.status.name}")
    return forces


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
