"""Translation of MikuMikuDance's Japanese joint names, such as ``左ひじ`` and ``右人指１``, to English."""

from __future__ import annotations

import re
import unicodedata

__all__ = ["in_english"]

_WORDS = {
    "左": "left",
    "右": "right",
    "全ての親": "root",
    "センター": "root",
    "グルーブ": "root",
    "下半身": "pelvis",
    "上半身": "spine",
    "首": "neck",
    "頭": "head",
    "肩": "shoulder",
    "腕": "arm",
    "ひじ": "elbow",
    "肘": "elbow",
    "手首": "wrist",
    "足": "thigh",
    "ひざ": "knee",
    "膝": "knee",
    "足首": "ankle",
    "つま先": "toe",
    "足先": "toe",
    "親指": "thumb",
    "人指": "index",
    "人差指": "index",
    "人差し指": "index",
    "中指": "middle",
    "薬指": "ring",
    "小指": "pinky",
    "捩": "twist",
    "捩り": "twist",
    "ダミー": "helper",
    "先": "end",
}
_LONG_FIRST = re.compile("|".join(sorted(_WORDS, key=len, reverse=True)))


def in_english(name: str) -> str:
    """A joint name with its Japanese words translated and full-width characters normalised (NFKC)."""
    if name.isascii():
        return name
    return _LONG_FIRST.sub(lambda word: f" {_WORDS[word[0]]} ", unicodedata.normalize("NFKC", name))
