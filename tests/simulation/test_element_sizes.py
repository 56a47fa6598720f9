"""A hand that one size of elements does not mesh is meshed with another, and that is told."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.simulation.bodies import flesh_body
from warpjld.simulation.specification import FleshMaterial


def meshed(monkeypatch: pytest.MonkeyPatch, good: float) -> float:
    """Edge of the elements where only those up to ``good`` make a mesh."""

    def mesh(rig: object, element: float, name: str, poses: object, skin: object, bones: object) -> str:
        if element > good:
            raise InputError(
                f"mesh: least scaled Jacobian 0.01 below 0.1: a smaller spacing than {element:g} m is needed"
            )
        return "flesh"

    monkeypatch.setattr(flesh_body, "resting_flesh", mesh)
    actor = SimpleNamespace(name="LEFT", rig=None)
    return flesh_body._meshed(actor, FleshMaterial(element=0.004), None, np.zeros((0, 3)))[1]  # type: ignore[arg-type]


def test_another_size_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    assert meshed(monkeypatch, 0.005) == 0.004
    assert meshed(monkeypatch, 0.0039) == pytest.approx(0.96 * 0.004)
    assert meshed(monkeypatch, 0.003) == pytest.approx(0.68 * 0.004)


def test_what_none_meshes_is_refused_with_the_size_that_was_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"FLESH LEFT: mesh: .* a smaller spacing than 0.004 m is needed"):
        meshed(monkeypatch, 0.001)
