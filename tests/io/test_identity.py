"""What a file is: its bytes and those of the files that hold a part of it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from warpjld.files.manifest import file_hash
from warpjld.io.identity import content_hash, files_of


def test_a_gltf_is_its_buffers_too(tmp_path: Path) -> None:
    path = tmp_path / "rig.gltf"
    buffers = [{"uri": "a%20b.bin"}, {"uri": "data:application/octet-stream;base64,AA=="}]
    path.write_text(json.dumps({"buffers": buffers, "images": [{"uri": "skin.png"}]}))
    (tmp_path / "a b.bin").write_bytes(b"one")
    (tmp_path / "skin.png").write_bytes(b"one")
    before = content_hash(path)
    (tmp_path / "skin.png").write_bytes(b"two")
    assert content_hash(path) == before
    (tmp_path / "a b.bin").write_bytes(b"two")
    assert content_hash(path) != before
    (tmp_path / "a b.bin").unlink()
    assert content_hash(path) != before


def test_a_usd_stage_is_its_layers_too(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    (tmp_path / "below.usda").write_text('#usda 1.0\ndef Xform "A" {}\n')
    path = tmp_path / "rig.usda"
    path.write_text("#usda 1.0\n(\n    subLayers = [@./below.usda@]\n)\n")
    assert files_of(path) == [(tmp_path / "below.usda").resolve()]
    before = content_hash(path)
    (tmp_path / "below.usda").write_text('#usda 1.0\ndef Xform "B" {}\n')
    assert content_hash(path) != before


@pytest.mark.parametrize("name", ["rig.glb", "walk.bvh", "broken.gltf", "list.gltf", "broken.usda"])
def test_what_refers_to_nothing_is_its_bytes(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("[]" if name == "list.gltf" else "{")
    assert content_hash(tmp_path / name) == file_hash(tmp_path / name)
