"""Reader of grasps given as deformed skins, as ``study --export mesh`` writes them.

``grasps.json`` lists them::

    {"format": "warpjld_grasp_meshes", "format_version": 1,
     "grasps": [{"name": "trial 0", "hand": "right", "object": "ball", "scale": 1, "friction": 0.6, "mass": 0.04,
                 "skin": "0/hand.obj"}, …]}

A skin is an OBJ file in metres, in the object's frame, with the rig's vertices in the rig's order.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.errors import InputError
from warpjld.files.text_file import read_json
from warpjld.io.obj_file import read_obj
from warpjld.rig import Rig
from warpjld.study.scoring.given import GivenGrasp
from warpjld.study.scoring.reading_grasps import GraspReading, number_in

__all__ = ["FORMAT", "LISTED", "read_meshes"]

FORMAT = "warpjld_grasp_meshes"
LISTED = "grasps.json"


def read_meshes(path: Path, how: GraspReading) -> list[GivenGrasp]:
    """Read the grasps of a list of surfaces.

    Raises:
        InputError: Not such a list, or a surface that does not have the rig's topology.
    """
    content = read_json(path)
    if not isinstance(content, Mapping) or content.get("format") != FORMAT or content.get("format_version") != 1:
        raise InputError(f"want a list of surfaces: format {FORMAT}, format_version 1", path=path)
    listed = content.get("grasps")
    if not isinstance(listed, list) or not listed:
        raise InputError("has no grasps", path=path)
    try:
        return [_grasp(entry, path.parent, how) for entry in listed]
    except InputError as error:
        raise InputError(error.message, path=error.path or path, line=error.line) from None


def _grasp(entry: Any, folder: Path, how: GraspReading) -> GivenGrasp:
    if not isinstance(entry, Mapping) or not all(isinstance(entry.get(key), str) for key in ("name", "object", "skin")):
        raise InputError("want name, object and skin of every grasp")
    more: dict[str, Any] = {"hand": str(entry.get("hand", ""))}
    more |= {key: number_in(entry[key], key, above=0.0) for key in ("scale", "friction", "mass") if key in entry}
    file = folder / entry["skin"]
    if not file.resolve().is_relative_to(folder.resolve()):
        raise InputError(f"{entry['name']}: '{entry['skin']}' lies outside of the folder")
    return GivenGrasp(entry["name"], entry["object"], skin=_skin(file, how.hand(more["hand"])), **more)


def _skin(file: Path, rig: Rig) -> Any:
    mesh, wanted = read_obj(file), len(rig.surface.vertices)
    if len(mesh.vertices) != wanted or not np.array_equal(mesh.faces, rig.surface.faces):
        raise InputError(f"is not this hand's skin: want its {wanted} vertices and its triangles", path=file)
    return mesh.vertices.astype(np.float32)
