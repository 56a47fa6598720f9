"""Hand and object seen from both sides: outlines, a finer skin, digits that give way to an edge."""

import numpy as np
import pytest

from warpjld.grasp import ObjectSet
from warpjld.grasp.close import Closer
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.give_way import give_way
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.intersection import contacts
from warpjld.grasp.outline_points import outline_points
from warpjld.grasp.quality import vertex_areas
from warpjld.grasp.shapes import ball, box
from warpjld.grasp.subdivided_skin import FinerSkin
from warpjld.skeleton import CHANNELS, poses_from_angles


def test_an_outline_has_points_along_sharp_edges_only() -> None:
    thing = box(0.1, 0.06, 0.04)
    points = outline_points(thing, 5e-3)
    half = thing.size / 2
    at_border = np.isclose(np.abs(points), half).sum(axis=1)
    extra = points[len(thing.vertices) :]
    assert (np.isclose(np.abs(extra), half).sum(axis=1) >= 2).all()  # on edges, none inside a face
    along = np.sort(
        points[(at_border >= 2) & np.isclose(points[:, 1], half[1]) & np.isclose(points[:, 2], half[2])][:, 0]
    )
    assert np.diff(along).max() <= 5e-3 + 1e-12
    np.testing.assert_allclose(along[[0, -1]], [-half[0], half[0]])
    assert len(outline_points(ball(0.05, subdivisions=4))) == len(ball(0.05, subdivisions=4).vertices)


def test_a_finer_skin_lies_on_the_same_triangles(rig) -> None:
    surface = rig.surface
    finer = FinerSkin(surface.vertices, surface.faces, 1.5e-3)
    points = finer.points(surface.vertices)
    edges = np.linalg.norm(points[finer.faces[:, 0]] - points[finer.faces[:, 1]], axis=1)
    assert np.median(edges) < 1.5e-3
    assert len(finer.parents) == len(points)
    np.testing.assert_allclose(points[: len(surface.vertices)], surface.vertices, atol=1e-7)
    before, after = (vertex_areas(v, f).sum() for v, f in ((surface.vertices, surface.faces), (points, finer.faces)))
    assert after == pytest.approx(before, rel=1e-5)


def test_a_blade_between_the_vertices_of_a_finger_is_seen(covering) -> None:
    """A thin bar cut 2 mm into the index finger from below, along it: no vertex of the finger is in it."""
    skeleton, skin = covering.skeleton, covering.surface.vertices.astype(np.float32)
    both = HandObjectGaps(covering, ball(0.01))
    index = both.parts.index("left.index")
    own = skin[both.part_of_vertex == index]
    bone = 0.5 * (skeleton.rest[skeleton.index("index.knuckle2")] + skeleton.rest[skeleton.index("index.knuckle3")])
    below = own[np.linalg.norm((own - bone)[:, [0, 2]], axis=1) < 0.006][:, 1].min()
    blade = box(0.0004, 0.04, 0.004).placed([bone[0], below - 0.02 + 0.002, bone[2]])
    assert ObjectSet(blade).distances(skin).distance.min() > 0.0
    depth = HandObjectGaps(covering, blade).depths(skin[None])[0, index]
    assert 5e-4 < depth < 2.1e-3  # the skin is rounded: nearest at its side
    told = {c.part: c.deepest for c in contacts(covering, skin, blade)}
    assert told["left.index"] == pytest.approx(depth)
    far = blade.placed([0.0, 1.0, 0.0]).place
    assert HandObjectGaps(covering, blade).depths(skin[None], far).max() == 0.0


def test_digits_give_way_to_an_edge_and_do_not_pass_through(covering) -> None:
    skeleton = covering.skeleton
    chains = digit_chains(skeleton, ["index"])
    start = np.zeros((len(skeleton), len(CHANNELS)))
    closed = start.copy()
    closed[list(chains["left.index"]), 0] = np.radians([60, 60, 30])
    tip = skeleton.rest[skeleton.index("index.tip")]
    post = box(0.2, 0.004, 0.004).placed(tip + np.array([0.0, -0.03, 0.01]))  # across the finger's way
    both = HandObjectGaps(covering, post)

    def depths(hands: np.ndarray, angles: np.ndarray) -> np.ndarray:
        return both.depths(covering.deform(poses_from_angles(skeleton, angles)), moved=True)

    way = {"allowed": 5e-4, "on_the_way": 1e-3}
    (apart,), gone = give_way(depths, both.parts, start[None], closed[None], chains, **way)
    assert 0.0 < gone[0, 0] < 1.0
    parts = np.linspace(0.0, 1.0, 9)[:, None, None]
    index = depths(np.arange(9), start + parts * (apart - start))[:, both.parts.index("left.index")]
    assert index[-1] <= 5e-4
    assert index.max() < 1.2e-3


def test_a_first_look_is_near_the_whole(covering) -> None:
    thing = ball(0.06).placed([0.004, -0.06, -0.062])
    angles = np.zeros((1, len(covering.skeleton), len(CHANNELS)))
    poses = poses_from_angles(covering.skeleton, angles)
    quick, whole = (
        Closer(covering, thing).close(poses, angles, digits=["middle"], apart=False, quick=q) for q in (True, False)
    )
    assert np.abs(quick.angles - whole.angles).max() < np.radians(8)
    assert whole.touching().all()
