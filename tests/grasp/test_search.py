"""Flexion search against analytic contacts, against the covering itself, and in batches."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from tests.covering.tube import SEGMENT, tube, tube_skeleton
from warpjld.covering import Covering, bind, default_parameters
from warpjld.errors import InputError
from warpjld.grasp import NEAREST, FlexionSearch, ObjectSet, Places, Searches, SearchStatus, make_object
from warpjld.grasp.shapes import ball, box
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles

ANGLE = 1e-4  # radians: asked for
BALL, PLANE = ball(0.04, subdivisions=6), box(0.5, 0.02, 0.5, edge=1.0)


@pytest.fixture(scope="module")
def stiff() -> Covering:
    """A tube without inflation, its vertices held by one segment each: they turn rigidly about the joint."""
    skeleton, surface = tube_skeleton(120.0), tube()
    plain = default_parameters(skeleton)
    zero = np.zeros(3)
    plain = replace(plain, inflation=zero, muscle=zero, proximity=np.full((3, 2), 0.2))
    beyond = surface.vertices[:, 2] < -SEGMENT
    domains = np.stack([~beyond, beyond], axis=1).astype(float)
    # beyond the joint's surroundings all is bone, so that angles of contact are known exactly
    bone = np.where(surface.vertices[:, 2] < -1.3 * SEGMENT, 1, -1).astype(np.int32)
    return bind(skeleton, surface, parameters=plain, domains=domains, rigid=bone)


def top(covering: Covering, ratio: float) -> int:
    """The vertex on the external side of the second segment at that ratio."""
    wanted = np.array([0.0, 0.008, -SEGMENT * (1 + ratio)])
    return int(np.linalg.norm(covering.surface.vertices - wanted, axis=1).argmin())


def turned(covering: Covering, vertex: int, angle: float) -> np.ndarray:
    joint = covering.skeleton.rest[1]
    away = covering.surface.vertices[vertex] - joint
    return joint + Rotation.from_rotvec([-angle, 0, 0]).apply(away)


def straight(covering: Covering, frames: int = 1) -> tuple[Poses, np.ndarray]:
    angles = np.zeros((frames, len(covering.skeleton), len(CHANNELS)))
    return poses_from_angles(covering.skeleton, angles), angles


@pytest.mark.parametrize("ratio", [0.4, 0.75])
@pytest.mark.parametrize("height", [0.0, 0.006, 0.015])
def test_bent_segment_touches_a_plane_at_the_analytic_angle(stiff, ratio: float, height: float) -> None:
    vertex = top(stiff, ratio)
    x, y, z = stiff.surface.vertices[vertex] - stiff.skeleton.rest[1]
    # y cos α + z sin α = −height
    exact = np.arctan2(y, -z) + np.arcsin(height / np.hypot(y, z)) if height <= np.hypot(y, z) else None
    floor = PLANE.placed((0, -height - 0.01, 0))
    above = int(np.flatnonzero(floor.normals[:, 1] > 0.9)[0])
    search = FlexionSearch(stiff, ObjectSet(floor))
    found = search.run(*straight(stiff), Searches(vertex=vertex, joint=1, facet=[above, NEAREST]))
    if exact is None:
        assert (found.status == SearchStatus.NO_CONTACT).all()
        return
    assert (found.status == SearchStatus.CONVERGED).all()
    np.testing.assert_allclose(found.angles[:, 0], exact, atol=ANGLE)
    assert (np.abs(found.distance) < 1e-6).all()
    assert x == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("centre", [(0, -0.035, -0.04), (0.006, -0.03, -0.055), (0, -0.03, -0.02)])
@pytest.mark.parametrize("distance", [0.0, 0.002])
def test_bent_segment_touches_a_sphere_at_the_analytic_angle(stiff, centre, distance: float) -> None:
    vertex = top(stiff, 0.75)
    gap = lambda a: np.linalg.norm(turned(stiff, vertex, a) - centre) - 0.02 - distance  # noqa: E731
    exact = brentq(gap, 0, next(a for a in np.linspace(0, 2, 200) if gap(a) < 0), xtol=1e-12)
    search = FlexionSearch(stiff, ObjectSet(BALL.placed(centre)))
    found = search.run(*straight(stiff), Searches(vertex=vertex, joint=1, distance=distance))
    assert found.status[0] == SearchStatus.CONVERGED
    np.testing.assert_allclose(found.angles[0, 0], exact, atol=ANGLE)


def test_what_is_rigid_touches_as_its_bone_turns() -> None:
    """As the stiff tube does, but with every parameter at work: they are not for what is rigid."""
    skeleton, surface = tube_skeleton(120.0), tube()
    beyond = surface.vertices[:, 2] < -SEGMENT
    hard = bind(skeleton, surface, rigid=np.where(beyond, 1, -1).astype(np.int32))
    vertex, centre = top(hard, 0.75), (0.006, -0.03, -0.055)
    gap = lambda a: np.linalg.norm(turned(hard, vertex, a) - centre) - 0.02  # noqa: E731
    exact = brentq(gap, 0, next(a for a in np.linspace(0, 2, 200) if gap(a) < 0), xtol=1e-12)
    found = FlexionSearch(hard, ObjectSet(BALL.placed(centre))).run(*straight(hard), Searches(vertex=vertex, joint=1))
    assert found.status[0] == SearchStatus.CONVERGED
    np.testing.assert_allclose(found.angles[0, 0], exact, atol=ANGLE)


def test_every_status_with_its_message(stiff) -> None:
    vertex = top(stiff, 0.75)
    start = stiff.surface.vertices[vertex]
    places = Places.of([start, (0, 0.5, 0), start + np.array([0, 0.025, 0]), (0, -0.2, -0.03)])
    poses, angles = straight(stiff)
    search = FlexionSearch(stiff, ObjectSet(BALL))
    stop = [0.5, np.nan, np.nan, np.nan]
    found = search.run(poses, angles, Searches(vertex=vertex, joint=1, place=[0, 1, 2, 3], stop=stop), places=places)
    assert found.status.tolist() == [SearchStatus.INSIDE, *[SearchStatus.NO_CONTACT] * 3]
    assert "not out of it within the joint's limits; least deep" in found.message(0)
    assert found.angles[0, 0] == pytest.approx(0.5)
    assert (
        search.run(poses, angles, Searches(vertex=vertex, joint=1, stop=0.0), places=places[0]).status[0]
        == SearchStatus.INSIDE
    )
    assert "closest approach 5.00 mm at 0.00°" in found.message(2)  # it only moves away
    assert 0 < found.angles[3, 0] < np.radians(120)  # somewhere on the way down
    closest = min(
        np.linalg.norm(turned(stiff, vertex, a) - places.position[3]) - 0.02
        for a in np.linspace(0, np.radians(120), 999)
    )
    assert found.distance[3] == pytest.approx(closest, abs=1e-6)
    at_limit = search.run(poses, angles, Searches(vertex=vertex, joint=1, stop=0.0), places=places[1])
    assert at_limit.status[0] == SearchStatus.AT_LIMIT
    assert "at its limit" in at_limit.message(0)
    stretched = search.run(poses, angles, Searches(vertex=vertex, joint=1, rate=-1.0), places=places[2])
    assert stretched.status[0] == SearchStatus.CONVERGED
    assert stretched.angles[0, 0] < 0


def test_a_short_contact_is_not_stepped_over(stiff) -> None:
    vertex = top(stiff, 0.75)
    middle = turned(stiff, vertex, 0.9)
    outward = (middle - stiff.skeleton.rest[1]) / np.linalg.norm(middle - stiff.skeleton.rest[1])
    grazing = ObjectSet(BALL.placed(middle + outward * (0.02 - 2e-5)))
    found = FlexionSearch(stiff, grazing).run(*straight(stiff), Searches(vertex=vertex, joint=1))
    assert found.status[0] == SearchStatus.CONVERGED
    assert found.angles[0, 0] < 0.9


def test_an_opening_is_not_a_contact(stiff) -> None:
    whole = ball(0.03, subdivisions=4)
    bowl = make_object("bowl", whole.vertices, whole.faces[whole.vertices[whole.faces][:, :, 1].mean(axis=1) < 0.002])
    vertex = top(stiff, 0.75)
    objects = ObjectSet(bowl.placed(turned(stiff, vertex, 1.0)))
    found = FlexionSearch(stiff, objects).run(*straight(stiff), Searches(vertex=vertex, joint=1, stop=1.1))
    assert found.status[0] == SearchStatus.OPENING


def test_beside_the_facet_is_told(stiff) -> None:
    vertex, floor = top(stiff, 0.6), PLANE.placed((0.0, -0.02, 0))
    beside = int(np.flatnonzero(floor.normals[:, 1] > 0.9)[0])
    search = FlexionSearch(stiff, ObjectSet([floor, floor.placed((5.0, -0.02, 0))]))
    found = search.run(*straight(stiff), Searches(vertex=vertex, joint=1, facet=[beside, beside + 1]))
    assert found.inside.sum() == 1  # one of the two triangles of the top lies under the vertex
    found = search.run(*straight(stiff), Searches(vertex=vertex, joint=1, facet=beside, thing=1))
    assert not found.inside[0]
    assert "beside the facet" in found.message()


def posed(covering: Covering, frames: int, seed: int = 0) -> tuple[Poses, np.ndarray]:
    """Random poses, placed and turned as a whole."""
    rng = np.random.default_rng(seed)
    low, high = np.moveaxis(covering.skeleton.limits, -1, 0)
    angles = low + (high - low) * rng.uniform(0, 0.5, size=(frames, *low.shape))
    shift, turn = rng.normal(size=(frames, 3)) * 0.05, Rotation.random(frames, rng=rng).as_quat()
    return poses_from_angles(covering.skeleton, angles, root_position=shift, root_rotation=turn), angles


JOINTS = ("wrist", "index.base", "thumb.base", "pinky.carpometacarpal", "ring.knuckle2", "thumb.knuckle3")


def many(covering: Covering, count: int, frames: int, seed: int = 1) -> Searches:
    rng = np.random.default_rng(seed)
    joints = np.array([covering.skeleton.index(name) for name in JOINTS])
    return Searches(
        vertex=rng.integers(len(covering.surface.vertices), size=count),
        joint=rng.choice(joints, count),
        frame=rng.integers(frames, size=count),
        covering=rng.integers(2, size=count),
        thing=rng.integers(2, size=count),
        facet=np.where(rng.random(count) < 0.5, NEAREST, rng.integers(300, size=count)),
        place=rng.integers(5, size=count),
    )


@pytest.fixture(scope="module")
def bench(covering: Covering):
    """Two parameter sets, two objects, four poses, five places near the hand."""
    other = covering.with_parameters(replace(covering.parameters, inflation=covering.parameters.inflation * 2 + 0.1))
    poses, angles = posed(covering, 4)
    rng = np.random.default_rng(5)
    middle = poses.positions[rng.integers(4, size=5), rng.integers(len(covering.skeleton), size=5)]
    places = Places.of(middle + rng.normal(size=(5, 3)) * 0.03, rng.normal(size=(5, 4)))
    search = FlexionSearch([covering, other], ObjectSet([ball(0.03), box(0.02, 0.03, 0.04)]))
    return search, poses, angles, places


def test_what_is_searched_is_what_the_covering_gives(covering, bench) -> None:
    search, poses, angles, places = bench
    searches = many(covering, 400, 4)
    found = search.run(poses, angles, searches, places=places)
    assert set(found.status) >= {SearchStatus.CONVERGED, SearchStatus.NO_CONTACT, SearchStatus.INSIDE}
    again = angles[searches.frame]
    again[np.arange(400), searches.joint, 0] = found.angles[:, 0]
    base = poses_from_angles(covering.skeleton, angles)
    turn = Rotation.from_quat(poses.rotations[:, 0]) * Rotation.from_quat(base.rotations[:, 0]).inv()
    shift = poses.positions[:, 0] - covering.skeleton.rest[0]
    bent = poses_from_angles(
        covering.skeleton,
        again,
        root_position=shift[searches.frame],
        root_rotation=turn.as_quat()[searches.frame],
    )
    for k in np.flatnonzero(searches.facet == NEAREST)[:60]:
        point = search.coverings[searches.covering[k]].points(bent[k : k + 1], [searches.vertex[k]])[0]
        at = search.objects.distances(point, which=searches.thing[k], places=places[searches.place[k]])
        assert at.distance[0, 0] == pytest.approx(found.distance[k], abs=2e-7)


def test_a_batch_is_bit_for_bit_what_its_searches_are_alone(covering, bench) -> None:
    search, poses, angles, places = bench
    searches = many(covering, 3000, 4)
    together = search.run(poses, angles, searches, places=places, threads=2)
    for k in range(0, 3000, 100):
        f = searches.frame[k]
        alone = search.run(
            poses[f : f + 1],
            angles[f : f + 1],
            Searches(
                vertex=searches.vertex[k],
                joint=searches.joint[k],
                covering=searches.covering[k],
                thing=searches.thing[k],
                facet=searches.facet[k],
                place=0,
            ),
            places=places[searches.place[k]],
        )
        for field in ("status", "closing", "angles", "distance", "facet", "inside", "point", "evaluations"):
            np.testing.assert_array_equal(getattr(alone, field)[0], getattr(together, field)[k])


def test_joints_may_bend_together(covering) -> None:
    names = ("index.base", "index.knuckle2", "index.knuckle3")
    joints = [covering.skeleton.index(name) for name in names]
    poses, angles = straight(covering)
    tip = int(np.linalg.norm(covering.surface.vertices - covering.skeleton.rest[joints[2] + 1], axis=1).argmin())
    angles[0, joints, 0] = 0.9, 0.9, 0.63
    curled = covering.points(poses_from_angles(covering.skeleton, angles), [tip])[0, 0]
    angles[:] = 0.0
    things = ObjectSet(ball(0.03).placed(curled))
    found = FlexionSearch(covering, things).run(
        poses, angles, Searches(vertex=tip, joint=[joints], rate=[[1.0, 1.0, 0.7]])
    )
    assert found.status[0] == SearchStatus.CONVERGED
    np.testing.assert_allclose(found.angles[0, :3], found.closing[0] * np.array([1, 1, 0.7]), rtol=1e-5)
    angles[0, joints, 0] = found.angles[0, :3]
    point = covering.points(poses_from_angles(covering.skeleton, angles), [tip])[0]
    assert abs(things.distances(point).distance[0, 0]) < 1.2e-6
    with pytest.raises(InputError, match="one beyond the other"):
        FlexionSearch(covering, things).run(poses, angles, Searches(vertex=tip, joint=[joints[::-1]]))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"vertex": 10**6}, "vertex must lie in 0"),
        ({"vertex": -1}, "vertex must lie in 0"),
        ({"joint": 99}, "joint must lie in 0"),
        ({"frame": 1}, "frame must lie in 0…0"),
        ({"thing": 1}, "thing must lie in 0…0"),
        ({"facet": 10**6}, "facets 0 to"),
        ({"facet": -2}, "facets 0 to"),
        ({"place": 3}, "place must lie in 0…0"),
        ({"distance": np.nan}, "distance is not finite"),
        ({"rate": np.inf}, "rate and stop must be finite"),
        ({"vertex": [1, 2], "facet": [1, 2, 3]}, "one value or one for each"),
        ({"joint": []}, r"joint needs shape .* got \(0, 1\)"),
        ({"vertex": []}, "want at least one"),
    ],
)
def test_wrong_searches(stiff, change, says: str) -> None:
    search = FlexionSearch(stiff, ObjectSet(ball()))
    with pytest.raises(InputError, match=says):
        search.run(*straight(stiff), Searches(**({"vertex": 1, "joint": 1} | change)))


def test_other_wrong_input(stiff) -> None:
    search, (poses, angles) = FlexionSearch(stiff, ObjectSet(ball())), straight(stiff)
    with pytest.raises(InputError, match="angles: want shape"):
        search.run(poses, angles[:, :2], Searches(vertex=1, joint=1))
    with pytest.raises(InputError, match="not finite"):
        search.run(poses, angles * np.nan, Searches(vertex=1, joint=1))
    with pytest.raises(InputError, match="tolerance"):
        search.run(poses, angles, Searches(vertex=1, joint=1), tolerance=1e-12)
    paper = bind(stiff.skeleton, stiff.surface, method="paper")
    with pytest.raises(InputError, match="one method, smooth or paper, for all"):
        FlexionSearch([stiff, paper], ObjectSet(ball()))
    with pytest.raises(InputError, match="a stop belongs to one direction"):
        search.nearest(poses, angles, Searches(vertex=1, joint=1, stop=0.5))


def test_facets_of_an_open_surface_are_met_like_those_of_a_closed_one(stiff) -> None:
    floor = PLANE.placed((0, -0.016, 0))
    above = int(np.flatnonzero(floor.normals[:, 1] > 0.9)[0])
    sheet = make_object("sheet", floor.vertices[floor.faces[above]], [[0, 1, 2]]).placed((0, -0.016, 0))
    vertex = top(stiff, 0.6)
    results = [
        FlexionSearch(stiff, ObjectSet(thing)).run(*straight(stiff), Searches(vertex=vertex, joint=1, facet=[facet]))
        for thing, facet in ((floor, above), (sheet, 0))
    ]
    closed, opened = results
    assert not sheet.report.solid
    assert (opened.status == SearchStatus.CONVERGED).all()
    np.testing.assert_allclose(opened.angles, closed.angles, atol=1e-7)


def test_a_joint_bent_at_rest_is_searched_from_straight(stiff) -> None:
    """The angle counts from the straight joint, and the skin is there where the search says it is (R25)."""
    initial = np.zeros_like(stiff.skeleton.initial)
    initial[1] = np.radians([25.0, 0.0, 0.0, 0.0])
    skeleton = replace(stiff.skeleton, initial=initial)
    bent = bind(skeleton, stiff.surface, parameters=default_parameters(skeleton), domains=stiff.domains)
    vertex = top(bent, 0.5)
    floor = PLANE.placed((0, -0.02, 0))
    poses = poses_from_angles(skeleton, initial[None])
    found = FlexionSearch(bent, ObjectSet(floor)).run(poses, initial[None], Searches(vertex=vertex, joint=1))
    assert found.status[0] == SearchStatus.CONVERGED
    assert found.angles[0, 0] > initial[1, 0]
    touching = initial[None].copy()
    touching[0, 1, 0] = found.angles[0, 0]
    skin = bent.deform(poses_from_angles(skeleton, touching))[0]
    assert skin[vertex, 1] == pytest.approx(-0.01, abs=2e-6)


@pytest.fixture(scope="module", params=["smooth", "paper"])
def either(request, stiff) -> Covering:
    """The stiff tube by both methods: without inflation the paper's is rigid beyond the joint's area."""
    if request.param == "smooth":
        return stiff
    plain = replace(stiff.parameters, proximity=np.full((3, 2), 0.2))
    return bind(stiff.skeleton, stiff.surface, method="paper", parameters=plain, domains=stiff.domains)


@pytest.mark.parametrize("degrees", [-40.0, -21.0, 21.0, 70.0])
def test_contact_is_found_on_either_side(either, degrees: float) -> None:
    """A ball whose surface the vertex meets at that angle, by moving away from the palm or towards it."""
    vertex = top(either, 0.75)
    joint = either.skeleton.rest[1]
    before = turned(either, vertex, np.radians(degrees))
    ahead = np.cross([-1.0, 0.0, 0.0], before - joint) * np.sign(degrees)
    centre = before + 0.02 * ahead / np.linalg.norm(ahead)
    found = FlexionSearch(either, ObjectSet(BALL.placed(centre))).nearest(
        *straight(either), Searches(vertex=vertex, joint=1)
    )
    assert found.status[0] == SearchStatus.CONVERGED
    # BALL's facets lie up to 10 micrometres inside the sphere
    assert np.degrees(found.angles[0, 0]) == pytest.approx(degrees, abs=0.05)
    assert np.sign(found.closing[0]) == np.sign(degrees)
    assert abs(found.distance[0]) < 1e-6


@pytest.mark.parametrize("out", [-0.3, 0.3])
def test_from_inside_the_shorter_way_out(either, out: float) -> None:
    """Vertex 5 mm inside: it turns to where the surface is nearest."""
    vertex = top(either, 0.75)
    start = either.surface.vertices[vertex]
    across = np.cross([-1.0, 0.0, 0.0], start - either.skeleton.rest[1])
    across /= np.linalg.norm(across)
    centre = start - np.sign(out) * 0.015 * across  # surface 5 mm ahead on this side, 35 mm on the other
    ball_ = ObjectSet(BALL.placed(centre))
    assert ball_.distances(start[None]).distance[0, 0] == pytest.approx(-0.005, abs=2e-5)
    gap = lambda a: np.linalg.norm(turned(either, vertex, a) - centre) - 0.02  # noqa: E731
    exact = brentq(gap, 0.0, out, xtol=1e-12)
    found = FlexionSearch(either, ball_).nearest(*straight(either), Searches(vertex=vertex, joint=1))
    assert found.status[0] == SearchStatus.CONVERGED
    np.testing.assert_allclose(found.angles[0, 0], exact, atol=1e-3)
    assert abs(found.distance[0]) < 1e-6


def test_within_is_how_exactly(either) -> None:
    vertex, floor = top(either, 0.75), PLANE.placed((0, -0.02, 0))
    search = FlexionSearch(either, ObjectSet(floor))
    wanted = Searches(vertex=vertex, joint=1)
    found = [search.nearest(*straight(either), wanted, tolerance=within) for within in (1e-3, 1e-6)]
    assert all(f.status[0] == SearchStatus.CONVERGED for f in found)
    assert 1e-6 < abs(found[0].distance[0]) < 1e-3
    assert abs(found[1].distance[0]) < 1e-6
    assert found[0].evaluations[0] < found[1].evaluations[0]


def test_of_two_ways_without_contact_the_closer_approach(either) -> None:
    vertex = top(either, 0.75)
    away = turned(either, vertex, np.radians(-44.0))
    up = np.array([0.0, 1.0, 0.0])
    found = FlexionSearch(either, ObjectSet(BALL.placed(away + 0.025 * up))).nearest(
        *straight(either), Searches(vertex=vertex, joint=1)
    )
    assert found.status[0] == SearchStatus.NO_CONTACT
    assert found.angles[0, 0] < 0.0
    assert 0.0 < found.distance[0] < 0.006
