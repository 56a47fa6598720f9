"""Words in joint names of the common conventions, and what they mean.

WebXR ``index-finger-phalanx-proximal``, SMPL-X ``left_index1``, MakeHuman and Anny ``finger2-1.L``, Mixamo
``mixamorig:LeftHandIndex1``, Leap ``L_index_a``, Godot and VRM ``LeftIndexProximal`` ``J_Bip_L_Index1``, OpenXR
``Index_Proximal_L``, Unreal ``index_01_l``, Rigify ``f_index.01.L``: all are a side, a few words and a number, so one
vocabulary reads them all.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

__all__ = ["Meaning", "read_name"]

_SIDES = {"left": "left", "l": "left", "lt": "left", "lft": "left"} | {
    "right": "right",
    "r": "right",
    "rt": "right",
    "rgt": "right",
}
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
    "thigh": "thigh",
    "upperleg": "thigh",
    "upleg": "thigh",
    "femur": "thigh",
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
    "spine": "spine",
    "chest": "spine",
    "upperchest": "spine",
    "abdomen": "spine",
    "torso": "spine",
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
}
_FILLERS = {"finger", "fingers", "knuckle", "phalanx", "joint", "bone", "def", "org", "bip", "mixamorig"}
_COMPOUNDS = {
    ("upper", "arm"),
    ("lower", "arm"),
    ("fore", "arm"),
    ("up", "arm"),
    ("upper", "leg"),
    ("lower", "leg"),
    ("up", "leg"),
    ("low", "leg"),
    ("upper", "chest"),
    ("toe", "base"),
}
_LONG_FIRST = sorted(
    {w for words in (_SIDES, _DIGITS, _RANKS, _KINDS, _HELPERS, _FILLERS) for w in words if len(w) > 2},
    key=len,
    reverse=True,
)


@dataclass(frozen=True)
class Meaning:
    """What a joint's name says.

    Attributes:
        side: ``left``, ``right`` or None.
        kind: ``digit``, ``carpal`` (a palm bone whose digit the name does not tell), ``toe``, ``wrist``, ``hand``,
            ``forearm``, …; ``helper`` for twist bones and controls; None where the name says nothing.
        digit: Digit, for kind ``digit``.
        rank: 0 metacarpal, 1 proximal, 2 intermediate, 3 distal, 4 tip, where a word says so.
        number: Number in the name, where there is one.
    """

    side: str | None = None
    kind: str | None = None
    digit: str | None = None
    rank: int | None = None
    number: int | None = None


@cache
def read_name(name: str) -> Meaning:
    """Meaning of a joint name in any of the known conventions; an empty :class:`Meaning` for any other."""
    words = _words(name)
    side = next((_SIDES[w] for w in words if w in _SIDES), None)
    numbers = [int(w) for w in words if w.isdigit()]
    number = numbers[-1] if numbers else None
    if any(w in _HELPERS for w in words):
        return Meaning(side, "helper")
    kinds = [_KINDS[w] for w in words if w in _KINDS]
    if "toe" in kinds:
        return Meaning(side, "toe", rank=_rank(words), number=numbers[0] if numbers else None)
    digit = next((_DIGITS[w] for w in words if w in _DIGITS), None)
    if digit is None and "finger" in words:
        digit, number = _numbered([w for w in words[words.index("finger") :] if w.isdigit()])
    if digit is not None:
        return Meaning(side, "digit", digit, _rank(words), number)
    if any(w in ("metacarpal", "carpal") for w in words) or ("palm" in words and numbers):
        return Meaning(side, "carpal", rank=0, number=number)
    if kinds:
        end = " end" if _rank(words) == 4 else ""
        return Meaning(side, kinds[-1] + end, number=number)
    return Meaning(side, "palm" if "palm" in words else None, number=number)


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
    """``finger2-1`` counts the thumb as 1 (MakeHuman); ``Finger0``, ``Finger01`` as 0 (Biped)."""
    if len(numbers) >= 2 and 1 <= int(numbers[0]) <= 5:
        return _NUMBERED_DIGITS[int(numbers[0]) - 1], int(numbers[1])
    if len(numbers) == 1 and len(numbers[0]) <= 2 and int(numbers[0][0]) <= 4:
        return _NUMBERED_DIGITS[int(numbers[0][0])], int(numbers[0][1:] or 0)
    return None, None


def _words(name: str) -> list[str]:
    name = name.rsplit(":", 1)[-1]
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
    """Words run together, as in ``lefthandindex``; the piece itself where it is not made of known words."""
    if piece in _KINDS or piece in _DIGITS or piece in _SIDES or len(piece) < 5:
        return [piece]
    rest, out = piece, []
    while rest:
        word = next((w for w in _LONG_FIRST if rest.startswith(w)), None)
        if word is None:
            return [piece]
        out.append(word)
        rest = rest[len(word) :]
    return out
