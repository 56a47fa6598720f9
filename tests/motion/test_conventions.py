"""Recordings in the names, rests, axes and units of the common conventions drive a rig alike."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.motion.conventions import FRAMES, Convention, Recording, record
from tests.motion.skeletons import body, rig
from warpjld.geometry.rotations import unit
from warpjld.motion import load_motion
from warpjld.motion.bvh import read_bvh
from warpjld.motion.landmarks import landmarks_of_clip
from warpjld.motion.load import LoadedMotion
from warpjld.skeleton.recognise.names import read_name

DIRECTIONS = 1.0
"""Degrees by which a deformed bone may differ from the recorded one."""

DIGITS = ("thumb", "index", "middle", "ring", "pinky")


def digits(pattern: str, first: int = 1, names: tuple[str, ...] = DIGITS, thumb: str | None = None) -> dict[str, str]:
    """Three joints a digit, numbered: ``pattern`` holds ``{digit}`` and ``{n}``."""
    return {
        f"{digit}.{joint}": (thumb if thumb and digit == "thumb" else pattern)
        .replace("{digit}", name)
        .replace("{n}", str(first + k))
        for digit, name in zip(DIGITS, names, strict=True)
        for k, joint in enumerate(("base", "knuckle2", "knuckle3"))
    }


def limbs(*names: str) -> dict[str, str]:
    """Names of clavicle, shoulder, elbow, wrist, hip, knee, ankle, ball; "" for none."""
    parts = ("clavicle", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "ball")
    return {part: name for part, name in zip(parts, names, strict=True) if name}


def trunk(*names: str) -> dict[str, str]:
    """Names of pelvis, three vertebrae, neck and head; "" for none."""
    parts = ("pelvis", "spine1", "spine2", "spine3", "neck1", "head")
    return {part: name for part, name in zip(parts, names, strict=True) if name}


MIXAMO = (
    trunk("Hips", "Spine", "Spine1", "Spine2", "Neck", "Head")
    | limbs(
        "{Left}Shoulder",
        "{Left}Arm",
        "{Left}ForeArm",
        "{Left}Hand",
        "{Left}UpLeg",
        "{Left}Leg",
        "{Left}Foot",
        "{Left}ToeBase",
    )
    | digits("{Left}Hand{digit}{n}", names=("Thumb", "Index", "Middle", "Ring", "Pinky"))
)
INSIDE = {f"{d}.carpometacarpal": f"{{Left}}InHand{d.capitalize()}" for d in DIGITS[1:]}

CONVENTIONS = {
    "Mixamo": Convention({part: f"mixamorig:{name}" for part, name in MIXAMO.items()}),
    "LAFAN1": Convention(
        {part: name for part, name in MIXAMO.items() if "." not in part} | {"ball": "{Left}Toe"},
    ),
    "HumanIK": Convention(
        MIXAMO
        | INSIDE
        | {
            "shoulder": ("{Left}Arm", "{Left}ArmRoll"),
            "elbow": ("{Left}ForeArm", "{Left}ForeArmRoll"),
            "hip": ("{Left}UpLeg", "{Left}UpLegRoll"),
            "knee": ("{Left}Leg", "{Left}LegRoll"),
        }
    ),
    "Perception Neuron": Convention({part: f"Robot_{name}" for part, name in (MIXAMO | INSIDE).items()}),
    "Poser": Convention(
        trunk("hip", "abdomen", "", "chest", "neck", "head")
        | limbs("{l}Collar", "{l}Shldr", "{l}ForeArm", "{l}Hand", "{l}Thigh", "{l}Shin", "{l}Foot", "{l}Toe")
        | digits("{l}{digit}{n}", names=("Thumb", "Index", "Mid", "Ring", "Pinky"))
    ),
    "DAZ Genesis 8": Convention(
        trunk("hip", "abdomenLower", "abdomenUpper", "chestLower", "neckLower", "head")
        | limbs("{l}Collar", "", "", "{l}Hand", "", "{l}Shin", "{l}Foot", "{l}Toe")
        | digits("{l}{digit}{n}", names=("Thumb", "Index", "Mid", "Ring", "Pinky"))
        | {f"{d}.carpometacarpal": f"{{l}}Carpal{k}" for k, d in enumerate(DIGITS[1:], start=1)}
        | {
            "shoulder": ("{l}ShldrBend", "{l}ShldrTwist"),
            "elbow": ("{l}ForearmBend", "{l}ForearmTwist"),
            "hip": ("{l}ThighBend", "{l}ThighTwist"),
        }
    ),
    "DAZ Genesis 9": Convention(
        trunk("hip", "spine1", "spine2", "spine3", "neck1", "head")
        | limbs(
            "{l}_shoulder",
            "{l}_upperarm",
            "{l}_forearm",
            "{l}_hand",
            "{l}_thigh",
            "{l}_shin",
            "{l}_foot",
            "{l}_toes",
        )
        | digits("{l}_{digit}{n}", names=("thumb", "index", "mid", "ring", "pinky"))
        | {
            f"{d}.carpometacarpal": f"{{l}}_{name}metacarpal"
            for d, name in zip(DIGITS[1:], ("index", "mid", "ring", "pinky"), strict=True)
        }
    ),
    "Rokoko": Convention(
        trunk("Hips", "Spine1", "Spine2", "Spine3", "Neck", "Head")
        | limbs(
            "{Left}Shoulder",
            "{Left}Arm",
            "{Left}ForeArm",
            "{Left}Hand",
            "{Left}Thigh",
            "{Left}Shin",
            "{Left}Foot",
            "{Left}Toe",
        )
        | {
            f"{d}.{joint}": f"{{Left}}Finger{k}{rank}"
            for k, d in enumerate(DIGITS, start=1)
            for joint, rank in (
                (("base", "Metacarpal"), ("knuckle2", "Proximal"), ("knuckle3", "Distal"))
                if d == "thumb"
                else (
                    ("carpometacarpal", "Metacarpal"),
                    ("base", "Proximal"),
                    ("knuckle2", "Medial"),
                    ("knuckle3", "Distal"),
                )
            )
        }
    ),
    "CMU": Convention(
        trunk("root", "lowerback", "upperback", "thorax", "lowerneck", "head")
        | limbs("{l}clavicle", "{l}humerus", "{l}radius", "{l}wrist", "{l}femur", "{l}tibia", "{l}foot", "{l}toes")
    ),
    "CMU by cgspeed": Convention(
        trunk("Hips", "LowerBack", "Spine", "Spine1", "Neck", "Head")
        | limbs(
            "{Left}Shoulder",
            "{Left}Arm",
            "{Left}ForeArm",
            "{Left}Hand",
            "{Left}UpLeg",
            "{Left}Leg",
            "{Left}Foot",
            "{Left}ToeBase",
        )
    ),
    "Xsens": Convention(
        trunk("Pelvis", "L5", "L3", "T8", "Neck", "Head")
        | limbs(
            "{Left}Shoulder",
            "{Left}UpperArm",
            "{Left}ForeArm",
            "{Left}Hand",
            "{Left}UpperLeg",
            "{Left}LowerLeg",
            "{Left}Foot",
            "{Left}Toe",
        )
        | {
            f"{d}.{joint}": f"{{Left}}{ordinal}{phalanx}"
            for d, ordinal in zip(DIGITS, ("First", "Second", "Third", "Fourth", "Fifth"), strict=True)
            for joint, phalanx in (
                (("base", "MC"), ("knuckle2", "PP"), ("knuckle3", "DP"))
                if d == "thumb"
                else (("carpometacarpal", "MC"), ("base", "PP"), ("knuckle2", "MP"), ("knuckle3", "DP"))
            )
        }
    ),
    "Unreal": Convention(
        trunk("pelvis", "spine_01", "spine_02", "spine_03", "neck_01", "head")
        | limbs(
            "clavicle_{l}", "upperarm_{l}", "lowerarm_{l}", "hand_{l}", "thigh_{l}", "calf_{l}", "foot_{l}", "ball_{l}"
        )
        | digits("{digit}_0{n}_{l}")
        | {f"{d}.carpometacarpal": f"{d}_metacarpal_{{l}}" for d in DIGITS[1:]}
    ),
    "MakeHuman": Convention(
        trunk("root", "spine05", "spine03", "spine01", "neck01", "head")
        | limbs("clavicle.{L}", "", "", "wrist.{L}", "", "", "foot.{L}", "")
        | {
            f"{d}.{joint}": f"finger{k}-{n}.{{L}}"
            for k, d in enumerate(DIGITS, start=1)
            for n, joint in enumerate(("base", "knuckle2", "knuckle3"), start=1)
        }
        | {f"{d}.carpometacarpal": f"metacarpal{k}.{{L}}" for k, d in enumerate(DIGITS[1:], start=1)}
        | {
            "shoulder": ("upperarm01.{L}", "upperarm02.{L}"),
            "elbow": ("lowerarm01.{L}", "lowerarm02.{L}"),
            "hip": ("upperleg01.{L}", "upperleg02.{L}"),
            "knee": ("lowerleg01.{L}", "lowerleg02.{L}"),
        }
    ),
    "Biped": Convention(
        trunk("Bip01 Pelvis", "Bip01 Spine", "Bip01 Spine1", "Bip01 Spine2", "Bip01 Neck", "Bip01 Head")
        | limbs(
            "Bip01 {L} Clavicle",
            "Bip01 {L} UpperArm",
            "Bip01 {L} Forearm",
            "Bip01 {L} Hand",
            "Bip01 {L} Thigh",
            "Bip01 {L} Calf",
            "Bip01 {L} Foot",
            "Bip01 {L} Toe0",
        )
        | {
            f"{d}.{joint}": f"Bip01 {{L}} Finger{k}{n}"
            for k, d in enumerate(DIGITS)
            for n, joint in (("", "base"), ("1", "knuckle2"), ("2", "knuckle3"))
        }
    ),
    "VRM": Convention(
        trunk("J_Bip_C_Hips", "J_Bip_C_Spine", "J_Bip_C_Chest", "J_Bip_C_UpperChest", "J_Bip_C_Neck", "J_Bip_C_Head")
        | limbs(
            "J_Bip_{L}_Shoulder",
            "J_Bip_{L}_UpperArm",
            "J_Bip_{L}_LowerArm",
            "J_Bip_{L}_Hand",
            "J_Bip_{L}_UpperLeg",
            "J_Bip_{L}_LowerLeg",
            "J_Bip_{L}_Foot",
            "J_Bip_{L}_ToeBase",
        )
        | digits("J_Bip_{L}_{digit}{n}", names=("Thumb", "Index", "Middle", "Ring", "Little"))
    ),
    "SMPL": Convention(
        trunk("Pelvis", "Spine1", "Spine2", "Spine3", "Neck", "Head")
        | limbs("{L}_Collar", "{L}_Shoulder", "{L}_Elbow", "{L}_Wrist", "{L}_Hip", "{L}_Knee", "{L}_Ankle", "{L}_Foot")
    ),
    "SMPL-X": Convention(
        trunk("pelvis", "spine1", "spine2", "spine3", "neck", "head")
        | limbs(
            "{left}_collar",
            "{left}_shoulder",
            "{left}_elbow",
            "{left}_wrist",
            "{left}_hip",
            "{left}_knee",
            "{left}_ankle",
            "{left}_foot",
        )
        | digits("{left}_{digit}{n}")
    ),
    "OptiTrack": Convention(
        trunk("Hip", "Ab", "", "Chest", "Neck", "Head")
        | limbs("{L}Shoulder", "{L}UArm", "{L}FArm", "{L}Hand", "{L}Thigh", "{L}Shin", "{L}Foot", "{L}Toe")
        | digits("{L}{digit}{n}", names=("Thumb", "Index", "Middle", "Ring", "Pinky"))
    ),
    "Kinect": Convention(
        trunk("SpineBase", "SpineMid", "", "SpineShoulder", "Neck", "Head")
        | limbs(
            "", "Shoulder{Left}", "Elbow{Left}", "Wrist{Left}", "Hip{Left}", "Knee{Left}", "Ankle{Left}", "Foot{Left}"
        )
    ),
    "ACCAD": Convention(
        trunk("Hips", "ToSpine", "Spine", "Spine1", "Neck", "Head")
        | limbs(
            "{Left}Collar",
            "{Left}Shoulder",
            "{Left}Elbow",
            "{Left}Wrist",
            "{Left}Hip",
            "{Left}Knee",
            "{Left}Ankle",
            "{Left}Toe",
        )
    ),
    "100STYLE": Convention(
        trunk("Hips", "Chest", "Chest2", "Chest4", "Neck", "Head")
        | limbs(
            "{Left}Collar",
            "{Left}Shoulder",
            "{Left}Elbow",
            "{Left}Wrist",
            "{Left}Hip",
            "{Left}Knee",
            "{Left}Ankle",
            "{Left}Toe",
        )
    ),
    "Bandai Namco": Convention(
        trunk("Hips", "Spine", "", "Chest", "Neck", "Head")
        | limbs(
            "Shoulder_{L}",
            "UpperArm_{L}",
            "LowerArm_{L}",
            "Hand_{L}",
            "UpperLeg_{L}",
            "LowerLeg_{L}",
            "Foot_{L}",
            "Toes_{L}",
        )
    ),
    "Character Creator": Convention(
        trunk(
            "CC_Base_Hip", "CC_Base_Waist", "CC_Base_Spine01", "CC_Base_Spine02", "CC_Base_NeckTwist01", "CC_Base_Head"
        )
        | limbs(
            "CC_Base_{L}_Clavicle",
            "CC_Base_{L}_Upperarm",
            "CC_Base_{L}_Forearm",
            "CC_Base_{L}_Hand",
            "CC_Base_{L}_Thigh",
            "CC_Base_{L}_Calf",
            "CC_Base_{L}_Foot",
            "CC_Base_{L}_ToeBase",
        )
        | digits("CC_Base_{L}_{digit}{n}", names=("Thumb", "Index", "Mid", "Ring", "Pinky"))
    ),
    "Rigify": Convention(
        trunk("hips", "spine", "chest", "chest.001", "neck", "head")
        | limbs(
            "shoulder.{L}", "upper_arm.{L}", "forearm.{L}", "hand.{L}", "thigh.{L}", "shin.{L}", "foot.{L}", "toe.{L}"
        )
        | digits("f_{digit}.0{n}.{L}", names=("thumb", "index", "middle", "ring", "pinky"), thumb="thumb.0{n}.{L}")
    ),
    "Rigify metarig": Convention(  # its neck and head are vertebrae by name
        trunk("spine", "spine.001", "spine.002", "spine.003", "spine.004", "spine.006")
        | limbs(
            "shoulder.{L}", "upper_arm.{L}", "forearm.{L}", "hand.{L}", "thigh.{L}", "shin.{L}", "foot.{L}", "toe.{L}"
        )
    ),
    "MikuMikuDance": Convention(
        trunk("下半身", "上半身", "", "上半身2", "首", "頭")
        | limbs("{左}肩", "{左}腕", "{左}ひじ", "{左}手首", "{左}足", "{左}ひざ", "{左}足首", "{左}つま先")
        | digits("{左}{digit}{n}", names=("親指", "人指", "中指", "薬指", "小指"))
    ),
}

TRUNK = {"pelvis": "pelvis", "head": "head"}
BONES = [
    *((a, b) for a, b in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))),
    ("index.base", "index.knuckle2"),
    ("index.knuckle2", "index.knuckle3"),
]


def play(folder: Path, recording: Recording) -> LoadedMotion:
    path = folder / "motion.bvh"
    path.write_text(recording.text)
    return load_motion(path, rig(body()))


def degrees(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    a, b = unit(a), unit(b)
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1)))


def limb_errors(moved: LoadedMotion, recording: Recording) -> dict[str, float]:
    """Widest angle [degrees] between a bone of the rig and the recorded one, over all frames."""
    names, places, out = body().names, moved.poses.positions, {}
    for side in ("left", "right"):
        for start, end in BONES:
            a, b = f"{side}.{start}", f"{side}.{end}"
            if a in recording.places and b in recording.places:
                own = places[:, names.index(b)] - places[:, names.index(a)]
                out[a] = float(degrees(own, recording.places[b] - recording.places[a]).max())
        a, b = f"{side}.ankle", f"{side}.ball"
        if b in recording.places:
            own = (places[:, names.index(b)] - places[:, names.index(a)])[0, [0, 2]]
            wanted = (recording.places[b] - recording.places[a])[0, [0, 2]]
            out[f"{a} heading"] = float(degrees(np.append(own, 0), np.append(wanted, 0)))
    return out


def trunk_errors(moved: LoadedMotion, recording: Recording) -> dict[str, float]:
    """Widest angle [degrees] between the rotation of a trunk joint of the rig from rest and the recorded one's."""
    names = body().names
    return {
        joint: float(
            np.degrees(
                (
                    Rotation.from_quat(moved.poses.rotations[:, names.index(joint)]) * recording.turns[joint].inv()
                ).magnitude()
            ).max()
        )
        for joint in ("pelvis", "spine3", "head")
    }


def assert_followed(moved: LoadedMotion, recording: Recording) -> None:
    errors = limb_errors(moved, recording) | trunk_errors(moved, recording)
    assert len(errors) >= 13
    assert {name: off for name, off in errors.items() if off > DIRECTIONS} == {}


@pytest.mark.parametrize("name", CONVENTIONS)
def test_every_convention_is_read_whole_and_followed(tmp_path: Path, name: str) -> None:
    recording = record(CONVENTIONS[name])
    moved = play(tmp_path, recording)
    marks = landmarks_of_clip(read_bvh(tmp_path / "motion.bvh"))
    clip = read_bvh(tmp_path / "motion.bvh")
    found = {joint: clip.names[j] for joint, j in marks.joints.items()}
    wanted = {joint: file for joint, file in recording.files.items() if "." in joint or joint == "head"}
    assert {joint: (found.get(joint), file) for joint, file in wanted.items() if found.get(joint) != file} == {}
    assert_followed(moved, recording)


VARIANTS: dict[str, dict[str, object]] = {
    "rest in A-pose": {"rest": "A"},
    "Z up": {"up": "z"},
    "Z up by the root": {"up": "root"},
    "inches": {"scale": 1 / 2.54},
    "bones along X": {"rest": "X"},
    "bones along X, Z up": {"rest": "X", "up": "z"},
    "bones along X, metres": {"rest": "X", "scale": 0.01},
    "bones along -X": {"rest": "-X"},
    "bones along Y": {"rest": "Y"},
    "bones along Z": {"rest": "Z"},
    "bones along X, against it on the right": {"rest": "mirrored X"},
    "no offsets": {"offsets": "zero"},
    "no offsets, bones along X": {"offsets": "zero", "rest": "X"},
    "offsets and positions": {"offsets": "both"},
    "positions added to offsets": {"offsets": "added"},
    "positions added to offsets along X": {"offsets": "added", "rest": "X"},
}


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("name", ["LAFAN1", pytest.param("MakeHuman", marks=pytest.mark.slow)])
def test_rest_axes_and_units_do_not_matter(tmp_path: Path, name: str, variant: str) -> None:
    recording = record(CONVENTIONS[name], **VARIANTS[variant])  # type: ignore[arg-type]
    assert_followed(play(tmp_path, recording), recording)


@pytest.mark.parametrize("heading", [140.0, -60.0])
@pytest.mark.parametrize("variant", ["bones along X", "bones along X, Z up", "Z up by the root", "no offsets"])
def test_headings_are_kept(tmp_path: Path, variant: str, heading: float) -> None:
    frames = tuple({**frame, "pelvis": (0.0, heading, 0.0)} for frame in FRAMES)
    recording = record(CONVENTIONS["LAFAN1"], frames=frames, **VARIANTS[variant])  # type: ignore[arg-type]
    assert_followed(play(tmp_path, recording), recording)


def test_the_frame_that_serves_as_rest_is_said_and_need_not_be_the_first(tmp_path: Path) -> None:
    recording = record(CONVENTIONS["LAFAN1"], rest="X", frames=FRAMES[::-1])
    moved = play(tmp_path, recording)
    assert_followed(moved, recording)
    assert any("its frame 2 is taken as the rest" in note for note in moved.notes)
    usual = play(tmp_path, record(CONVENTIONS["LAFAN1"]))
    assert not any("taken as the rest" in note for note in usual.notes)


def test_without_any_frame_of_somebody_standing_limbs_still_point_as_recorded(tmp_path: Path) -> None:
    recording = record(CONVENTIONS["LAFAN1"], rest="X", frames=FRAMES[1:])
    moved = play(tmp_path, recording)
    assert max(off for name, off in limb_errors(moved, recording).items() if "heading" not in name) < DIRECTIONS
    assert max(trunk_errors(moved, recording).values()) < 15


@pytest.mark.parametrize("rest", ["T", "X"])
def test_lying_down_and_standing_on_hands_stay_what_they_are(tmp_path: Path, rest: str) -> None:
    for turn in ((-90.0, 0.0, 0.0), (180.0, 0.0, 0.0)):
        frames = ({"pelvis": turn}, {}, *FRAMES[1:])
        recording = record(CONVENTIONS["LAFAN1"], rest=rest, frames=frames)
        assert_followed(play(tmp_path, recording), recording)
    lying = record(CONVENTIONS["LAFAN1"], frames=({"pelvis": (-90.0, 0.0, 0.0)},) * 2)
    moved = play(tmp_path, lying)
    assert_followed(moved, lying)
    assert any("it is taken to lie" in note for note in moved.notes)


def mirrored(recording: Recording) -> str:
    """The file with its x axis turned round, as programs do that take one handedness for the other: names stay."""
    lines, channels = recording.text.splitlines(), list[str]()
    start = lines.index("MOTION") + 3
    for k, line in enumerate(lines):
        words = line.split()
        if words[:1] == ["OFFSET"]:
            lines[k] = f"OFFSET {-float(words[1])} {words[2]} {words[3]}"
        elif words[:1] == ["CHANNELS"]:
            channels += words[2:]
        elif k >= start:
            signs = [-1 if c in ("Xposition", "Yrotation", "Zrotation") else 1 for c in channels]
            lines[k] = " ".join(str(sign * float(word)) for sign, word in zip(signs, words, strict=True))
    return "\n".join(lines)


@pytest.mark.parametrize("rest", ["T", "A", "X"])
@pytest.mark.parametrize("name", ["Mixamo", "Biped"])
def test_mirrored_figures_change_sides_and_bend_their_knees_forward(tmp_path: Path, name: str, rest: str) -> None:
    recording = record(CONVENTIONS[name], rest=rest)
    other = {"left": "right", "right": "left"}
    places = {".".join(other.get(p, p) for p in j.split(".")): at * [-1, 1, 1] for j, at in recording.places.items()}
    moved = play(tmp_path, replace(recording, text=mirrored(recording)))
    assert max(limb_errors(moved, replace(recording, places=places)).values()) < DIRECTIONS
    assert any("left and right" in line and "exchanged" in line for line in moved.warnings)
    assert not any("exchanged" in line for line in play(tmp_path, recording).warnings)


def on_the_floor(recording: Recording, up: str) -> Recording:
    """The same with the lowest joint at height 0."""
    low = min(float(places[:, 1].min()) for places in recording.places.values())
    head, time, rows = recording.text.partition("Frame Time: 0.0333333\n")
    lines = [row.split() for row in rows.splitlines()]
    for words in lines:
        words[1 if up == "y" else 2] = str(float(words[1 if up == "y" else 2]) - low)
    return replace(recording, text=head + time + "\n".join(map(" ".join, lines)) + "\n")


SEATED = {"left.hip": (-90, 0, 0), "right.hip": (-90, 0, 0), "left.knee": (90, 0, 0), "right.knee": (90, 0, 0)}
NEVER_STANDING = {
    "sitting": (SEATED, SEATED | {"left.shoulder": (0, 0, -60)}),
    "lying": ({"pelvis": (-90, 0, 0)}, {"pelvis": (-90, 0, 0), "left.hip": (-40, 0, 0)}),
    "on the hands": (
        {"pelvis": (180, 0, 0), "left.shoulder": (0, 0, 80), "right.shoulder": (0, 0, -80)},
        {"pelvis": (180, 0, 0), "left.shoulder": (0, 0, 80), "right.shoulder": (0, 0, -80), "left.knee": (50, 0, 0)},
    ),
}


@pytest.mark.parametrize(
    ("posture", "up"),
    [("sitting", "y"), ("sitting", "z"), ("lying", "y"), ("on the hands", "y"), ("on the hands", "z")],
)
@pytest.mark.parametrize("how", [{"rest": "X"}, {"rest": "mirrored X"}, {"offsets": "zero"}])
def test_who_never_stands_and_whose_rest_tells_nothing(tmp_path: Path, posture: str, up: str, how: dict) -> None:
    """Of a sitting figure the trunk tells what is up; whether one stands along another axis, the floor tells."""
    recording = on_the_floor(record(CONVENTIONS["LAFAN1"], frames=NEVER_STANDING[posture], up=up, **how), up)
    moved = play(tmp_path, recording)
    assert_followed(moved, recording)
    assert any("taken not to stand" in note for note in moved.notes) == (posture != "sitting")


SAYINGS = {
    "lShldr": ("left", "shoulder"),
    "rForeArm": ("right", "forearm"),
    "LHipJoint": ("left", "hip"),
    "lfemur": ("left", "thigh"),
    "rtibia": ("right", "shin"),
    "rhand": ("right", "hand"),
    "Skeleton_RFArm": ("right", "forearm"),
    "LUArm": ("left", "upperarm"),
    "hip": (None, "pelvis"),
    "LeftHip": ("left", "hip"),
    "L5": (None, "spine"),
    "LeftFootIndex1": ("left", "toe"),
    "lowerback": (None, "spine"),
    "CC_Base_NeckTwist01": (None, "neck"),
    "CC_Base_L_CalfTwist01": ("left", "helper"),
    "wrist_outer_l": ("left", "helper"),
    # no sides
    "leg": (None, "shin"),
    "lowerarm": (None, "forearm"),
    "lowerleg": (None, "shin"),
    "lip": (None, None),
    "lowerlip": (None, None),
    "radius": (None, "forearm"),
    "root": (None, "root"),
    "ring": (None, "digit"),
    "little": (None, "digit"),
    "rotate": (None, None),
    "rib": (None, None),
    "lens": (None, None),
    "roll": (None, "helper"),
}


@pytest.mark.parametrize("name", SAYINGS)
def test_single_letters_are_sides_only_before_a_part_of_the_body(name: str) -> None:
    meaning = read_name(name)
    assert (meaning.side, meaning.kind) == SAYINGS[name]
