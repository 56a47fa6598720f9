"""The paper's commands as printed (A §9, R79–R84), and ours beside them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.script import Interpreter, Scene
from warpjld.script.staging import frame_numbers, stage
from warpjld.skeleton import Skeleton, default_limits


def keys(scene: Scene, channel: str) -> dict[float, float]:
    track = scene.actor().motion.tracks[channel]
    return {key.frame: round(float(np.degrees(key.value)), 9) for key in track.keys}


def arm_rig(hands):
    """An upper arm and a forearm in front of the coarse hand."""

    hand = hands["left"].skeleton
    names = ("left.shoulder", "left.elbow", *hand.names[1:])
    first = np.array([[0, 0, 0.5], [0, 0, 0.25]])
    skeleton = Skeleton(
        names,
        np.concatenate([[-1, 0, 1], hand.parents[2:] + 1]).astype(np.int32),
        np.concatenate([first, hand.rest[1:]]),
        np.concatenate([hand.axes[:2], hand.axes[1:]]),
        default_limits(names),
    )
    return replace(hands["left"], skeleton=skeleton)


PRINTED = [  # with the paper's line breaks
    ("SHOULDER LEFT FLEXION 0 20 10 30", "left.shoulder.flexion"),
    ("SHOULDER LEFT PIVOT 0 20 10 30", "left.shoulder.pivot"),
    ("SHOULDER LEFT TWISTING\n0 20 10 30", "left.shoulder.twisting"),
    ("ELBOW LEFT FLEXION 0 20 10 30", "left.elbow.flexion"),
    ("ELBOW LEFT TWISTING 0 20 10 30", "left.elbow.twisting"),
    ("WRIST LEFT FLEXION 0 20 10 30", "left.wrist.flexion"),
    ("WRIST LEFT PIVOT 0 20 10 -30", "left.wrist.pivot"),
    ("METACARPUS LEFT 0 20 10 15", "left.ring.carpometacarpal.flexion"),
    ("METACARPUS LEFT 0 20 10 15", "left.pinky.carpometacarpal.flexion"),
    *(
        (f"FINGER1 LEFT {finger}\n{channel} 0 20 10 12", f"left.{finger.lower()}.base.{channel.lower()}")
        for finger in ("THUMB", "INDEX", "MIDDLE", "RING", "PINKY")
        for channel in ("FLEXION", "PIVOT")
    ),
    *(
        (f"FINGER23 LEFT {finger} KNUCKLES{k} 0 20 10 40", f"left.{finger.lower()}.knuckle{k}.flexion")
        for finger in ("THUMB", "INDEX", "MIDDLE", "RING", "PINKY")
        for k in (2, 3)
    ),
]


@pytest.mark.parametrize("change", [str, str.lower, str.title])
@pytest.mark.parametrize(("line", "channel"), PRINTED)
def test_printed_commands(hands, line: str, channel: str, change) -> None:
    scene = Scene()
    scene.add("left", arm_rig(hands))
    Interpreter(scene).run_text(change(line))
    value = float(line.split()[-1])
    assert keys(scene, channel) == {0: value, 10: value, 20: value}


def test_the_value_is_set_from_key_to_key_and_not_past_the_last(run) -> None:
    assert list(keys(run("FINGER1 LEFT INDEX FLEXION 0 25 10 45"), "left.index.base.flexion")) == [0, 10, 20]
    assert list(keys(run("FINGER1 LEFT RING FLEXION 4 4 1 45"), "left.ring.base.flexion")) == [4]
    assert list(keys(run("FINGER1 LEFT PINKY FLEXION 0 0.3 0.1 45"), "left.pinky.base.flexion")) == pytest.approx(
        [0, 0.1, 0.2, 0.3]
    )


def test_words_may_stand_in_another_order_as_in_the_papers_objects_example(run) -> None:
    scene = run("FINGER23 INDEX KNUCKLES2 LEFT 5 10 5 30\nfinger1 abduction left middle AT 3 -5")
    assert keys(scene, "left.index.knuckle2.flexion") == {5: 30, 10: 30}
    assert keys(scene, "left.middle.base.abduction") == {3: -5}


@pytest.mark.parametrize("joint", ["left.index.knuckle2", "index.knuckle2", '"Left.Index.Knuckle2"', "13"])
def test_any_joint_by_name_or_by_the_papers_number(run, joint: str) -> None:
    assert keys(run(f"JOINT {joint} FLEXION AT 1 30"), "left.index.knuckle2.flexion") == {1: 30}


@pytest.mark.parametrize(
    ("line", "place", "says"),
    [
        ("FINGER1 LEFT INDEX FLEXION 0 20 10", "1:35", "expected the value in degrees here; the command is FINGER1"),
        ("FINGER1 LEFT INDEX FLEXION", "1:27", "expected key1"),
        ("FINGER1 LEFT INDEX FLEXION 0 20 LEFT 3", "1:33", "expected the step in frames, found LEFT"),
        ("FINGER1 LEFT INDEX FLEXION 0 20 0 45", "1:33", "the step in frames must be greater than 0"),
        ("FINGER1 LEFT INDEX FLEXION 0 20 -1 45", "1:33", "the step in frames must be greater than 0"),
        ("FINGER1 LEFT INDEX FLEXION 20 0 1 45", "1:31", "key2 must not come before key1 (20)"),
        ("FINGER1 LEFT INDEX FLEXION 0 1e9 1 45", "1:34", "makes 1,000,000,001 keys"),
        ("FINGER1 LEFT INDEX FLEXION 0 20 10 91", "1:36", "goes from -45° to 90°, got 91°; LIMIT left.index.base"),
        ("FINGER1 LEFT INDEX FLEXION 0 20 10 45 1", "1:39", "expected the end of the line, found 1"),
        ("FINGER1 LEFT INDEKS FLEXION 0 20 10 45", "1:14", "found INDEKS; did you mean INDEX?"),
        ("FINGER1 LEFT INDEX TWISTING 0 20 10 45", "1:20", "expected FLEXION/PIVOT/ABDUCTION, found TWISTING"),
        ("FINGER1 INDEX FLEXION 0 20 10 45", "1:23", "expected LEFT/RIGHT, found 0"),
        ("FINGER23 LEFT INDEX KNUCKLES4 0 20 10 45", "1:21", "did you mean KNUCKLES"),
        ("METACARPUS LEFT 0 20 10 21", "1:25", "goes from 0° to 20°"),
        ("ELBOW LEFT FLEXION 0 20 10 5", "1:1", "actor LEFT has no joint left.elbow"),
        ("FINGER1 RIGHT INDEX FLEXION 0 20 10 45", "1:1", "no actor has a right side; add one with HAND RIGHT"),
        ("JOINT index.nuckle2 FLEXION AT 1 30", "1:7", "did you mean index.knuckle2"),
        ("JOINT 18 FLEXION AT 1 30", "1:7", "17 or less"),
        ("JOINT index.carpometacarpal FLEXION AT 1 3", "1:42", "left.index.carpometacarpal has no flexion"),
        ("MOVE nobody 0 1 1 1", "1:1", "there is no actor nobody"),
        ("MOVE left 0 1 1", "1:16", "the displacement's z"),
        ("SPLINE 2", "1:8", "the tension must be 1 or less"),
        ("SPLINE 0 1", "1:11", "expected the bias"),
        ("FRAMES 10 5", "1:11", "must not come before the first (10)"),
        ("FRAMES 1.5 5", "1:8", "must be a whole number"),
        ("RATE 0", "1:6", "must be greater than 0"),
    ],
)
def test_errors_point_at_the_word(run, line: str, place: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        run(line)
    assert str(caught.value).startswith(f"<script>:{place}: ")
    assert says in str(caught.value)


def test_ten_joints_of_a_hand_have_flexion_only(run) -> None:
    """All of R7 but the bases of digits (R9)."""
    digits = ("pinky", "ring", "middle", "index", "thumb")
    ten = [f"{digit}.{joint}" for digit in digits for joint in ("knuckle2", "knuckle3")]
    for joint in (*ten, "ring.carpometacarpal", "pinky.carpometacarpal"):
        run(f"JOINT left.{joint} FLEXION AT 1 5")
        for channel in ("PIVOT", "TWISTING", "ABDUCTION"):
            with pytest.raises(InputError, match=f"left.{joint} has no {channel.lower()}"):
                run(f"JOINT left.{joint} {channel} AT 1 5")


def test_limits_can_be_changed(run) -> None:
    scene = run("LIMIT index.base FLEXION -10 110\nFINGER1 LEFT INDEX FLEXION AT 0 105")
    assert keys(scene, "left.index.base.flexion") == {0: 105}
    with pytest.raises(InputError, match="from -10° to 110°"):
        run("FINGER1 LEFT INDEX FLEXION AT 0 -20")
    stage(scene.actor(), np.zeros(1), 30)  # the motion agrees with the new limits


def test_spline_constants_hold_for_the_keys_that_follow(run) -> None:
    scene = run("WRIST LEFT FLEXION AT 0 1\nSPLINE 0.5 -0.25 1\nWRIST LEFT FLEXION AT 5 1\nSPLINE 0.1")
    scene = run("WRIST LEFT FLEXION AT 9 1")
    rows = [(k.tension, k.continuity, k.bias) for k in scene.actor().motion.tracks["left.wrist.flexion"].keys]
    assert rows == [(0, 0, 0), (0.5, -0.25, 1), (0.1, 0, 0)]


def test_frames_default_to_the_keys_of_all_actors(run, hands) -> None:
    scene = run("")
    np.testing.assert_array_equal(frame_numbers(scene), [0])
    run("WRIST LEFT FLEXION AT 3 1")
    scene.add("right", hands["right"])
    run("WRIST RIGHT FLEXION AT 7.5 1\nMOVE right -2 0 0 0")
    np.testing.assert_array_equal(frame_numbers(scene), np.arange(-2, 8))
    run("FRAMES 5 6")
    np.testing.assert_array_equal(frame_numbers(scene), [5, 6])


def test_move_and_turn_are_rigid(run) -> None:
    actor = run("FINGER1 LEFT INDEX FLEXION AT 0 40").actor()
    frames = np.array([0.0, 10.0])
    before = stage(actor, frames, 30)
    run("MOVE left 10 0.1 0.2 0.3\nMOVE left 0 0 0 0\nTURN left 0 0 0 0\nTURN left 10 0 90 0")
    after = stage(actor, frames, 30)
    np.testing.assert_allclose(after.positions[0], before.positions[0], atol=1e-12)
    root = before.positions[1, 0]
    x, y, z = np.moveaxis(before.positions[1] - root, -1, 0)
    moved = root + np.stack([z, y, -x], axis=-1) + [0.1, 0.2, 0.3]  # a quarter turn about y takes z to x
    np.testing.assert_allclose(after.positions[1], moved, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(after.rotations, axis=-1), 1, atol=1e-12)
    np.testing.assert_array_equal(after.flexion, before.flexion)
    tip, quarter = actor.skeleton.index("index.tip"), np.sqrt(0.5)
    from scipy.spatial.transform import Rotation

    expected = Rotation.from_quat([0, quarter, 0, quarter]) * Rotation.from_quat(before.rotations[1, tip])
    np.testing.assert_allclose(
        Rotation.from_quat(after.rotations[1, tip]).as_matrix(), expected.as_matrix(), atol=1e-12
    )


def test_left_and_right_actors_are_told_apart_by_the_side(run, hands) -> None:
    scene = run("")
    scene.add("right", hands["right"])
    run("WRIST LEFT FLEXION AT 0 10\nWRIST RIGHT FLEXION AT 0 20\nACTOR left\nWRIST RIGHT FLEXION AT 1 30")
    assert list(scene.actors["LEFT"].motion.tracks) == ["left.wrist.flexion"]
    assert [k.frame for k in scene.actors["RIGHT"].motion.tracks["right.wrist.flexion"].keys] == [0, 1]
    scene.add("second", hands["right"])
    run("ACTOR second\nWRIST RIGHT FLEXION AT 5 10\nACTOR left")
    assert scene.actors["SECOND"].key_frames == [5]
    with pytest.raises(InputError, match=r"several actors have a right side \(RIGHT, SECOND\); choose one with ACTOR"):
        run("WRIST RIGHT FLEXION AT 5 10")


def test_without_actors_the_first_step_is_told() -> None:
    with pytest.raises(InputError, match=r"1:1: there is no actor yet; begin with a line such as HAND LEFT BUILTIN"):
        Interpreter(Scene()).run_text("WRIST LEFT FLEXION AT 0 10")


def test_a_rig_in_which_no_hand_was_recognised_is_named(run) -> None:
    scene = run("FRAMES 0 1")
    actor = scene.actor()
    names = tuple(name.replace("left.", "b_") for name in actor.skeleton.names)
    scene.actors = {actor.name: SimpleNamespace(name="PAW", skeleton=replace(actor.skeleton, names=names))}
    with pytest.raises(InputError, match="neither hand nor body was recognised in PAW; state its joints with MAP"):
        Scene.actor_with(SimpleNamespace(actors=scene.actors, actor=lambda: next(iter(scene.actors.values()))), "left")
