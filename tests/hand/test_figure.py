"""The built-in body: the 87-point actor, ready (R12)."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.hand.figure import build_body
from warpjld.skeleton.actor import actor_skeleton
from warpjld.skeleton.actor_points import ACTOR_POINTS, CANONICAL


def test_all_87_points_are_joints_inside_a_closed_surface(figure):
    assert sorted(figure.skeleton.names) == sorted(CANONICAL.values())
    mesh = trimesh.Trimesh(figure.surface.vertices, figure.surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.euler_number == 2
    assert mesh.contains(figure.skeleton.rest).all()
    actor = actor_skeleton(figure.skeleton, figure.surface.vertices, figure.surface.faces)
    assert list(actor.points) == list(ACTOR_POINTS)


def test_it_has_the_height_and_is_its_own_mirror_image(figure):
    assert np.ptp(figure.surface.vertices[:, 1]) == pytest.approx(1.75)
    rest = dict(zip(figure.skeleton.names, figure.skeleton.rest, strict=True))
    for name, place in rest.items():
        if name.startswith("left."):
            np.testing.assert_allclose(rest[name.replace("left.", "right.")], place * (-1, 1, 1), atol=1e-12)


@pytest.mark.parametrize(("options", "said"), [({"height": 17.5}, "height"), ({"resolution": 10}, "resolution")])
def test_measures_out_of_range_are_refused(options, said):
    with pytest.raises(InputError, match=said):
        build_body(**options)
