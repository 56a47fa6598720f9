from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from warpjld.geometry.surface import Surface
from warpjld.io.caches import Cache, open_cache

pytest.importorskip("pxr")


@pytest.mark.parametrize("suffix", [".usd", ".usda", ".usdc"])
def test_mesh_with_time_samples(
    export: Callable[[str], Cache], surface: Surface, clip: np.ndarray, suffix: str
) -> None:
    from pxr import Usd, UsdGeom

    (path,) = export(f"a{suffix}").files
    stage = Usd.Stage.Open(str(path))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()) == (3, 9, 24)
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
    assert mesh.GetPrim().GetName() == "hand"
    assert mesh.GetSubdivisionSchemeAttr().Get() == "none"
    assert mesh.GetNormalsAttr().Get() is None
    assert UsdGeom.Mesh.ValidateTopology(
        mesh.GetFaceVertexIndicesAttr().Get(), mesh.GetFaceVertexCountsAttr().Get(), len(surface.weld)
    )[0]
    np.testing.assert_array_equal(np.reshape(mesh.GetFaceVertexIndicesAttr().Get(), (-1, 3)), surface.source_faces)
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    assert st.GetInterpolation() == "vertex"
    np.testing.assert_array_equal(st.Get(), surface.uv)
    np.testing.assert_array_equal(mesh.GetPointsAttr().Get(), surface.vertices.astype(np.float32)[surface.weld])
    assert mesh.GetPointsAttr().GetTimeSamples() == [3, 4, 5, 6, 7, 8, 9]
    for time, vertices in enumerate(clip, start=3):
        np.testing.assert_array_equal(mesh.GetPointsAttr().Get(time), vertices[surface.weld])
        extent = mesh.GetExtentAttr().Get(time)
        np.testing.assert_array_equal(extent, [vertices.min(axis=0), vertices.max(axis=0)])


def test_samples_saved_in_pieces_are_all_there(
    surface: Surface, clip: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from pxr import Usd, UsdGeom

    monkeypatch.setattr("warpjld.io.caches.usd._FLUSH_BYTES", 1000)
    with open_cache(tmp_path / "a.usdc", surface, frames=7, rate=24) as cache:
        cache.write(clip)
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    points = UsdGeom.Mesh(stage.GetDefaultPrim()).GetPointsAttr()
    for time, vertices in enumerate(clip):
        np.testing.assert_array_equal(points.Get(time), vertices[surface.weld])


def test_name_becomes_a_valid_identifier(surface: Surface, clip: np.ndarray, tmp_path: Path) -> None:
    from pxr import Usd

    with open_cache(tmp_path / "a.usda", surface, frames=7, rate=24, name="left hand/2") as cache:
        cache.write(clip)
    assert Usd.Stage.Open(str(tmp_path / "a.usda")).GetDefaultPrim().GetName() == "left_hand_2"


def test_text_needs_no_extra(
    surface: Surface, clip: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from pxr import Usd, UsdGeom

    from warpjld.io.caches import check_cache
    from warpjld.script.formats import check_available

    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "pxr", None)
        patch.setattr("warpjld.script.formats.find_spec", lambda name: None)
        check_cache("a.usda")
        check_available(["a.usda"])
        with open_cache(tmp_path / "a.usda", surface, frames=7, rate=29.97, start_frame=-2, name="7th é") as cache:
            cache.write(clip)
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
    assert mesh.GetPrim().GetName() == "_th__"
    assert (stage.GetTimeCodesPerSecond(), stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (29.97, -2, 4)
    np.testing.assert_array_equal(mesh.GetPointsAttr().Get(4), clip[-1][surface.weld])


def test_missing_extra_is_named() -> None:
    script = """
import sys, numpy as np
sys.modules["pxr"] = None
from warpjld.errors import MissingExtraError
from warpjld.io.caches import open_cache
from warpjld.geometry.surface import weld_surface
surface = weld_surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
try:
    open_cache("never.usdc", surface, frames=1, rate=25).__enter__()
except MissingExtraError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "warpjld[usd]" in done.stdout
    assert not Path("never.usdc").exists()
