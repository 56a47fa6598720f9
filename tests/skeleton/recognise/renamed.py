"""Real rigs under the names of other conventions, for tests of recognition."""

from __future__ import annotations

from collections.abc import Mapping

from warpjld.skeleton.recognise.tree import SourceTree

DIGITS = ("thumb", "index", "middle", "ring", "pinky")
KNUCKLES = ("base", "knuckle2", "knuckle3", "tip")

# canonical part → name; {s} is the side's word, {n} and {d} number and word of a spine joint or digit, {k} the place
# of a joint in its digit; parts a convention lacks are left out and keep a name that means nothing
CONVENTIONS: dict[str, dict[str, str | tuple[str, str]]] = {
    "Mixamo": {
        "sides": ("Left", "Right"),
        "pelvis": "mixamorig:Hips", "spine": "mixamorig:Spine{n}", "neck": "mixamorig:Neck{n}",
        "head": "mixamorig:Head",
        "clavicle": "mixamorig:{s}Shoulder", "shoulder": "mixamorig:{s}Arm", "elbow": "mixamorig:{s}ForeArm",
        "wrist": "mixamorig:{s}Hand", "hip": "mixamorig:{s}UpLeg", "knee": "mixamorig:{s}Leg",
        "ankle": "mixamorig:{s}Foot", "ball": "mixamorig:{s}ToeBase", "digit": "mixamorig:{s}Hand{D}{k}",
    },
    "Unreal": {
        "sides": ("l", "r"),
        "pelvis": "pelvis", "spine": "spine_0{n}", "neck": "neck_0{n}", "head": "head", "clavicle": "clavicle_{s}",
        "shoulder": "upperarm_{s}", "elbow": "lowerarm_{s}", "wrist": "hand_{s}", "hip": "thigh_{s}",
        "knee": "calf_{s}", "ankle": "foot_{s}", "ball": "ball_{s}", "carpometacarpal": "{d}_metacarpal_{s}",
        "digit": "{d}_0{k}_{s}",
    },
    "Biped": {
        "sides": ("L", "R"),
        "pelvis": "Bip01 Pelvis", "spine": "Bip01 Spine{n}", "neck": "Bip01 Neck{n}", "head": "Bip01 Head",
        "clavicle": "Bip01 {s} Clavicle", "shoulder": "Bip01 {s} UpperArm", "elbow": "Bip01 {s} Forearm",
        "wrist": "Bip01 {s} Hand", "hip": "Bip01 {s} Thigh", "knee": "Bip01 {s} Calf", "ankle": "Bip01 {s} Foot",
        "digit": "Bip01 {s} Finger{n}{k0}",
    },
    "DAZ": {
        "sides": ("l", "r"),
        "pelvis": "pelvis", "spine": "abdomen{n}", "neck": "neck{n}", "head": "head", "clavicle": "{s}Collar",
        "shoulder": "{s}ShldrBend", "elbow": "{s}ForearmBend", "wrist": "{s}Hand", "hip": "{s}ThighBend",
        "knee": "{s}Shin", "ankle": "{s}Foot", "carpometacarpal": "{s}Carpal{n}", "digit": "{s}{Dz}{k}",
    },
    "MakeHuman": {
        "sides": ("L", "R"),
        "spine": "spine0{n}", "neck": "neck0{n}", "head": "head", "clavicle": "clavicle.{s}",
        "shoulder": "upperarm01.{s}", "elbow": "lowerarm01.{s}", "wrist": "wrist.{s}", "hip": "upperleg01.{s}",
        "knee": "lowerleg01.{s}", "ankle": "foot.{s}", "carpometacarpal": "metacarpal{n}.{s}",
        "digit": "finger{n1}-{k}.{s}",
    },
    "Rigify": {
        "sides": ("L", "R"),
        "pelvis": "DEF-pelvis", "spine": "DEF-spine.00{n}", "neck": "DEF-neck.00{n}", "head": "DEF-head",
        "clavicle": "DEF-shoulder.{s}", "shoulder": "DEF-upper_arm.{s}", "elbow": "DEF-forearm.{s}",
        "wrist": "DEF-hand.{s}", "hip": "DEF-thigh.{s}", "knee": "DEF-shin.{s}", "ankle": "DEF-foot.{s}",
        "ball": "DEF-toe.{s}", "carpometacarpal": "DEF-palm.0{n}.{s}", "digit": "DEF-{f}{d}.0{k}.{s}",
    },
    "LAFAN": {
        "sides": ("Left", "Right"),
        "pelvis": "Hips", "spine": "Spine{n}", "neck": "Neck{n}", "head": "Head", "clavicle": "{s}Shoulder",
        "shoulder": "{s}Arm", "elbow": "{s}ForeArm", "wrist": "{s}Hand", "hip": "{s}UpLeg", "knee": "{s}Leg",
        "ankle": "{s}Foot", "ball": "{s}Toe",
    },
    "leg and shin": {
        "sides": ("Left", "Right"),
        "pelvis": "Hips", "spine": "Spine{n}", "neck": "Neck{n}", "head": "Head", "clavicle": "{s}Shoulder",
        "shoulder": "{s}Arm", "elbow": "{s}ForeArm", "wrist": "{s}Hand", "hip": "{s}Leg", "knee": "{s}Shin",
        "ankle": "{s}Foot", "ball": "{s}Toe",
    },
    "leg 1 and 2": {
        "sides": ("L", "R"),
        "pelvis": "pelvis", "spine": "spine{n}", "neck": "neck{n}", "head": "head",
        "shoulder": "arm1_{s}", "elbow": "arm2_{s}", "wrist": "hand_{s}", "hip": "leg1_{s}", "knee": "leg2_{s}",
        "ankle": "foot_{s}",
    },
    "hip, knee, ankle": {
        "sides": ("left", "right"),
        "pelvis": "pelvis", "spine": "spine{n}", "neck": "neck{n}", "head": "head", "clavicle": "{s}_collar",
        "shoulder": "{s}_shoulder", "elbow": "{s}_elbow", "wrist": "{s}_wrist", "hip": "{s}_hip", "knee": "{s}_knee",
        "ankle": "{s}_ankle", "ball": "{s}_foot",
    },
    "hands and feet only": {
        "sides": ("left", "right"),
        "pelvis": "pelvis", "spine": "spine{n}", "neck": "neck{n}", "head": "head",
        "wrist": "{s}_wrist", "ankle": "{s}_ankle",
    },
    "numbers": {"sides": ("", "")},
}  # fmt: skip


def rename(tree: SourceTree, canonical: Mapping[int, str], convention: str) -> SourceTree:
    """The tree in a convention's names; joints it has none for are called ``bone_001`` and so on.

    Args:
        tree: The file's joints.
        canonical: What each recognised joint is.
        convention: One of ``CONVENTIONS``.
    """
    names = []
    for j in range(len(tree)):
        name = canonical.get(j)
        words = None if name is None else _words(name, convention)
        names.append(words or f"bone_{j:03d}")
    return SourceTree(tuple(names), tree.parents, tree.frames)


def _words(name: str, convention: str) -> str | None:
    table = CONVENTIONS[convention]
    side, _, part = name.partition(".") if name.startswith(("left.", "right.")) else ("", "", name)
    word = table["sides"][0 if side == "left" else 1]
    key = part.rstrip("0123456789")
    values = {"s": word, "n": part[len(key) :]}
    digit, _, joint = part.partition(".")
    if digit in DIGITS:
        n = DIGITS.index(digit)
        k = KNUCKLES.index(joint) + 1 if joint in KNUCKLES else 0
        dz = {"middle": "Mid"}.get(digit, digit.title())
        values = {"s": word, "d": digit, "D": digit.title(), "Dz": dz, "f": "" if digit == "thumb" else "f_"}
        values |= {"n": str(n), "n1": str(n + 1), "k": str(k), "k0": str(k - 1) if k > 1 else ""}
        key = "digit"
        if joint == "carpometacarpal":
            key = joint
    pattern = table.get(key)
    return None if pattern is None else str(pattern).format(**values)
