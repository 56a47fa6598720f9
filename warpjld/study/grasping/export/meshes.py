"""Export as surfaces: hand and object in contact, with contact maps of both.

One folder per trial: ``hand.obj`` and ``object.obj`` to full precision, vertices in the rig's and the object's order;
``grasp.glb`` with both, coloured by the hand's parts in contact; ``contact.npz``. ``grasps.json`` lists the trials.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.files.manifest import write_json
from warpjld.files.whole_file import whole_file
from warpjld.grasp import GraspObject
from warpjld.grasp.quality.contact_map import ContactMap, contact_map
from warpjld.grasp.segments import SEGMENTS, vertex_segments
from warpjld.skeleton import poses_from_angles
from warpjld.study.grasping.export.grasps import ClosedTrial, write_obj
from warpjld.study.grasping.load import Hand, closer_of, hand_of, thing_of
from warpjld.study.grasping.plan import Measuring

__all__ = ["write_meshes"]

_SKIN, _THING = (224, 180, 158), (190, 192, 196)
_DIGITS = {"thumb": (214, 69, 65), "index": (232, 145, 45), "middle": (222, 197, 44), "ring": (76, 153, 84),
           "pinky": (58, 117, 196), "palm": (134, 84, 168)}  # fmt: skip


def write_meshes(trials: Sequence[ClosedTrial], measuring: Measuring, folder: Path) -> list[Path]:
    """Write the surfaces of each trial."""
    folder.mkdir(parents=True, exist_ok=True)
    files, listed = [folder / "grasps.json"], []
    for trial in trials:
        files += _write(trial, measuring, folder / str(trial.trial))
        row = trial.row
        named = {"name": f"trial {trial.trial}", "hand": trial.hand.name, "object": trial.thing.name}
        numbers = {"scale": trial.scale, "friction": row["friction"], "mass": row["mass"]}
        listed.append({**named, **numbers, "skin": f"{trial.trial}/hand.obj"})
    write_json(files[0], {"format": "warpjld_grasp_meshes", "format_version": 1, **_HEADER, "grasps": listed})
    return files


_HEADER: dict[str, Any] = {
    "unit": "m",
    "frame": "the object's: Y up, the middle of its bounding box at 0",
    "contact.npz": {
        "skin_distance": "signed distance of each vertex of the skin to the object [m], negative inside; exact within "
        "1 cm, infinite beyond",
        "skin_contact": "whether it is in contact: nearer than measuring.contact",
        "skin_part": "part of the hand it belongs to, in parts; -1 for none",
        "object_distance": "signed distance of each vertex of the object to the skin, likewise",
        "object_contact": "whether it is in contact",
        "object_part": "part of the hand nearest to it where it is in contact, else -1",
    },
    "parts": list(SEGMENTS),
}


def _write(trial: ClosedTrial, measuring: Measuring, folder: Path) -> list[Path]:
    folder.mkdir(parents=True, exist_ok=True)
    hand = hand_of(trial.hand)
    body = thing_of(trial.thing, trial.scale, measuring.density).body
    root = {"root_position": trial.displacement[None], "root_rotation": trial.rotation[None]}
    skin = hand.covering.deform(poses_from_angles(hand.rig.skeleton, trial.angles[None], **root), threads=1)[0]
    both = closer_of(trial.hand, trial.thing, trial.scale, measuring.density).both
    found = contact_map(both, skin, vertex_segments(hand.covering), tolerance=measuring.contact)
    files = [folder / name for name in ("hand.obj", "object.obj", "contact.npz", "grasp.glb")]
    write_obj(
        files[0], skin, hand.rig.surface.faces, f"trial {trial.trial}: {trial.hand.name}; metres, the object's frame"
    )
    write_obj(files[1], body.vertices, body.faces, f"trial {trial.trial}: {trial.thing.name}; metres, its own frame")
    with whole_file(files[2]) as part, part.open("wb") as file:
        np.savez_compressed(file, **vars(found))
    _write_glb(files[3], hand, skin, body, found)
    return files


def _write_glb(path: Path, hand: Hand, skin: NDArray[np.float32], body: GraspObject, found: ContactMap) -> None:
    import trimesh

    scene = trimesh.Scene()
    for name, vertices, faces, contact, part, plain in (
        ("hand", skin, hand.rig.surface.faces, found.skin_contact, found.skin_part, _SKIN),
        ("object", body.vertices, body.faces, found.object_contact, found.object_part, _THING),
    ):
        colors = _colors(contact, part, plain)
        mesh = trimesh.Trimesh(vertices, faces, vertex_colors=colors, process=False)
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    with whole_file(path) as where:
        where.write_bytes(scene.export(file_type="glb"))


def _colors(contact: NDArray[np.bool_], part: NDArray[np.integer], plain: tuple[int, int, int]) -> NDArray[np.uint8]:
    table = np.array([_DIGITS[name.partition(".")[0]] for name in SEGMENTS] + [plain], dtype=np.uint8)
    rgb = table[np.where(contact & (part >= 0), part, len(SEGMENTS))]
    return np.column_stack([rgb, np.full(len(rgb), 255, dtype=np.uint8)])
