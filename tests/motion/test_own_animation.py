"""A file's own animation, played by its own joints, against plain skinning (``skinning_oracle``) of the same file.

The covering rounds joints on purpose, so two things are compared: what every joint does to the vertices that hang on it
alone, and the covered surface where a bone is far from its joints.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pygltflib
import pytest
from scipy.spatial.transform import Rotation

from tests.motion.skinned_files import Skinned, Track, animal, write
from tests.motion.skinning_oracle import Skinning
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion import load_motion
from warpjld.motion.animations import animation_names
from warpjld.motion.load import LoadedMotion
from warpjld.rig import Rig

CLOSE = 1e-4
"""Of the rig's size, as the requirement says."""


def one_bone(oracle: Skinning) -> np.ndarray:
    return oracle.weights.max(axis=1) > 1 - 1e-6


def follow(rig: Rig, loaded: LoadedMotion, oracle: Skinning, frame: int) -> np.ndarray:
    """Where a frame's joints bring vertices of one bone, shape (V, 3), NaN for the others."""
    rest = rig.surface.to_source(rig.surface.vertices)
    skin = oracle.gltf.skins[oracle.holder.skin]
    assert rig.source is not None
    of_source = {source: j for j, source in enumerate(rig.sources) if source >= 0}
    nodes = [of_source.get(k, -1) for k in range(len(skin.joints))]
    joint = np.array(nodes)[oracle.joints[np.arange(len(rest)), oracle.weights.argmax(axis=1)]]
    turn = Rotation.from_quat(loaded.poses.rotations[frame, joint])
    out = turn.apply(rest - rig.skeleton.rest[joint]) + loaded.poses.positions[frame, joint]
    out[(joint < 0) | ~one_bone(oracle)] = np.nan
    return out


def worst(rig: Rig, loaded: LoadedMotion, oracle: Skinning, frames: list[int]) -> float:
    """Largest distance from plain skinning, relative to the rig's size."""
    out = []
    for frame in frames:
        want = oracle.vertices(oracle.first + frame / loaded.rate)
        want = want @ rig.placing[:3, :3].T + rig.placing[:3, 3]
        got = follow(rig, loaded, oracle, frame)
        assert np.isfinite(got).all(axis=1).sum() > 20
        out.append(np.nanmax(np.linalg.norm(got - want, axis=1)))
    return max(out) / rig.surface.size


def gait(
    what: Skinned, mode: str = "LINEAR", keys: int = 4, moving: tuple[str, ...] = ()
) -> dict[tuple[int, str], Track]:
    """Every joint turns, and the root wanders; every fourth frame is a key."""
    rng = np.random.default_rng(7)
    times = np.arange(keys) / 30 * 4
    tracks: dict[tuple[int, str], Track] = {}

    def track(values: np.ndarray) -> Track:
        if mode != "CUBICSPLINE":
            return times, values, mode
        tangents = 0.3 * rng.standard_normal(values.shape)
        return times, np.stack([tangents, values, -tangents], axis=1).reshape(-1, values.shape[1]), mode

    for j, name in enumerate(what.names):
        if moving and name not in moving:
            continue
        turns = Rotation.from_quat(what.turns[j]) * Rotation.from_rotvec(0.5 * rng.standard_normal((keys, 3)))
        tracks[j, "rotation"] = track(turns.as_quat())
    root = what.parents.index(-1)
    tracks[root, "translation"] = track(what.offsets[root] + 0.2 * rng.standard_normal((keys, 3)))
    return tracks


FBX = {"scale": [0.01, 0.01, 0.01], "rotation": [-0.7071067811865476, 0.0, 0.0, 0.7071067811865476]}
TURNED = {"rotation": Rotation.from_euler("xyz", [0.4, 1.0, -2.0]).as_quat().tolist(), "translation": [1.0, 2.0, 3.0]}

FILES = {
    "metres": {},
    "inches": {"unit": 39.37007874},
    "millimetres": {"unit": 1000.0},
    "FBX root": {"unit": 100.0, "armature": FBX},
    "root turned": {"armature": TURNED},
    "root mirrored": {"armature": {"scale": [-1.0, 1.0, 1.0]}},
    "root stretched": {"armature": {"scale": [1.0, 1.0, 1.3]}},
    "matrices": {"matrices": True, "moving": ("girth", "nape", "flap.a", "brush2")},
    "shown in another pose": {"shown": {1: [0.0, 0.0, 0.3826834, 0.9238795], 5: [0.5, 0.5, 0.5, 0.5]}},
}


@pytest.mark.parametrize("case", FILES)
def test_files_of_every_make(tmp_path: Path, case: str) -> None:
    how = dict(FILES[case])
    tracks = gait(animal(), moving=how.pop("moving", ()))
    path = write(tmp_path / "a.glb", animal(), {"walk": tracks}, **how)
    rig = load_rig(path)
    loaded = load_motion(path, rig)
    oracle = Skinning(path)
    assert (len(loaded.poses), loaded.rate) == (13, 30)
    shape = oracle.vertices(None) @ rig.placing[:3, :3].T + rig.placing[:3, 3]
    np.testing.assert_allclose(rig.surface.to_source(rig.surface.vertices), shape, atol=1e-5 * rig.surface.size)
    if case != "root stretched":  # there a rotation under the stretch is none in the world
        assert worst(rig, loaded, oracle, [0, 3, 7, 12]) < CLOSE
        assert loaded.warnings == ()
    else:
        assert "scales" in loaded.warnings[0]


@pytest.mark.parametrize("mode", ["STEP", "CUBICSPLINE"])
def test_interpolations(tmp_path: Path, mode: str) -> None:
    path = write(tmp_path / "a.glb", animal(), {"walk": gait(animal(), mode)})
    rig = load_rig(path)
    loaded = load_motion(path, rig)
    assert worst(rig, loaded, Skinning(path), list(range(13))) < CLOSE


@pytest.mark.parametrize("how", [{"unit": "cm"}, {"scale": 0.37}, {"up": "z"}, {"unit": "mm", "up": "z", "scale": 2.0}])
def test_what_was_guessed_on_loading_does_not_matter(tmp_path: Path, how: dict) -> None:
    path = write(tmp_path / "a.glb", animal(), {"walk": gait(animal())}, unit=100.0, armature=TURNED)
    rig = load_rig(path, **how)
    assert worst(rig, load_motion(path, rig), Skinning(path), [5, 12]) < CLOSE


def test_flat_hierarchies(tmp_path: Path) -> None:
    what = animal()
    frames = what.frames()
    flat = replace(
        what,
        parents=[-1] * len(what.names),
        offsets=frames[:, :3, 3],
        turns=Rotation.from_matrix(frames[:, :3, :3]).as_quat(),
    )
    path = write(tmp_path / "a.glb", flat, {"walk": gait(flat)})
    rig = load_rig(path)
    assert worst(rig, load_motion(path, rig), Skinning(path), [5, 12]) < CLOSE


@pytest.mark.parametrize(
    ("names", "what"),
    [
        (["Bone"] * 12, "all"),
        (["a", "a", "b", "a", "ear", "ear", "t", "t", "leg", "leg", "leg", "leg"], "some"),
    ],
    ids=lambda x: x if isinstance(x, str) else "",
)
@pytest.mark.parametrize("above", [0, 3])
def test_doubled_names_are_told_apart_by_their_place(tmp_path: Path, names: list, what: str, above: int) -> None:
    called = replace(animal(), names=names)
    path = write(tmp_path / "a.glb", called, {"walk": gait(called)})
    rig = load_rig(path)
    loaded = load_motion(path, rig)
    assert worst(rig, loaded, Skinning(path), [5, 12]) < CLOSE
    # the same from a file of nodes only, in which other nodes come first and the joints hang elsewhere
    bare = write(tmp_path / "nodes.glb", called, {"walk": gait(called)}, skinned=False, above=above)
    apart = load_motion(bare, rig)
    np.testing.assert_allclose(apart.poses.positions, loaded.poses.positions, atol=1e-6)
    np.testing.assert_allclose(np.abs((apart.poses.rotations * loaded.poses.rotations).sum(-1)), 1, atol=1e-9)


def test_joints_without_names_follow_the_files_own_animation(tmp_path: Path) -> None:
    called = replace(animal(), names=[None] * 12)
    path = write(tmp_path / "a.glb", called, {"walk": gait(called)})
    rig = load_rig(path)
    assert worst(rig, load_motion(path, rig), Skinning(path), [5, 12]) < CLOSE


@pytest.mark.parametrize(("unit", "armature"), [(1.0, TURNED), (100.0, None), (100.0, FBX)])
def test_an_animation_without_skin_of_the_same_skeleton(tmp_path: Path, unit: float, armature: dict | None) -> None:
    rigged = write(tmp_path / "rig.glb", animal(), {"walk": gait(animal())})
    rig = load_rig(rigged)
    moves = write(
        tmp_path / "moves.glb", animal(), {"walk": gait(animal())}, unit=unit, armature=armature, skinned=False, above=2
    )
    loaded = load_motion(moves, rig)
    assert worst(rig, loaded, Skinning(rigged), [5, 12]) < CLOSE


def test_an_animation_whose_file_shows_another_pose_plays_on_the_same_bones(tmp_path: Path) -> None:
    """As exporters write nodes at the first frame: local transforms are what counts, as in any engine."""
    tracks = gait(animal())
    rigged = write(tmp_path / "rig.glb", animal(), {"walk": tracks})
    rig = load_rig(rigged)
    first = {j: values[0] for (j, path), (_, values, _) in tracks.items() if path == "rotation"}
    moves = write(tmp_path / "m.glb", animal(), {"walk": tracks}, unit=100.0, skinned=False, shown=first)
    loaded = load_motion(moves, rig)
    assert any("another rest pose" in note for note in loaded.notes)
    assert worst(rig, loaded, Skinning(rigged), [0, 5, 12]) < CLOSE


def test_joints_that_the_animations_file_lacks_follow_and_are_told(tmp_path: Path) -> None:
    rig = load_rig(write(tmp_path / "rig.glb", animal(), {"walk": gait(animal())}))
    kept = [j for j, name in enumerate(animal().names) if not name.startswith("flap")]
    fewer = replace(
        animal(),
        names=[animal().names[j] for j in kept],
        parents=[kept.index(p) if (p := animal().parents[j]) >= 0 else -1 for j in kept],
        offsets=animal().offsets[kept],
        turns=animal().turns[kept],
    )
    loaded = load_motion(write(tmp_path / "m.glb", fewer, {"walk": gait(fewer)}, skinned=False), rig)
    assert any("flap.a, flap.b" in note for note in loaded.notes)
    skull, flap = (rig.skeleton.index(name) for name in ("skull", "flap.a"))
    alike = (loaded.poses.rotations[:, skull] * loaded.poses.rotations[:, flap]).sum(-1)
    np.testing.assert_allclose(np.abs(alike), 1, atol=1e-12)


def covered(rig: Rig, loaded: LoadedMotion, frame: int, muscles: bool = True) -> np.ndarray:
    """The deformed surface in the file's order; without what swells on every bone where it bends."""
    from warpjld.covering import bind, default_parameters

    chosen = default_parameters(rig.skeleton)
    if not muscles:
        chosen = replace(chosen, muscle=0 * chosen.muscle, inflation=0 * chosen.inflation)
    covering = bind(rig.skeleton, rig.surface, parameters=chosen)
    if not muscles:
        covering.swelling = 0 * chosen.muscle
    return rig.surface.to_source(covering.deform(loaded.poses[frame : frame + 1])[0])


@pytest.mark.parametrize("leaf", ["flap.a", "brush2"])
def test_a_leaf_turns_whole(tmp_path: Path, leaf: str) -> None:
    what = animal()
    j = what.names.index(leaf)
    turned = Rotation.from_quat(what.turns[j]) * Rotation.from_rotvec([np.radians(60), 0, 0])
    track: Track = (np.array([0.0, 1.0]), np.array([what.turns[j], turned.as_quat()]), "LINEAR")
    path = write(tmp_path / "a.glb", what, {"nod": {(j, "rotation"): track}})
    rig = load_rig(path)
    assert f"{leaf}.end" in rig.skeleton.names
    loaded = load_motion(path, rig)
    oracle = Skinning(path)
    want, rest = oracle.vertices(1.0), oracle.vertices(None)
    moved = np.linalg.norm(want - rest, axis=1)
    far = one_bone(oracle) & (oracle.joints[np.arange(len(moved)), oracle.weights.argmax(axis=1)] == j)
    far &= moved > 0.75 * moved.max()  # beyond what the joint's rounding reaches
    got = covered(rig, loaded, len(loaded.poses) - 1, muscles=False)
    off = np.linalg.norm(got - want, axis=1)[far] / rig.surface.size
    assert far.sum() > 15
    assert moved.max() > 0.05 * rig.surface.size
    assert off.max() < 2e-3
    assert np.median(off) < CLOSE


def test_an_end_lies_in_the_flesh_that_its_joint_owns(tmp_path: Path) -> None:
    from warpjld.geometry.winding import winding_numbers

    rig = load_rig(write(tmp_path / "a.glb", animal(), {}))
    ends = [j for j, name in enumerate(rig.skeleton.names) if name.endswith(".end")]
    assert [rig.skeleton.names[j] for j in ends] == [
        f"{name}.end" for name in ("flap.a", "flap.b", "brush2", "prop.a2", "prop.b2")
    ]
    assert (winding_numbers(rig.surface.vertices, rig.surface.faces, rig.skeleton.rest[ends]) > 0.5).all()
    for j, place in zip(ends, ((0.1, 1.05, 0.5), (-0.1, 1.05, 0.5), (0, 0.62, -1.1)), strict=False):
        assert np.linalg.norm(rig.skeleton.rest[j] - place) < 0.03


def test_a_joint_gets_an_end_for_flesh_that_none_of_its_bones_reaches(tmp_path: Path) -> None:
    """A head whose children are ears carries its snout, too."""
    what = animal(snout=True)
    j = what.names.index("skull")
    turned = Rotation.from_quat(what.turns[j]) * Rotation.from_rotvec([0, 0, np.radians(40)])
    track: Track = (np.array([0.0, 1.0]), np.array([what.turns[j], turned.as_quat()]), "LINEAR")
    path = write(tmp_path / "a.glb", what, {"nod": {(j, "rotation"): track}})
    rig = load_rig(path)
    end = rig.skeleton.rest[rig.skeleton.index("skull.end")]
    assert np.linalg.norm(end - [0.0, 0.72, 0.95]) < 0.05
    oracle = Skinning(path)
    want, rest = oracle.vertices(1.0), oracle.vertices(None)
    snout = one_bone(oracle) & (rest[:, 2] > 0.8)
    got = covered(rig, load_motion(path, rig), 30, muscles=False)
    off, moved = (np.linalg.norm(got - x, axis=1) / rig.surface.size for x in (want, rest))
    # the rounding of the neck fades out along the snout; its front is rigid
    assert snout.sum() > 20
    assert moved[snout].min() > 0.05
    assert off[snout].max() < 3e-3
    assert off[one_bone(oracle) & (rest[:, 2] > 0.98)].max() < CLOSE


def test_scale_zero_and_negative_are_told_with_node_and_frame(tmp_path: Path) -> None:
    what = animal()
    ear, tail = what.names.index("flap.a"), what.names.index("brush1")
    times = np.array([0.0, 0.5, 1.0])
    zero: Track = (times, np.array([[1, 1, 1], [0, 0, 0], [1, 1, 1]]), "STEP")
    path = write(tmp_path / "a.glb", what, {"wink": gait(what) | {(ear, "scale"): zero}})
    rig = load_rig(path)
    loaded = load_motion(path, rig)
    assert len(loaded.warnings) == 1
    assert "'flap.a' to 0 at frame 15" in loaded.warnings[0]
    others = [k for k, name in enumerate(rig.skeleton.names) if not name.startswith("flap")]
    plain = load_motion(write(tmp_path / "b.glb", what, {"wink": gait(what)}), rig)
    for field in ("positions", "rotations"):
        same = getattr(plain.poses, field)[:12, others]
        np.testing.assert_allclose(getattr(loaded.poses, field)[:12, others], same, atol=1e-6)
    negative: Track = (times[:2], np.array([[1, 1, 1], [-1, 1, 1]]), "LINEAR")
    path = write(tmp_path / "c.glb", what, {"flip": {(tail, "scale"): negative}})
    loaded = load_motion(path, rig)
    assert any("'brush1': its scale turns negative at frame 8" in warning for warning in loaded.warnings)
    assert np.isfinite(loaded.poses.rotations).all()
    # the joint below lies where the file says, mirrored
    below = rig.skeleton.index("brush2")
    want = Skinning(path).worlds(0.5)[what.names.index("brush2"), :3, 3]
    np.testing.assert_allclose(loaded.poses.positions[-1, below], want, atol=1e-6)


def test_scale_zero_at_rest(tmp_path: Path) -> None:
    what = replace(animal(), scales={animal().names.index("brush2"): (0.0, 0.0, 0.0)})
    path = write(tmp_path / "a.glb", what, {"walk": gait(what)})
    rig = load_rig(path)
    assert any("'brush2': scale 0 at rest" in doubt for doubt in rig.suspicious)
    loaded = load_motion(path, rig)
    assert worst(rig, loaded, Skinning(path), [5, 12]) < CLOSE
    nothing = write(tmp_path / "b.glb", animal(), {}, armature={"scale": [0.0, 0.0, 0.0]})
    with pytest.raises(InputError, match="node 'Armature': scale 0 at rest collapses all joints"):
        load_rig(nothing)


def test_scales_that_are_one_or_stay_are_no_news(tmp_path: Path) -> None:
    what = replace(animal(), scales={2: (1.2, 1.2, 1.2), 6: (0.7, 0.7, 0.7)})
    kept: Track = (np.array([0.0, 1.0]), np.tile([1.2, 1.2, 1.2], (2, 1)), "LINEAR")
    path = write(tmp_path / "a.glb", what, {"walk": gait(what) | {(2, "scale"): kept}})
    rig = load_rig(path)
    loaded = load_motion(path, rig)
    assert loaded.warnings == ()
    assert worst(rig, loaded, Skinning(path), [5, 12]) < CLOSE


def test_a_mirrored_file_moves_as_the_mirror_image(tmp_path: Path) -> None:
    tracks = gait(animal())
    plain = load_rig(write(tmp_path / "a.glb", animal(), {"walk": tracks}))
    mirrored = load_rig(write(tmp_path / "b.glb", animal(), {"walk": tracks}, armature={"scale": [-1.0, 1.0, 1.0]}))
    mirror = np.array([-1.0, 1.0, 1.0])
    np.testing.assert_allclose(mirrored.surface.vertices * mirror, plain.surface.vertices, atol=1e-6)
    np.testing.assert_array_equal(mirrored.surface.faces[:, ::-1], plain.surface.faces)
    first, second = (load_motion(rig.path, rig).poses for rig in (plain, mirrored))
    np.testing.assert_allclose(second.positions * mirror, first.positions, atol=1e-6)
    pseudo = np.array([1.0, -1.0, -1.0, 1.0])  # a reflection keeps turns about x
    np.testing.assert_allclose(np.abs((second.rotations * pseudo * first.rotations).sum(-1)), 1, atol=1e-9)


def test_animations_are_listed_and_chosen_by_name(tmp_path: Path) -> None:
    times = np.array([0.0, 0.1])
    turn = Rotation.from_quat(animal().turns[1])

    def bend(angle: float) -> dict[tuple[int, str], Track]:
        turns = [(turn * Rotation.from_rotvec([x, 0, 0])).as_quat() for x in (0, angle)]
        return {(1, "rotation"): (times, np.array(turns), "LINEAR")}

    nod, wag = bend(0.2), bend(0.9)
    path = write(tmp_path / "a.glb", animal(), {"Nod": nod, "Wag": wag})
    rig = load_rig(path)
    assert animation_names(path) == ("Nod", "Wag")
    unsaid = load_motion(path, rig)
    assert any("'Nod', the first of 2: Nod, Wag" in note for note in unsaid.notes)
    chosen = {name: load_motion(path, rig, animation=name).poses for name in ("nod", "WAG")}
    girth = rig.skeleton.index("girth")
    angles = [Rotation.from_quat(p.rotations[-1, girth]).magnitude() for p in (unsaid.poses, *chosen.values())]
    np.testing.assert_allclose(angles, [0.2, 0.2, 0.9], atol=1e-6)
    with pytest.raises(InputError, match="no animation 'wig' in this file; did you mean Wag"):
        load_motion(path, rig, animation="wig")
    assert animation_names(tmp_path / "a.csv") == ()


@pytest.mark.parametrize(
    "names",
    [["Action", "Action.001", "Action.002"], [None, None, None], ["girth_Anim", "nape_Anim", "skull_Anim"]],
    ids=["numbered", "unnamed", "named by node"],
)
def test_one_animation_a_node_is_one_animation(tmp_path: Path, names: list) -> None:
    tracks = gait(animal(), moving=("girth", "nape", "skull"))
    parts = [{key: track for key, track in tracks.items() if key == (j, "rotation")} for j in (1, 2, 3)]
    whole = write(tmp_path / "whole.glb", animal(), {"all": {k: v for part in parts for k, v in part.items()}})
    split = write(tmp_path / "split.glb", animal(), dict(zip(["x", "y", "z"], parts, strict=True)))

    gltf = pygltflib.GLTF2().load(str(split))
    for animation, name in zip(gltf.animations, names, strict=True):
        animation.name = name
    gltf.save_binary(str(split))
    assert len(animation_names(split)) == 1
    rig = load_rig(whole)
    loaded = load_motion(split, rig)
    assert any("3 animations, each of one node" in note for note in loaded.notes)
    np.testing.assert_allclose(loaded.poses.positions, load_motion(whole, rig).poses.positions, atol=1e-9)


def test_animated_morph_targets_are_told(tmp_path: Path) -> None:

    path = write(tmp_path / "a.glb", animal(), {"walk": gait(animal())})
    gltf = pygltflib.GLTF2().load(str(path))
    channels = gltf.animations[0].channels
    target = pygltflib.AnimationChannelTarget(node=0, path="weights")
    channels.append(pygltflib.AnimationChannel(sampler=0, target=target))
    gltf.save_binary(str(path))
    assert any("morph targets" in warning for warning in load_motion(path, load_rig(path)).warnings)


QUADRUPED = ["_rootJoint", "b_Root_00", "b_Hip_01", "b_Spine01_02", "b_Neck_04", "b_Head_05", "b_Ear_a", "b_Ear_b"] + [
    f"b_{name}" for name in ("Tail01", "Tail02", "LeftUpperArm", "LeftForeArm", "RightLeg01", "RightLeg02")
]


def test_the_joint_with_the_flesh_stands_for_roots_above_it(tmp_path: Path) -> None:
    """An animal named as a body is: its flesh hangs on the hips, two roots above them carry none."""
    what = animal()
    rooted = Skinned(
        QUADRUPED,
        [-1, 0, *(p + 2 if p >= 0 else 1 for p in what.parents)],
        np.vstack([np.zeros((2, 3)), what.offsets]),
        np.vstack([[[0.0, 0.0, 0.0, 1.0]] * 2, what.turns]),
        what.vertices,
        what.faces,
        what.joints + 2,
        what.weights,
    )
    path = write(tmp_path / "a.glb", rooted, {"walk": gait(rooted)})
    rig = load_rig(path)
    pelvis = rig.source_joints.index("b_Hip_01")
    np.testing.assert_allclose(rig.skeleton.rest[pelvis], what.offsets[0], atol=1e-6)
    loaded, oracle = load_motion(path, rig), Skinning(path)
    assert worst(rig, loaded, oracle, [5, 12]) < CLOSE
    hips = one_bone(oracle) & (oracle.joints[:, 0] == 2)
    assert np.isfinite(follow(rig, loaded, oracle, 5)[hips]).all()


def test_flesh_of_joints_that_are_part_of_another_is_told(tmp_path: Path) -> None:
    names = ["Hips", "Spine", "Neck", "Head", "Jaw", "Brow", *(f"tail{n}" for n in range(6))]
    what = replace(animal(), names=names)
    path = write(tmp_path / "a.glb", what, {"walk": gait(what, moving=("Spine", "Jaw"))})
    rig = load_rig(path)
    told = any("Jaw (" in warning and "part of head" in warning for warning in load_motion(path, rig).warnings)
    assert told == ("jaw" not in rig.skeleton.names)


@pytest.mark.parametrize(
    ("name", "share"),
    [
        ("hand_webxr_generic/left.glb", 1.0),
        ("hand_godot_low/Hand_Nails_low_L.gltf", 1.0),
        ("body_mesh2motion_mannequin/human-male.glb", 0.95),
    ],
)
def test_real_rigs_with_every_joint_turning(data: Path, tmp_path: Path, name: str, share: float) -> None:
    """The share of vertices of one bone whose bone is a joint of the skeleton; all of those follow it."""
    from tests.motion.test_gltf_animation import File

    gltf = pygltflib.GLTF2().load(str(data / name))
    gltf.convert_buffers(pygltflib.BufferFormat.BINARYBLOB)
    file = File(gltf)
    rng = np.random.default_rng(1)
    for n in gltf.skins[0].joints:
        rest = Rotation.from_quat(gltf.nodes[n].rotation or [0.0, 0.0, 0.0, 1.0])
        turned = rest * Rotation.from_rotvec(0.3 * rng.standard_normal(3))
        file.animate(n, "rotation", np.array([0.0, 0.5]), np.array([rest.as_quat(), turned.as_quat()]))
    path = file.save(tmp_path / "a.glb")
    rig = load_rig(path)
    loaded, oracle = load_motion(path, rig), Skinning(path)
    assert len(loaded.poses) == 16
    assert worst(rig, loaded, oracle, [7, 15]) < CLOSE
    followed = np.isfinite(follow(rig, loaded, oracle, 15)).all(axis=1)
    assert followed.sum() >= share * one_bone(oracle).sum()


@pytest.fixture(scope="module")
def faults() -> Path:
    """Folder of small files that once went wrong."""
    folder = Path(__file__).resolve().parents[3] / "shared" / "faults"
    if not folder.is_dir():
        pytest.skip("the project's faults (../shared/faults) are not here")
    return folder


@pytest.mark.parametrize(
    ("name", "frames"),
    [
        ("own_animation_in_cm/hand_m.glb", 31),
        ("own_animation_in_cm/hand_cm.glb", 31),
        ("leaf_joint/leaf.glb", 31),
        ("last_frame_lost/fps_30_100.glb", 100),
        ("several_animations/twoanims.glb", 31),
        ("dup_names/dupnames.glb", 31),
        ("other_scene/scene2.glb", 31),
        ("scale_zero/scale0_rest.glb", 31),
    ],
)
def test_faults_move_as_plain_skinning_says(faults: Path, name: str, frames: int) -> None:
    rig = load_rig(faults / name)
    loaded = load_motion(faults / name, rig)
    assert len(loaded.poses) == frames
    assert worst(rig, loaded, Skinning(faults / name), [frames // 2, frames - 1]) < CLOSE
    assert loaded.warnings == ()


def test_faults_of_scale_are_told_in_one_line_each(faults: Path) -> None:
    for name, message in (
        ("scale0_anim.glb", "scales 'J0' to 0 at frame 30"),
        ("scaleneg_anim.glb", "node 'J1': its scale turns negative at frame 16"),
    ):
        rig = load_rig(faults / "scale_zero" / name)
        loaded = load_motion(faults / "scale_zero" / name, rig)
        assert message in "\n".join(loaded.warnings)
        assert np.isfinite(loaded.poses.positions).all()
        assert np.isfinite(loaded.poses.rotations).all()


def test_the_fault_of_the_leaf_moves_as_far_as_the_file_says(faults: Path) -> None:
    path = faults / "leaf_joint" / "leaf.glb"
    rig = load_rig(path)
    loaded = load_motion(path, rig)
    got, oracle = covered(rig, loaded, 30), Skinning(path)
    want, rest = oracle.vertices(1.0), oracle.vertices(None)
    tip = int(np.argmax(np.linalg.norm(want - rest, axis=1)))
    assert np.linalg.norm(got[tip] - rest[tip]) / rig.surface.size == pytest.approx(0.332, abs=1e-3)
    assert np.linalg.norm(got[tip] - want[tip]) < CLOSE * rig.surface.size


def test_the_covered_hand_moves_alike_in_metres_and_centimetres(faults: Path) -> None:
    """Middles of phalanges, where one bone's flesh is rigid in both."""
    for name in ("hand_m.glb", "hand_cm.glb"):
        path = faults / "own_animation_in_cm" / name
        rig = load_rig(path)
        oracle = Skinning(path)
        want = oracle.vertices(1.0) @ rig.placing[:3, :3].T + rig.placing[:3, 3]
        off = np.linalg.norm(covered(rig, load_motion(path, rig), 30) - want, axis=1)[one_bone(oracle)]
        assert off.max() < CLOSE * rig.surface.size


def test_flips_are_looked_for_at_the_files_own_rate(tmp_path: Path) -> None:
    turns = {0.0: 0.0, 1 / 30: 10.0, 2 / 30: 130.0, 3 / 30: 140.0, 4 / 30: 150.0}
    values = Rotation.from_rotvec([[angle, 0.0, 0.0] for angle in turns.values()], degrees=True)
    start = Rotation.from_quat(animal().turns[3])
    track = (np.array(list(turns)), (start * values).as_quat(), "LINEAR")
    path = write(tmp_path / "a.glb", animal(), {"walk": {(3, "rotation"): track}})
    rig = load_rig(path)
    for rate in (None, 30.0, 120.0, 10.0):
        (line,) = load_motion(path, rig, rate=rate).warnings
        assert line == "skull turns by 120° from frame 1 to 2 of the recording: a flip?"
