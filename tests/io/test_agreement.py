"""Files that can be read, but whose surface is inside out or elsewhere than its skeleton."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from warpjld.io.agreement import elsewhere, outside_out
from warpjld.io.source import SourceRig
from warpjld.skeleton.recognise.tree import SourceTree


@pytest.fixture
def source() -> SourceRig:
    mesh = trimesh.creation.capsule(height=0.5, radius=0.1)
    frames = np.tile(np.eye(4), (3, 1, 1))
    frames[:, 2, 3] = [0.0, 0.25, 0.5]
    tree = SourceTree(("a", "b", "c"), np.array([-1, 0, 1]), frames)
    return SourceRig(Path("tube.glb"), tree, np.array(mesh.vertices), np.array(mesh.faces))


@pytest.mark.parametrize("share", [1.0, 0.8])
def test_a_surface_that_is_inside_out_is_turned_over(source, share):
    """Closed, or open at an end."""
    source = replace(source, faces=source.faces[source.vertices[source.faces].mean(axis=1)[:, 2] < share * 0.6])
    assert outside_out(source) is source
    turned = outside_out(replace(source, faces=source.faces[:, ::-1]))
    assert np.array_equal(turned.faces, source.faces)
    assert any("inside out" in note for note in turned.notes)


def test_a_flat_surface_has_no_inside(source):
    flat = replace(source, vertices=source.vertices * [1.0, 1.0, 0.0])
    assert outside_out(flat) is flat
    assert outside_out(replace(flat, faces=flat.faces[:, ::-1])).notes == ()


def test_texture_coordinates_turn_with_their_triangles(source):
    uv = np.random.default_rng(0).random((len(source.faces), 3, 2), dtype=np.float32)
    turned = outside_out(replace(source, faces=source.faces[:, ::-1], corner_uv=uv[:, ::-1]))
    assert np.array_equal(turned.corner_uv, uv)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda points: points, None),
        (lambda points: 0.5 * points, None),
        (lambda points: 100.0 * points, "times as large as its skeleton"),
        (lambda points: 0.01 * points, "times as large as its skeleton"),
        (lambda points: points + np.array([2.0, 0.0, 0.0]), "beside its skeleton"),
    ],
)
def test_a_surface_elsewhere_than_its_skeleton_is_told(source, change, words):
    told = elsewhere(replace(source, vertices=change(source.vertices)))
    assert told == () if words is None else words in told[0]
