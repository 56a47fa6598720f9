"""The palm is found on the built-in hands, and turned to where it is to look."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.grasp.palm import Palm, palm_of
from warpjld.rig import Rig


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_palm_of_the_built_in_hand(hands: dict[str, Rig], side: str) -> None:
    """It lies palm down, fingers along −Z."""
    rig = hands[side]
    inside = palm_of(rig.skeleton)
    palm = inside.on_skin(rig.surface.vertices)
    assert palm.normal @ [0.0, -1.0, 0.0] > 0.95
    assert palm.fingers @ [0.0, 0.0, -1.0] > 0.95
    assert palm.normal @ palm.fingers == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(rig.surface.vertices - palm.middle, axis=1).min() < 0.006
    assert palm.middle[1] < inside.middle[1] < rig.skeleton.rest[rig.skeleton.index("middle.base"), 1] + 0.01
    np.testing.assert_array_equal(palm_of(rig.skeleton, side).normal, inside.normal)


def test_skin_on_the_wrong_side_is_no_palm(hands: dict[str, Rig]) -> None:
    palm = palm_of(hands["left"].skeleton)
    with pytest.raises(InputError, match="no skin on the palm's side"):
        palm.on_skin(palm.middle - 0.01 * palm.normal[None])


def test_turned_it_looks_where_it_should() -> None:
    palm = Palm(np.zeros(3), np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, -1.0]), 0.08)
    normal, fingers = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]]), np.array([[0.0, 0.6, 0.8], [-1.0, 0.0, 0.0]])
    turns = palm.turned_to(normal, fingers)
    np.testing.assert_allclose(turns @ palm.normal, normal, atol=1e-15)
    np.testing.assert_allclose(turns @ palm.fingers, fingers, atol=1e-15)
    np.testing.assert_allclose(np.linalg.det(turns), 1.0)
    np.testing.assert_array_equal(palm.turned_to(normal[0], fingers[0]), turns[0])
