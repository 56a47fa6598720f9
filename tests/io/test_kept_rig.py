"""A kept rig is the one that was read, is read anew when anything that counts has changed, and refuses the same."""

from __future__ import annotations

import shutil
from dataclasses import fields
from pathlib import Path

import numpy as np
import pygltflib as gl
import pytest

from tests.covering.test_kept_key import modules_reached
from warpjld.errors import InputError
from warpjld.files.kept_files import CACHE_VARIABLE
from warpjld.io import kept_rig as module
from warpjld.io import load_rig
from warpjld.io.kept_rig import kept_rig, rig_sources
from warpjld.limits import variable

_HAND = Path(__file__).parents[3] / "shared/data/hand_webxr_generic/left.glb"
_READERS = ("warpjld.io.gltf.skin", "warpjld.io.vrm", "warpjld.io.assemble", "warpjld.io.kept_rig")

pytestmark = pytest.mark.skipif(not _HAND.is_file(), reason="needs the data folder's WebXR hand")


@pytest.fixture
def hand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "kept"))
    return Path(shutil.copyfile(_HAND, tmp_path / "hand.glb"))


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Files that were read rather than taken from the cache."""
    files: list[Path] = []
    monkeypatch.setattr(module, "load_rig", lambda path, **how: files.append(path) or load_rig(path, **how))
    return files


def _same(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray):
        return isinstance(other, np.ndarray) and one.dtype == other.dtype and np.array_equal(one, other)
    if hasattr(one, "__dataclass_fields__"):
        return type(one) is type(other) and all(
            _same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one)
        )
    if isinstance(one, tuple):
        return isinstance(other, tuple) and len(one) == len(other) and all(map(_same, one, other))
    return one == other


def test_it_is_the_one_that_was_read(hand: Path, read: list[Path]) -> None:
    first, again = kept_rig(hand), kept_rig(str(hand))
    assert read == [hand]
    assert _same(again, load_rig(hand))
    assert _same(first, again)


def test_pictures_inside_the_file_are_kept(hand: Path, read: list[Path]) -> None:
    """A base colour texture in the file's own buffer, as most textured rigs have theirs."""
    file = gl.GLTF2().load_binary(str(hand))
    file.images, file.textures = [gl.Image(bufferView=0, mimeType="image/png")], [gl.Texture(source=0)]
    painted = gl.PbrMetallicRoughness(baseColorTexture=gl.TextureInfo(index=0))
    file.materials = [gl.Material(pbrMetallicRoughness=painted)]
    for primitive in file.meshes[0].primitives:
        primitive.material = 0
    file.save_binary(str(hand))
    first, again = kept_rig(hand), kept_rig(hand)
    assert len(read) == 1
    assert first.surface.parts[0].texture
    assert _same(first, again)


def test_what_counts_is_the_content_the_arguments_and_the_limits(
    hand: Path, read: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = kept_rig(hand)
    moved = kept_rig(shutil.copytree(tmp_path, tmp_path / "moved", ignore=lambda *_: ["kept"]) / "hand.glb")
    assert moved.path == tmp_path / "moved/hand.glb"
    assert len(read) == 1
    assert np.allclose(kept_rig(hand, scale=2.0).surface.vertices, 2.0 * rig.surface.vertices, atol=1e-6)
    names = tmp_path / "map.json"
    for joint in ("thumb-tip", "index-finger-tip"):
        names.write_text(f'{{"ignore": ["{joint}"]}}')
        kept_rig(hand, joint_map=names)
    assert len(read) == 4
    monkeypatch.setenv(variable("vertices"), "100")
    with pytest.raises(InputError, match=r"hand\.glb: .*the limit is 100"):
        kept_rig(hand)


def test_formats_that_refer_to_other_files_and_missing_files_are_read_anew(hand: Path, read: list[Path]) -> None:
    with pytest.raises(InputError, match="no such file"):
        kept_rig(hand.with_name("none.glb"))
    surface = hand.with_suffix(".obj")
    surface.write_text("v 0 0 0\n")
    for _ in range(2):
        with pytest.raises(InputError, match="has no joints"):
            kept_rig(surface)
    assert len(read) == 3
    assert not (hand.parent / "kept").exists()


def test_every_module_that_reading_runs_through_counts() -> None:
    counted = {file.resolve() for _, file in rig_sources()}
    reached = modules_reached(_READERS)
    assert len(reached) > 40
    missing = {module for module, file in reached.items() if file.resolve() not in counted}
    assert missing <= {"warpjld", "warpjld_kernels"}, f"reading imports {sorted(missing)}, unknown to kept_rig.py"
