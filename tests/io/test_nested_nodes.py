"""Instances inside instances: a few lines that stand for a million nodes are refused by the limit of nodes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from warpjld.errors import InputError
from warpjld.io import load_rig

_LEVELS = 20  # 2²⁰ nodes
_SAYS = r"1,0\d\d nodes; the limit is 1,000 \(raise it by warpjld --limit nodes="


@pytest.fixture(autouse=True)
def _few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WARPJLD_LIMIT_NODES", "1000")


def test_instances_of_a_stage_that_double_at_each_level(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    text = ['#usda 1.0\n(\n    defaultPrim = "P20"\n)\ndef Xform "P0"\n{\n}\n']
    for level in range(1, _LEVELS + 1):
        below = f"(\n instanceable = true\n references = </P{level - 1}>\n)\n{{\n}}\n"
        both = "".join(f'def "{name}" {below}' for name in "ab")
        text.append(f'def Xform "P{level}"\n{{\n{both}}}\n')
    (tmp_path / "a.usda").write_text("".join(text))
    with pytest.raises(InputError, match=_SAYS):
        load_rig(tmp_path / "a.usda")


def test_more_nodes_of_a_gltf_file_than_the_limit(tmp_path: Path) -> None:
    nodes = [{"children": [k + 1]} for k in range(1_001)] + [{}]
    (tmp_path / "a.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "nodes": nodes}))
    with pytest.raises(InputError, match=_SAYS):
        load_rig(tmp_path / "a.gltf")
