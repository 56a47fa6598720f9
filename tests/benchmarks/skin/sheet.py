"""A picture sheet of one rig: poses downwards, methods side by side, each row in one camera close to what moves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.skin.poses import pose
from tests.benchmarks.skin.rigs import BenchRig
from warpjld.render.camera import Camera
from warpjld.render.scene import Image, SceneRenderer
from warpjld.render.sheet import grid
from warpjld.skeleton import Skeleton
from warpjld.skeleton.actor import body_facing
from warpjld.skeleton.hand import DIGITS

__all__ = ["draw_sheet"]

_SIZE = (300, 300)
_ROWS = 8  # poses on one sheet; more go on the next


def draw_sheet(bench: BenchRig, methods: list[str], drawn: dict[str, list[NDArray[np.floating]]], folder: Path) -> None:
    """Write RIG.png, RIG-2.png … into a folder.

    Args:
        bench: The rig.
        methods: Names of the columns.
        drawn: Pose → surface of every method, each (V, 3).
        folder: Made where it is missing.
    """
    from PIL import Image as Pictures

    folder.mkdir(parents=True, exist_ok=True)
    names = list(drawn)
    for number, first in enumerate(range(0, len(names), _ROWS), start=1):
        some = names[first : first + _ROWS]
        rows = [_row(bench, name, drawn[name]) for name in some]
        sheet = grid(rows, captions=methods, row_captions=some, title=bench.name)
        Pictures.fromarray(sheet).save(folder / f"{bench.name}{f'-{number}' if number > 1 else ''}.png")


def _row(bench: BenchRig, name: str, surfaces: list[NDArray[np.floating]]) -> list[Image]:
    skeleton, faces = bench.rig.skeleton, bench.covering.surface.faces
    joints = dict(zip(skeleton.names, skeleton.rest, strict=True))
    up, forward = body_facing(joints)
    posed = pose(name, skeleton)
    assert posed is not None, name
    moved = np.asarray(surfaces[-1])
    by_fingers = any(skeleton.names[j].rpartition(".")[0].endswith(DIGITS) for j in posed.bent)
    if by_fingers or up is None or forward is None:
        side = skeleton.names[posed.bent[0]].partition(".")[0]
        shown = moved[_of_hand(bench, side)]
        out, along = _hand_axes(skeleton, side)
        camera = Camera.view("radial", shown, forward=out, up=along, side="left" if side == "left" else "right")
    else:
        shown = moved[np.isin(_owners(bench), posed.limb)]
        # from the front and the moved side, a little above
        camera = Camera.view("three-quarter", shown, forward=forward, up=up, side="right")
    camera = camera.closer(0.8)
    with SceneRenderer(faces, camera, size=_SIZE) as scene:
        return [scene.draw(points) for points in surfaces]


def _owners(bench: BenchRig) -> NDArray[np.int64]:
    begins = np.array([fan.segments[0].proximal for fan in bench.covering.fans])
    return np.asarray(begins[bench.covering.domains.argmax(axis=1)])


def _of_hand(bench: BenchRig, side: str) -> NDArray[np.bool_]:
    """Vertices of the palm and digits of a side."""
    parts = [
        f for f, n in enumerate(bench.covering.fans) if n.name.startswith(f"{side}.") and _is_hand(n.name.split(".")[1])
    ]
    return np.isin(bench.covering.domains.argmax(axis=1), parts)


def _is_hand(word: str) -> bool:
    return word in DIGITS or word in ("palm", "carpus")


def _hand_axes(skeleton: Skeleton, side: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where the palm looks to, and from the wrist to the fingers."""
    at = {n.removeprefix(f"{side}."): p for n, p in zip(skeleton.names, skeleton.rest, strict=True)}
    along = at["middle.base"] - at["wrist"]
    across = at["index.base"] - at["pinky.base"]
    out = np.cross(across, along) if side == "right" else np.cross(along, across)
    return out, along
