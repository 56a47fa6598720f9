"""Scenes whose nodes multiply are refused by the limit on nodes, before their surfaces are built."""

import json
from pathlib import Path

import pytest

from warpjld.cli import main
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.io.mesh_file import read_mesh


def nested_instances(path: Path, levels: int, each: int) -> Path:
    """A stage whose every level holds instances of the next: ``each`` ** ``levels`` meshes from a few kilobytes."""
    parts = ["#usda 1.0\n"]
    for level in range(levels):
        kids = "\n".join(
            f'    def "k{k}" (\n        instanceable = true\n        references = </L{level + 1}>\n    ) {{}}'
            for k in range(each)
        )
        parts.append(f'{"def" if level == 0 else "class"} Xform "L{level}" {{\n{kids}\n}}\n')
    mesh = (
        "int[] faceVertexCounts = [3]",
        "int[] faceVertexIndices = [0, 1, 2]",
        "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]",
    )
    parts.append(f'class Xform "L{levels}" {{\n def Mesh "m" {{\n' + "\n".join(mesh) + "\n }\n}\n")
    path.write_text("".join(parts))
    return path


@pytest.mark.parametrize("most", [3_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_instances_of_instances(
    tmp_path: Path, most: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pxr")
    monkeypatch.setenv("WARPJLD_LIMIT_NODES", str(most))
    path = nested_instances(tmp_path / "a.usda", 7, 10)  # ten million meshes from 6 kB
    with pytest.raises(SystemExit) as ended:
        main(["inspect", str(path), "--no-picture"])
    assert ended.value.code == 1
    (said,) = capsys.readouterr().err.splitlines()
    assert f"a.usda: {most + 1:,} nodes; the limit is {most:,} (raise it by warpjld --limit nodes=" in said
    assert "WARPJLD_LIMIT_NODES" in said


def test_instances_below_the_limit_are_all_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pxr")
    path = nested_instances(tmp_path / "a.usda", 2, 3)
    prims = 1 + 3 + 9 + 9  # the top, its instances, theirs, and their meshes
    monkeypatch.setenv("WARPJLD_LIMIT_NODES", str(prims - 1))
    with pytest.raises(InputError, match=rf"a\.usda: {prims} nodes; the limit is {prims - 1} "):
        load_rig(path)
    monkeypatch.setenv("WARPJLD_LIMIT_NODES", str(prims))
    with pytest.raises(InputError, match=r"skeleton|joints"):  # read to its end: three triangles have no bones
        load_rig(path)


def test_nodes_of_a_gltf_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WARPJLD_LIMIT_NODES", "1000")
    chain = [{"name": f"n{k}", "children": [k + 1]} for k in range(1_000)] + [{"name": "last"}]
    content = {"asset": {"version": "2.0"}, "nodes": chain, "scenes": [{"nodes": [0]}]}
    (tmp_path / "a.gltf").write_text(json.dumps(content))
    for read in (load_rig, read_mesh):
        with pytest.raises(InputError, match=r"a\.gltf: 1,001 nodes; the limit is 1,000 .*--limit nodes="):
            read(tmp_path / "a.gltf")
