"""The rigs of the benchmark: hands and bodies of the data folder, and the hand of this package."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from warpjld.covering import Covering, bind_rig
from warpjld.covering.intersections import Parts, surface_parts
from warpjld.rig import Rig

__all__ = ["RIGS", "BenchRig", "load"]

_DATA = Path(__file__).resolve().parents[4] / "shared" / "data"

RIGS: dict[str, str | None] = {
    "builtin": None,
    "webxr": "hand_webxr_generic/left.glb",
    "webxr_right": "hand_webxr_generic/right.glb",
    "anny_hand": "hand_anny/left.glb",
    "anny_hand_right": "hand_anny/right.glb",
    "godot_low": "hand_godot_low/Hand_low_L.gltf",
    "godot_low_right": "hand_godot_low/Hand_low_R.gltf",
    "godot_nails": "hand_godot_low/Hand_Nails_low_L.gltf",
    "anny_low": "body_anny/body_lowpoly_163joints.glb",
    "mannequin": "body_mesh2motion_mannequin/human-male.glb",
    "anny_body": "body_anny/body_104joints.glb",
}
"""Name → file in the data folder; None is the built-in hand."""


@dataclass(frozen=True, eq=False)
class BenchRig:
    """A rig, bound by default parameters.

    Attributes:
        name: Key of ``RIGS``.
        rig: As loaded.
        covering: Its covering.
        parts: Of every face, to tell folds from contact.
    """

    name: str
    rig: Rig
    covering: Covering
    parts: Parts

    @property
    def is_body(self) -> bool:
        """Whether it is more than a hand."""
        return "pelvis" in self.rig.skeleton.names


def load(name: str) -> BenchRig | None:
    """The rig of a name; None where its file is not here."""
    path = RIGS[name]
    if path is None:
        from warpjld.hand import build_hand

        rig = build_hand("left", resolution=3000)
    elif (_DATA / path).is_file():
        from warpjld.io import load_rig

        rig = load_rig(_DATA / path)
    else:
        return None
    covering = bind_rig(rig)
    return BenchRig(name, rig, covering, surface_parts(covering))
