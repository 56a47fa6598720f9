"""A hand's mesh out of a file is the mesh that was made."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from warpjld.files.kept_files import CACHE_VARIABLE
from warpjld.hand.kept import kept_hand
from warpjld.simulation.bodies import kept_flesh
from warpjld.skeleton.kinematics import rest_poses


def test_a_mesh_out_of_a_file_is_the_one_that_was_made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    rig = kept_hand("left", resolution=1500)
    poses, skin = rest_poses(rig.skeleton), np.asarray(rig.surface.vertices, np.float64)
    monkeypatch.setenv(CACHE_VARIABLE, "off")
    plain = kept_flesh.resting_flesh(rig, 0.006, "left", poses, skin)
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    first = kept_flesh.resting_flesh(rig, 0.006, "left", poses, skin)
    assert {file.name.partition("-")[0] for file in tmp_path.iterdir()} == {"flesh", "rest"}
    monkeypatch.setattr(kept_flesh, "build_flesh_hand", None)  # it is not made again
    monkeypatch.setattr(kept_flesh, "rest_in_pose", None)
    again = kept_flesh.resting_flesh(rig, 0.006, "left", poses, skin)
    for one in (first, again):
        assert one.notes == ()
        assert one.gap == plain.gap
        assert one.cushions == plain.cushions
        assert one.hand.label_names == plain.hand.label_names
        for part in ("weights", "skin_faces", "skin_labels", "excluded", "skin_fringes"):
            np.testing.assert_array_equal(getattr(one.hand, part), getattr(plain.hand, part))
        np.testing.assert_array_equal(one.hand.mesh.nodes, plain.hand.mesh.nodes)
        np.testing.assert_array_equal(one.built.mesh.nodes, plain.built.mesh.nodes)
        np.testing.assert_array_equal(one.hand.mesh.elements, plain.hand.mesh.elements)
        assert one.hand.mesh.node_sets.keys() == plain.hand.mesh.node_sets.keys()
        np.testing.assert_array_equal(one.hand.skin(), plain.hand.skin())
