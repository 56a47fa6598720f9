"""Commands of grasping: objects, what they follow, searches, closing and letting go."""

import json
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.geometry.normals import vertex_normals
from warpjld.grasp import ObjectSet, SearchStatus
from warpjld.grasp.digits import pad_vertex
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.random_placements import WAY
from warpjld.script.binding import cover
from warpjld.script.grasping import placed_at, posture
from warpjld.script.props import prop_places
from warpjld.script.runner import cast, run_scene
from warpjld.script.staging import stage
from warpjld.skeleton import poses_from_angles

READY = """
FINGER1 LEFT INDEX ABDUCTION AT 0 10
FINGER1 LEFT RING  ABDUCTION AT 0 -8
FINGER1 LEFT PINKY ABDUCTION AT 0 -18
FINGER1 LEFT THUMB PIVOT     AT 0 30
FINGER1 LEFT THUMB ABDUCTION AT 0 20
FINGER1 LEFT THUMB FLEXION   AT 0 -10
OBJECT apple BALL 0.065 AT 0.004 -0.0495 -0.062
"""


def flexion(scene, joint: str, frame: float) -> float:
    return float(np.degrees(scene.actor().motion.value(f"left.{joint}.flexion", frame)))


def test_objects_are_placed_turned_and_scaled(run, tmp_path: Path) -> None:
    (tmp_path / "a.off").write_text("OFF\n4 4 0\n0 0 0\n10 0 0\n0 10 0\n0 0 10\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")
    scene = run(
        f"OBJECT a BOX 0.1 0.2 0.3 AT 1 2 3 TURN 0 90 0 SCALE 2\n"
        f"OBJECT b '{tmp_path / 'a.off'}' UNIT MM UP Z SCALE 2 COLOR 'red'\nOBJECT c GLASS"
    )
    box = scene.props["A"].thing
    on_stage = box.place.apply(box.vertices)[0]
    np.testing.assert_allclose(np.ptp(on_stage, axis=0), [0.6, 0.4, 0.2], atol=1e-12)
    np.testing.assert_allclose(on_stage.mean(axis=0), [1, 2, 3], atol=1e-3)
    assert scene.props["B"].thing.size.max() == pytest.approx(0.02)
    assert scene.props["B"].color == "#ff0000"
    assert scene.props["A"].color != scene.props["C"].color


def test_objects_as_printed_in_the_paper(run) -> None:
    scene = run("OBJECT APPLE BALL\nFINGER23 LEFT INDEX KNUCKLES2 AT 5 0\nFINGER23 LEFT INDEX KNUCKLES2 AT 10 60\n")
    run("MOVE LEFT 0 0 0 0\nMOVE LEFT 12 0.1 0 0\nOBJECTS APPLE INDEX LEFT KNUCKLES2 5 10")
    prop = scene.prop("apple")
    places = prop_places(scene.actors, scene.rate, prop, np.array([0.0, 5.0, 7.0, 10.0, 12.0]))
    np.testing.assert_allclose(places.position[:2], 0, atol=1e-12)
    assert np.linalg.norm(places.position[2]) > 0.01
    np.testing.assert_allclose(places.position[3], places.position[4], atol=1e-12)
    run("OBJECTS apple JOINT left.wrist 10 12")
    assert len(prop.associations) == 2


def test_skin_is_laid_on_what_is_held_where_touch_is_on(run) -> None:
    scene = run("FRAMES 0 1")
    covering = cover(scene.actor())
    pad = pad_vertex(covering, "left.index")
    outwards = vertex_normals(covering.surface.vertices, covering.surface.faces)[pad]
    middle = covering.surface.vertices[pad] + 0.0185 * outwards
    run(f"OBJECT marble BALL 0.04 AT {middle[0]:.5f} {middle[1]:.5f} {middle[2]:.5f}")

    def inside() -> float:
        surface = cast(scene, np.array([0.0])).surface(0)
        marble = scene.props["MARBLE"].thing
        return float(-ObjectSet(marble).distances(surface, limit=0.02).distance.min())

    assert inside() > 1e-3
    run("TOUCH ON")
    assert inside() < 1e-5


@pytest.mark.parametrize(
    ("line", "joint", "degrees"),
    [
        ("AUTO_F_1 7 LEFT INDEX PAD apple NEAREST", "index.base", 40),
        ("auto_f_2_3 7 left index knuckles2 PAD apple NEAREST", "index.knuckle2", 50),
        ("AUTO_F_2_3 7 MIDDLE KNUCKLES3 PAD apple NEAREST", "middle.knuckle3", 60),
        ("AUTO_WRIST 7 LEFT PAD apple NEAREST", "wrist", 30),
    ],
)
def test_searches_set_a_key_where_the_skin_touches(run, line: str, joint: str, degrees: float) -> None:
    scene = run("FINGER1 LEFT MIDDLE FLEXION AT 7 20")
    actor = scene.actor()
    covering = cover(actor)
    _, angles = posture(scene, actor, 7)
    angles[0, actor.skeleton.index(joint), 0] = np.radians(degrees)
    pad = pad_vertex(covering, "index" if "ndex" in joint else "middle")
    x, y, z = covering.points(poses_from_angles(actor.skeleton, angles), [pad])[0, 0]
    run(f"OBJECT apple BALL 0.016 AT {x:.6f} {y:.6f} {z:.6f}\n{line}")
    (attempt,) = scene.attempts
    assert attempt.status == SearchStatus.CONVERGED.name, attempt.message
    assert abs(attempt.values["distance_mm"]) < 1e-2
    assert flexion(scene, joint, 7) == pytest.approx(attempt.values["angle_degrees"], abs=1e-3)
    skin = actor.covering.points(stage(actor, np.array([7.0]), 30), [attempt.values["vertex"]])[0]
    distance = ObjectSet(placed_at(scene, scene.prop("apple"), 7)).distances(skin).distance[0, 0]
    assert abs(distance) < 2e-6


def test_a_given_facet_as_printed(run) -> None:
    scene = run("OBJECT floor BOX 1 0.02 1 AT 0 -0.06 0\nAUTO_F_1 3 LEFT INDEX PAD floor 30")
    attempt = scene.attempts[0]
    assert attempt.values["facet"] == 30
    assert attempt.status in ("CONVERGED", "NO_CONTACT", "INSIDE")


def test_a_search_without_contact_leaves_the_motion_alone(run) -> None:
    scene = run("OBJECT apple BALL 0.05 AT 1 1 1\nAUTO_F_1 7 LEFT INDEX PAD apple NEAREST")
    assert scene.attempts[0].status == "NO_CONTACT"
    assert "closest approach" in scene.attempts[0].message
    assert "left.index.base.flexion" not in scene.actor().motion.tracks


def test_grasp_and_release(run) -> None:
    scene = run(READY + "GRASP 10 20 LEFT apple\nRELEASE 40 50 LEFT")
    assert scene.attempts[0].status == "CONVERGED"
    assert flexion(scene, "index.base", 10) == 0
    held = flexion(scene, "index.base", 20)
    assert held > 10
    assert flexion(scene, "index.base", 33) == pytest.approx(held, abs=1e-9)
    assert flexion(scene, "index.base", 50) == pytest.approx(0, abs=1e-9)
    assert flexion(scene, "thumb.base", 50) == pytest.approx(-10, abs=1e-9)


def test_grasp_takes_digits_and_coupling(run) -> None:
    scene = run(READY + "GRASP 10 20 apple THUMB INDEX COUPLING 1 0.7")
    assert set(scene.attempts[0].values["digits"]) == {"left.thumb", "left.index"}
    assert "left.ring.base.flexion" not in scene.actor().motion.tracks


def test_the_summary_tells_objects_searches_and_contacts(run, tmp_path: Path) -> None:
    scene = run(READY + "GRASP 2 4 LEFT apple\nOBJECTS apple JOINT left.wrist 4 6\nSIZE 160 120")
    run(
        "MOVE LEFT 4 0 0 0\nMOVE LEFT 6 0 0.1 0\nEXPORT 'a.npz'\nPICTURE 5 'a.png'\nCONTACT 'b.png' 0 4 6\nFILM 'c.gif'"
    )
    content = run_scene(scene, tmp_path)
    assert json.loads((tmp_path / "summary.json").read_text()) == content
    assert content["objects"][0]["name"] == "APPLE"
    assert content["searches"][0]["command"] == "GRASP APPLE"
    rows = {row["frame"]: row for row in content["contacts"]}
    assert set(rows) == {4, 6}
    parts = {part["part"] for part in rows[4]["parts"]}
    assert parts >= {"left.index", "left.thumb"}
    assert {part["part"] for part in rows[6]["parts"]} >= parts  # carried along, it is touched as before
    with np.load(tmp_path / "a-apple.npz") as file:
        moved = file["vertices"][6] - file["vertices"][0]
    np.testing.assert_allclose(moved, np.broadcast_to([0, 0.1, 0], moved.shape), atol=1e-6)
    assert {f["name"] for f in content["files"]} == {"a.npz", "a-apple.npz", "a.png", "b.png", "c.gif"}


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("OBJECT a BLL", "did you mean BALL"),
        ("OBJECT a BALL 0", "greater than 0"),
        ("OBJECT a BALL 0.1 UNIT CM", "for surfaces from files"),
        ("OBJECT a BALL 0.1 9 9 9", "too many sizes|subdivisions"),
        ("OBJECT a 'nowhere.obj'", "there is no file"),
        ("OBJECT a '.'", "is a folder; want a file"),
        ("OBJECT a BALL COLOR 'gren'", r"there is no colour 'gren'; did you mean green\?"),
        ("OBJECT left BALL", "there is an object or actor LEFT already"),
        ("OBJECT apple BALL\nOBJECT apple BOX", "there is an object or actor APPLE already"),
        ("OBJECTS apple INDEX LEFT KNUCKLES2 5 10", "no object apple; add one"),
        ("OBJECT apple BALL\nOBJECTS aple INDEX LEFT KNUCKLES2 5 10", "did you mean APPLE"),
        ("OBJECT a BALL\nOBJECTS a INDEX LEFT KNUCKLES2 10 5", "must not come before"),
        ("OBJECT a BALL\nOBJECTS a JOINT wrist 1 5\nOBJECTS a JOINT index.base 4 6", "follows another joint"),
        ("OBJECT a BALL\nAUTO_F_1 1 LEFT INDEX 99999999 a NEAREST", "or less"),
        (
            "OBJECT a BALL\nAUTO_F_2_3 1 LEFT INDEX KNUCKLES3 0 a NEAREST",
            "vertex 0 does not move when left.index.knuckle3",
        ),
        ("OBJECT a BALL\nAUTO_F_1 1 LEFT INDEX PAD a 5120", "has facets 0 to 5119, got 5120"),
        ("OBJECT a BALL\nAUTO_F_1 1 LEFT INDEX PAD a NEAREST WITHIN 0", "how exactly, in metres must be 1e-07 or more"),
        ("OBJECT a BALL\nAUTO_WRIST 1 LEFT PAD a NEAREST WITHIN", "expected how exactly, in metres"),
        ("OBJECT a BALL\nAUTO_F_1 1 LEFT INDEX PAD b NEAREST", "there is no object b"),
        ("OBJECT a BALL\nAUTO_F_2_3 1 LEFT INDEX PAD a NEAREST", "expected KNUCKLES2/KNUCKLES3"),
        ("OBJECT a BALL\nGRASP 5 5 LEFT a", "key2 must come after key1"),
        ("OBJECT a BALL\nGRASP 5 6 RIGHT a", "no actor has a right side"),
        ("RELEASE 1 2 LEFT", "has grasped nothing"),
    ],
)
def test_wrong_lines(run, line: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        run(line)


def test_fingers_that_take_no_part_bend_with_the_grasp_and_do_not_tighten(run) -> None:
    scene = run(
        "OBJECT bead BALL 0.04 AT 0.5 0 0\nGRASP 5 15 LEFT bead AUTO TRIES 16 POSTURE PINCH\nSQUEEZE 15 20 LEFT 3\n"
        "RELEASE 25 30 LEFT"
    )
    for joint in ("ring.base", "ring.knuckle2", "pinky.base"):
        assert flexion(scene, joint, 15) > 5
        assert flexion(scene, joint, 20) == pytest.approx(flexion(scene, joint, 15))
        assert flexion(scene, joint, 30) == pytest.approx(flexion(scene, joint, 5))
    for joint in ("index.base", "middle.base"):
        assert flexion(scene, joint, 20) == pytest.approx(flexion(scene, joint, 15) + 3)


def test_grasp_auto(run) -> None:
    scene = run("OBJECT apple BALL 0.06 AT 0.5 0 0\nGRASP 5 15 LEFT apple AUTO TRIES 8\nRELEASE 20 30 LEFT")
    attempt = scene.attempts[0]
    assert attempt.values["posture"] == "sphere"
    assert attempt.values["penetration_mm"] < 1
    assert "left.thumb" in attempt.values["digits"]
    actor = scene.actor()
    away, there = stage(actor, np.array([5.0, 15.0]), 30).positions[:, 0]
    assert np.linalg.norm(away - there) == pytest.approx(0.12, abs=1e-6)
    with pytest.raises(InputError, match="did you mean PLATE"):
        run("GRASP 35 45 LEFT apple AUTO POSTURE PLATES")
    with pytest.raises(InputError, match="want thumb and one or more of index, middle, ring"):
        run("GRASP 35 45 LEFT apple AUTO THUMB PINKY")


def test_two_hands_take_a_crate(run, scene, hands) -> None:
    crate = "OBJECT crate BOX 0.4 0.3 0.35 AT 0 1 0\n"
    with pytest.raises(InputError, match="no actor has a right side"):
        run(crate + "GRASP 5 15 BOTH crate AUTO")
    scene.add("right", hands["right"])
    with pytest.raises(InputError, match=r"two hands may take it \(GRASP … BOTH … AUTO\)"):
        run("GRASP 5 15 LEFT crate AUTO TRIES 8")
    run("GRASP 5 15 BOTH crate AUTO TRIES 24\nRELEASE 20 30 LEFT\nRELEASE 20 30 RIGHT")
    left, right = scene.attempts[-2:]
    assert (left.actor, right.actor) == ("LEFT", "RIGHT")
    assert left.values["epsilon"] == right.values["epsilon"] > 0.0
    assert all(name.startswith("right.") for name in right.values["digits"])
    frames = np.array([5.0, 10.0, 15.0])
    for attempt, side in ((left, "left"), (right, "right")):
        actor = scene.actors[attempt.actor]
        where = actor.placement.values("move", frames)
        assert np.linalg.norm(where[1] - where[0]) == pytest.approx(WAY)  # it comes straight, and then stays
        assert np.array_equal(where[1], where[2])
        prop = scene.props["CRATE"]
        skin = cover(actor).deform(stage(actor, frames[2:], scene.rate))
        assert HandObjectGaps(cover(actor), placed_at(scene, prop, 15.0)).gaps(skin).min() < 1e-4, side


def test_grasp_auto_keeps_out_of_other_objects(run) -> None:
    scene = run(
        "OBJECT apple BALL 0.06\nOBJECT table BOX 0.4 0.02 0.4\nMOVE table 0 0 -0.5 0\nMOVE table 15 0 -0.04 0\n"
        "GRASP 5 15 LEFT apple AUTO TRIES 12"
    )
    attempt = scene.attempts[0]
    assert "left.thumb" in attempt.values["digits"]
    skin = cover(scene.actor()).deform(stage(scene.actor(), np.array([15.0]), 30))[0]
    assert skin[:, 1].min() > -0.0301
    assert attempt.values["collisions"] == []


def test_what_else_a_closing_hand_runs_into_is_told(run) -> None:
    boxes = "OBJECT table BOX 0.4 0.02 0.4 AT 0 -0.092 0\nOBJECT floor BOX 0.4 0.02 0.4 AT 0 -0.3 0\n"
    scene = run(f"{READY}{boxes}GRASP 5 15 LEFT apple")
    (told,) = scene.attempts[0].values["collisions"]
    assert told.startswith("collides with TABLE: left.")
    assert told in scene.attempts[0].message


@pytest.mark.parametrize("method", ["SMOOTH", "PAPER"])
def test_a_wrist_that_extends_to_touch(run, method: str) -> None:
    """The contact lies behind the back of the hand, at −21° (R76, R142)."""
    scene = run(f"METHOD {method}\nWRIST LEFT FLEXION AT 7 -21")
    actor = scene.actor()
    vertex = pad_vertex(cover(actor), "left.middle")
    extended = cover(actor).deform(stage(actor, np.array([7.0]), scene.rate))[0]
    normal = vertex_normals(extended.astype(float), actor.rig.surface.faces)[vertex]
    # the pad comes to the ball from below: its surface is on the pad's back
    flat = cover(actor).deform(poses_from_angles(actor.skeleton, np.zeros((1, len(actor.skeleton), 4))))[0]
    ahead = (extended[vertex] - flat[vertex]) / np.linalg.norm(extended[vertex] - flat[vertex])
    assert ahead @ normal < 0.5
    x, y, z = extended[vertex] + 0.0200 * ahead
    run(f"WRIST LEFT FLEXION AT 0 0\nWRIST LEFT FLEXION AT 7 0\nOBJECT a BALL 0.04 AT {x} {y} {z}")
    run("AUTO_WRIST 7 LEFT PAD a NEAREST WITHIN 1e-5")
    (attempt,) = scene.attempts
    assert attempt.status == "CONVERGED"
    assert flexion(scene, "wrist", 7) == pytest.approx(-21.0, abs=0.15)
    assert abs(attempt.values["distance_mm"]) < 0.01


@pytest.mark.parametrize("method", ["SMOOTH", "PAPER"])
def test_a_finger_that_begins_inside_comes_out(run, method: str) -> None:
    """5 mm deep at first: it is turned out of the ball, the shorter way (R142)."""
    scene = run(f"METHOD {method}\nFINGER1 LEFT INDEX FLEXION AT 3 20")
    actor = scene.actor()
    vertex = pad_vertex(cover(actor), "left.index")
    skin = cover(actor).deform(stage(actor, np.array([3.0]), scene.rate))[0]
    normal = vertex_normals(skin.astype(float), actor.rig.surface.faces)[vertex]
    x, y, z = skin[vertex] + 0.025 * normal
    run(f"OBJECT a BALL 0.06 AT {x} {y} {z}\nAUTO_F_1 3 LEFT INDEX PAD a NEAREST")
    (attempt,) = scene.attempts
    assert attempt.status == "CONVERGED"
    assert 0 < 20 - flexion(scene, "index.base", 3) < 15
    skin = cover(actor).deform(stage(actor, np.array([3.0]), scene.rate))[0]
    there = ObjectSet(placed_at(scene, scene.prop("a"), 3.0)).distances(skin[vertex][None]).distance[0, 0]
    assert abs(there) < 2e-6
