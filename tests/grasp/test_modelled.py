"""Profiles turned and swept, and soft objects: volumes that are known, and what cannot be made."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.grasp.modelled import revolved, soft, swept
from warpjld.script import Interpreter, Scene

CIRCLE = [(np.cos(a), np.sin(a)) for a in np.linspace(0.0, 2.0 * np.pi, 33)]


def test_turned_profiles_have_guldins_volumes() -> None:
    ring = revolved([(0.05 + 0.01 * x, 0.01 * y) for x, y in CIRCLE], segments=200)
    assert ring.volume == pytest.approx(2.0 * np.pi**2 * 0.05 * 0.01**2, rel=0.01)
    post = revolved([(0.03, 0.0), (0.03, 0.1)], segments=200)
    assert post.volume == pytest.approx(np.pi * 0.03**2 * 0.1, rel=1e-3)
    cone = revolved([(0.0, 0.06), (0.02, 0.0)], segments=200)  # in either order
    assert cone.volume == pytest.approx(np.pi * 0.02**2 * 0.06 / 3.0, rel=1e-3)
    assert all(thing.report.watertight for thing in (ring, post, cone))


def test_swept_outlines() -> None:
    arrow = [(-0.01, -0.01), (0.01, -0.01), (0.01, 0.01), (0.0, 0.002), (-0.01, 0.01)]  # concave
    bar = swept(arrow, [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)])
    assert bar.volume == pytest.approx((4e-4 - 0.5 * 0.02 * 0.008) * 0.1, rel=1e-6)
    assert bar.vertices[:, 1].max() == pytest.approx(0.01)
    loop = swept([(0.01 * x, 0.01 * y) for x, y in CIRCLE], [(0.05 * x, 0.0, 0.05 * y) for x, y in CIRCLE])
    assert loop.volume == pytest.approx(2.0 * np.pi**2 * 0.05 * 0.01**2, rel=0.02)
    bent = swept([(0.01 * x, 0.01 * y) for x, y in CIRCLE], [(0, 0, 0), (0, 0.1, 0), (0.1, 0.1, 0.05)])
    assert all(thing.report.watertight for thing in (bar, loop, bent))


def test_soft_objects() -> None:
    one = soft([(0.1, 0.0, 0.0)], [0.03])
    assert np.linalg.norm(one.vertices - [0.1, 0.0, 0.0], axis=1) == pytest.approx(0.03, rel=0.01)
    two = soft([(0.0, 0.0, 0.0), (0.05, 0.0, 0.0)], [0.03, 0.03])
    assert two.report.watertight
    assert two.report.components == 1
    waist = two.vertices[np.abs(two.vertices[:, 0] - 0.025) < 0.002]
    assert np.hypot(waist[:, 1], waist[:, 2]).min() > np.sqrt(0.03**2 - 0.025**2) + 0.004  # fuller than two balls


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: revolved([(0.0, 0.0), (-0.1, 1.0)]), "0 or more"),
        (lambda: revolved([(0.0, 0.0), (0.0, 1.0)]), "encloses nothing"),
        (lambda: revolved([(0.1, 0.0), (0.1, 0.0)]), "two points or more"),
        (lambda: swept([(0, 0), (1, 1), (1, 0), (0, 1)], [(0, 0, 0), (0, 0, 1)]), "crosses itself"),
        (lambda: swept([(0, 0), (1, 1), (1, 0)], [(0, 0, 0)]), "a path needs two points"),
        (lambda: soft([(0.0, 0.0, 0.0)], [0.0]), "radii above 0"),
        (lambda: soft([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], [1e-4, 0.1]), "too small"),
    ],
)
def test_what_cannot_be_made_is_named(made: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        made()


def run(text: str) -> Scene:
    scene = Scene(say=lambda text: None)
    Interpreter(scene).run_text(text)
    return scene


def test_a_script_models_objects() -> None:
    scene = run(
        "OBJECT DISH REVOLVE 0 0 0.04 0 0.05 0.03 0.046 0.03 0.037 0.004 0 0.004 AT 0 0.1 0 COLOR 'teal'\n"
        "OBJECT BAR SWEEP -0.01 -0.01 0.01 -0.01 0 0.01 ALONG 0 0 0 0.1 0 0 0.2 0.1 0 SCALE 0.5\n"
        "OBJECT BLOB SOFT 0 0 0 0.03 0.04 0 0 0.02\n"
    )
    assert list(scene.props) == ["DISH", "BAR", "BLOB"]
    assert scene.props["DISH"].thing.place.position.tolist() == [[0.0, 0.1, 0.0]]
    assert scene.props["BAR"].thing.size[0] == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("OBJECT A REVOLVE 0 0 0.04", "expected the profile's y"),
        ("OBJECT A SWEEP 0 0 1 0 0 1", "expected ALONG"),
        ("OBJECT A SOFT 0 0 0 -1", "radii above 0"),
        ("OBJECT A REVOLVE 0.1 0 0.1 0.1 0.05 -0.05", "crosses itself"),
    ],
)
def test_wrong_lines_are_named(line: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        run(line)
