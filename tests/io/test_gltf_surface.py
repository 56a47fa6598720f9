"""Surfaces of glTF files without their joints: placed by their nodes, and nothing read that is not the file's."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.grasp.object_file import load_object
from warpjld.io.mesh_file import read_mesh


@pytest.fixture
def box(tmp_path: Path) -> Path:
    """A box in two places, the second mirrored, as JSON with its buffer beside it."""
    scene = trimesh.Scene()
    mesh = trimesh.creation.box((0.05, 0.06, 0.07))
    scene.add_geometry(mesh, geom_name="box", node_name="one")
    scene.add_geometry(
        mesh, geom_name="box", node_name="two", transform=np.diag([-1.0, 1, 1, 1]) + 0.5 * np.eye(4, k=3)
    )
    files = trimesh.exchange.gltf.export_gltf(scene)
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    return tmp_path / "model.gltf"


def test_it_is_what_trimesh_reads(box: Path) -> None:
    ours, theirs = read_mesh(box), trimesh.load(box, force="mesh", process=False)
    assert len(ours.vertices) == len(theirs.vertices) == 16
    assert trimesh.Trimesh(ours.vertices, ours.faces).volume == pytest.approx(2 * 0.05 * 0.06 * 0.07)
    np.testing.assert_allclose(ours.vertices.min(axis=0), theirs.vertices.min(axis=0), atol=1e-7)
    np.testing.assert_allclose(ours.vertices.max(axis=0), theirs.vertices.max(axis=0), atol=1e-7)
    assert [part.name for part in ours.parts] == ["box", "box_1"]


CHANGES: dict[str, Callable[[dict[str, Any]], object]] = {
    "negative stride": lambda g: g["bufferViews"][0].update(byteStride=-4096),
    "stride below the element": lambda g: [view.update(byteStride=4) for view in g["bufferViews"]],
    "offset before the buffer": lambda g: g["bufferViews"][0].update(byteOffset=-16),
    "offset behind the buffer": lambda g: g["bufferViews"][0].update(byteOffset=1 << 20),
    "count": lambda g: g["accessors"][1].update(count=10**9),
    "count without bytes": lambda g: (g["accessors"][1].update(count=10**9), g["accessors"][1].pop("bufferView")),
    "normalised indices": lambda g: [a.update(normalized=True) for a in g["accessors"] if a["type"] == "SCALAR"],
    "indices of another type": lambda g: [
        a.update(componentType=5126) for a in g["accessors"] if a["type"] == "SCALAR"
    ],
    "component type": lambda g: g["accessors"][0].update(componentType=77),
    "a count that is no number": lambda g: g["accessors"][0].update(count="9"),
    "no triangles": lambda g: [a.update(count=0) for a in g["accessors"]],
    "a child that is no node": lambda g: g["nodes"][0].update(children=[99]),
    "lists that are none": lambda g: g.update(accessors={"a": 1}),
}


@pytest.mark.parametrize("change", CHANGES)
def test_no_memory_but_the_files(box: Path, change: str) -> None:
    content = json.loads(box.read_text())
    CHANGES[change](content)
    box.write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"model\.gltf: "):
        load_object(box)


@pytest.mark.parametrize(
    "uri", ["../secret.bin", "/etc/hostname", "C:\\secret.bin", "file:///etc/hostname", "%2e%2e/a"]
)
def test_buffers_stay_in_the_files_folder(box: Path, uri: str) -> None:
    content = json.loads(box.read_text())
    content["buffers"][0]["uri"] = uri
    box.write_text(json.dumps(content))
    with pytest.raises(InputError, match="leads out of the file's own folder"):
        read_mesh(box)


def test_kinds_whose_readers_open_what_they_are_given(tmp_path: Path) -> None:
    for suffix in (".zip", ".tar.gz", ".npz", ".xdmf"):
        (tmp_path / f"a{suffix}").write_bytes(b"PK")
        with pytest.raises(InputError, match="not a kind of surface file"):
            read_mesh(tmp_path / f"a{suffix}")


@pytest.mark.parametrize(
    "text", ["v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "v 0 0 0\nf 1 1 1\n", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 2\n"]
)
def test_no_structure_is_built_on_a_surface_without_area(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.obj").write_text(text)
    with pytest.raises(InputError, match="no triangle with an area"):
        load_object(tmp_path / "a.obj")
