"""Parser of joint names in the common conventions.

WebXR ``index-finger-phalanx-proximal``, SMPL-X ``left_index1``, MakeHuman and Anny ``finger2-1.L``, Mixamo
``mixamorig:LeftHandIndex1``, Leap ``L_index_a``, Godot and VRM ``LeftIndexProximal`` ``J_Bip_L_Index1``, OpenXR
``Index_Proximal_L``, Unreal ``index_01_l``, Rigify ``f_index.01.L``, Poser and DAZ ``lIndex1``, Rokoko
``LeftFinger2Proximal``, Xsens ``LeftSecondPP``, Perception Neuron and HumanIK ``LeftInHandIndex``, Biped
``Bip01 L Finger1``, OptiTrack ``LUArm``, CMU ``lhumerus``, Kinect ``ElbowLeft``, MikuMikuDance ``左ひじ``: all consist
of a side, a few words and a number, so one vocabulary reads them all.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

from warpjld.skeleton.recognise.names_japanese import in_english

__all__ = ["Meaning", "read_name"]

_SIDES = dict.fromkeys(("left", "l", "lt", "lft"), "left") | dict.fromkeys(("right", "r", "rt", "rgt"), "right")
_DIGITS = {
    "thumb": "thumb",
    "index": "index",
    "pointer": "index",
    "middle": "middle",
    "mid": "middle",
    "ring": "ring",
    "pinky": "pinky",
    "pinkie": "pinky",
    "little": "pinky",
    "small": "pinky",
}
_ORDINALS = {"first": "thumb", "second": "index", "third": "middle", "fourth": "ring", "fifth": "pinky"}
"""Xsens digits, before a phalanx: ``FirstMC``, ``SecondPP``."""
_PHALANGES = {"mc": 0, "pp": 1, "mp": 2, "dp": 3}
_NUMBERED_DIGITS = ("thumb", "index", "middle", "ring", "pinky")
_RANKS = {
    "metacarpal": 0,
    "carpometacarpal": 0,
    "metacarpus": 0,
    "meta": 0,
    "palm": 0,
    "carpal": 0,
    "proximal": 1,
    "base": 1,
    "intermediate": 2,
    "medial": 2,
    "distal": 3,
    "tip": 4,
    "end": 4,
    "nub": 4,
    "null": 4,
    "top": 4,
}
_NAMED_RANKS = ("metacarpal", "proximal", "intermediate", "medial", "distal", "tip")
_LETTERS = {"a": 1, "b": 2, "c": 3}
_KINDS = {
    "wrist": "wrist",
    "hand": "hand",
    "forearm": "forearm",
    "lowerarm": "forearm",
    "elbow": "forearm",
    "upperarm": "upperarm",
    "uparm": "upperarm",
    "arm": "upperarm",
    "shoulder": "shoulder",
    "scapula": "scapula",
    "clavicle": "clavicle",
    "collar": "clavicle",
    "collarbone": "clavicle",
    "clav": "clavicle",
    "shldr": "shoulder",
    "humerus": "upperarm",
    "radius": "forearm",
    "ulna": "forearm",
    "uarm": "upperarm",
    "farm": "forearm",
    "thigh": "thigh",
    "upperleg": "thigh",
    "upleg": "thigh",
    "femur": "thigh",
    "tibia": "shin",
    "hip": "hip",
    "hips": "pelvis",
    "pelvis": "pelvis",
    "shin": "shin",
    "calf": "shin",
    "lowerleg": "shin",
    "lowleg": "shin",
    "leg": "shin",
    "knee": "shin",
    "ankle": "ankle",
    "foot": "foot",
    "ball": "ball",
    "toe": "toe",
    "toes": "toe",
    "toebase": "toe",
    "bigtoe": "toe",
    "spine": "spine",
    "chest": "spine",
    "upperchest": "spine",
    "abdomen": "spine",
    "torso": "spine",
    "thorax": "spine",
    "waist": "spine",
    "ab": "spine",
    "lowerback": "spine",
    "upperback": "spine",
    "lowerneck": "neck",
    "upperneck": "neck",
    "neck": "neck",
    "head": "head",
    "root": "root",
    "armature": "root",
}
_HELPERS = {
    "twist",
    "roll",
    "helper",
    "ik",
    "pole",
    "ctrl",
    "target",
    "corrective",
    "volume",
    "ignore",
    "stub",
    "grip",
    "share",
    "inner",
    "outer",
    "bicep",
    "tricep",
    "pec",
    "fwd",
    "bck",
    "footsteps",
}
_FILLERS = {"finger", "fingers", "knuckle", "phalanx", "joint", "bone", "def", "org", "bip", "mixamorig", "bend", "big"}
_VERTEBRAE = ("L5", "L3", "T12", "T8")
"""Xsens names of spine segments; ``L`` is not a side here."""
_NOT_SIDED = {"root", "armature", "pelvis", "hips", "head", "neck", "spine", "chest", "upperchest", "torso", "ab"}
_COMPOUNDS = {
    ("upper", "arm"),
    ("lower", "arm"),
    ("fore", "arm"),
    ("up", "arm"),
    ("upper", "leg"),
    ("lower", "leg"),
    ("up", "leg"),
    ("low", "leg"),
    ("u", "arm"),
    ("f", "arm"),
    ("lower", "back"),
    ("upper", "back"),
    ("lower", "neck"),
    ("upper", "neck"),
    ("upper", "chest"),
    ("toe", "base"),
}
_LONG_FIRST = sorted(
    {w for words in (_SIDES, _DIGITS, _RANKS, _KINDS, _HELPERS, _FILLERS) for w in words if len(w) > 2},
    key=len,
    reverse=True,
)
_WORDS = {*_SIDES, *_DIGITS, *_RANKS, *_KINDS, *_HELPERS, *_FILLERS}
_SIDED = {*_DIGITS, *_KINDS, "fingers", "metacarpal", "carpal", "palm"} - _NOT_SIDED
"""Words before which a lower-case ``l`` or ``r`` is a side (``lfemur``)."""
_CAPITALS = re.compile(r"(^|_)[LR][UF]Arm$")
"""OptiTrack's ``LUArm``: consecutive capitals would otherwise be read as one word."""


@dataclass(frozen=True)
class Meaning:
    """A parsed joint name.

    Attributes:
        side: ``left``, ``right`` or None.
        kind: ``digit``, ``carpal`` (a palm bone of unstated digit), ``toe``, ``wrist``, ``hand``, ``forearm``, …;
            ``helper`` for twist bones and controls; None if the name is not understood.
        digit: Digit, for kind ``digit``.
        rank: 0 metacarpal, 1 proximal, 2 intermediate, 3 distal, 4 tip; None if no word states it.
        number: Number in the name, if any.
    """

    side: str | None = None
    kind: str | None = None
    digit: str | None = None
    rank: int | None = None
    number: int | None = None


@cache
def read_name(name: str) -> Meaning:
    """Meaning of a joint name in any of the known conventions; an empty :class:`Meaning` for any other."""
    if name.rsplit(":", 1)[-1] in _VERTEBRAE:
        return Meaning(None, "spine", number=int(re.findall(r"\d+", name)[-1]))
    words = _words(name)
    side = next((_SIDES[w] for w in words if w in _SIDES), None)
    numbers = [int(w) for w in words if w.isdigit()]
    number = numbers[-1] if numbers else None
    kinds = [_KINDS[w] for w in words if w in _KINDS]
    if any(w in _HELPERS for w in words) and not ("twist" in words and kinds in (["neck"], ["spine"])):
        return Meaning(side, "helper")
    if "toe" in kinds:
        return Meaning(side, "toe", rank=_rank(words), number=numbers[0] if numbers else None)
    digit, rank, number = _digit(words, number)
    if digit is not None and "foot" in words:  # HumanIK's LeftFootIndex1, LeftInFootThumb
        return Meaning(side, "toe", rank=rank, number=_NUMBERED_DIGITS.index(digit) + 1)
    if digit is not None:
        return Meaning(side, "digit", digit, rank, number)
    if any(w in ("metacarpal", "carpal") for w in words) or ("palm" in words and numbers):
        return Meaning(side, "carpal", rank=0, number=number)
    if kinds:
        kind = "spine" if side is None and "spine" in kinds else kinds[-1]  # Kinect's SpineShoulder
        end = " end" if _rank(words) == 4 else ""
        return Meaning(side, ("pelvis" if (side, kind) == (None, "hip") else kind) + end, number=number)
    return Meaning(side, "palm" if "palm" in words else None, number=number)


def _digit(words: list[str], number: int | None) -> tuple[str | None, int | None, int | None]:
    """Digit, rank and number of a joint of a finger."""
    rank = _rank(words)
    for ordinal, phalanx in pairwise(words):
        if ordinal in _ORDINALS and phalanx in _PHALANGES:
            return _ORDINALS[ordinal], _PHALANGES[phalanx], number
    digit = next((_DIGITS[w] for w in words if w in _DIGITS), None)
    if digit is not None:
        inside = any(pair == ("in", "hand") for pair in pairwise(words))
        return digit, 0 if inside else rank, number
    if "finger" in words and "extra" not in words:
        counts = [w for w in words[words.index("finger") :] if w.isdigit()]
        if len(counts) == 1 and 1 <= int(counts[0]) <= 5 and any(w in _NAMED_RANKS for w in words):
            return _NUMBERED_DIGITS[int(counts[0]) - 1], rank, None  # Rokoko's LeftFinger1Proximal is the thumb
        return _numbered(counts)[0], rank, _numbered(counts)[1]
    return None, rank, number


def _rank(words: list[str]) -> int | None:
    for i, word in enumerate(words):
        if word in _RANKS:
            return _RANKS[word]
        if word in _LETTERS and i and words[i - 1] in _DIGITS:
            return _LETTERS[word]
        if word == "knuckle" and words[i + 1 : i + 2] in (["2"], ["3"]):
            return int(words[i + 1])
    return None


def _numbered(numbers: list[str]) -> tuple[str | None, int | None]:
    """Digit and number: ``finger2-1`` counts the thumb as 1 (MakeHuman), ``Finger0`` and ``Finger01`` as 0 (Biped)."""
    if len(numbers) >= 2 and 1 <= int(numbers[0]) <= 5:
        return _NUMBERED_DIGITS[int(numbers[0]) - 1], int(numbers[1])
    if len(numbers) == 1 and len(numbers[0]) <= 2 and int(numbers[0][0]) <= 4:
        return _NUMBERED_DIGITS[int(numbers[0][0])], int(numbers[0][1:] or 0)
    return None, None


def _words(name: str) -> list[str]:
    name = re.sub(r"^CC_Base_", "", in_english(name.rsplit(":", 1)[-1]))
    name = re.sub(r"^([LR])([UF]Arm)$", r"\1_\2", name.rsplit("_", 1)[-1]) if _CAPITALS.search(name) else name
    pieces = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)
    words: list[str] = []
    for piece in (p.lower() for p in pieces):
        words.extend(_split(piece))
    joined: list[str] = []
    for word in words:
        if joined and (joined[-1], word) in _COMPOUNDS:
            joined[-1] += word
        else:
            joined.append(word)
    return joined


def _split(piece: str) -> list[str]:
    """Split concatenated words as in ``lefthandindex`` or ``lfemur``; the piece itself unless all are known."""
    if piece in _WORDS or len(piece) < 4:
        return [piece]
    found = _known(piece)
    if not found and piece[0] in "lr":
        found = _known(piece[1:])
        found = [piece[0], *found] if found and found[0] in _SIDED else []
    return found or [piece]


def _known(piece: str) -> list[str]:
    """Greedy split of a piece into known words, longest first; empty unless it is used up."""
    out = []
    while piece:
        word = next((w for w in _LONG_FIRST if piece.startswith(w)), None)
        if word is None:
            return []
        out.append(word)
        piece = piece[len(word) :]
    return out
