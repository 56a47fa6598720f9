from __future__ import annotations

import numpy as np
import trimesh

from warpjld.render.edges import Edges


def test_every_edge_once() -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    edges = Edges(np.array(ball.faces))
    assert {tuple(e) for e in edges.ends.tolist()} == {tuple(e) for e in ball.edges_unique.tolist()}
    assert len(edges.ends) == len(ball.edges_unique)


def test_edges_of_a_sphere_face_the_eye_on_its_side() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    edges = Edges(np.array(ball.faces))
    facing = edges.facing(np.array(ball.vertices), (0.0, 0.0, 100.0))
    height = ball.vertices[edges.ends].mean(axis=1)[:, 2]
    assert facing[height > 0.15].all()
    assert not facing[height < -0.15].any()
