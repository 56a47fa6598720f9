"""The animations of a glTF file by name; several with one node each, as some exporters write them, count as one."""

from __future__ import annotations

import re
from typing import Any

from warpjld.io.gltf.document import Document
from warpjld.io.unique_names import unique_names

__all__ = ["list_animations"]


def list_animations(document: Document) -> dict[str, list[int]]:
    """Animations by name, in the file's order, each as the indices of those that are played together.

    Unnamed ones are called ``animation 0`` …; duplicate names get ``#2`` … appended.
    """
    animations = document.gltf.animations or []
    if _one_per_node(document, animations):
        stem = _stem(animations[0].name or "")
        common = stem if all(_stem(a.name or "") == stem for a in animations) else ""
        return {common or "animation 0": list(range(len(animations)))}
    names = unique_names([a.name or f"animation {n}" for n, a in enumerate(animations)])
    return {name: [n] for n, name in enumerate(names)}


def _one_per_node(document: Document, animations: list[Any]) -> bool:
    """Whether each of several animations moves a different node, and their names differ by that node only."""
    if len(animations) < 2:
        return False
    moved = [{c.target.node for c in a.channels if c.target.node is not None} for a in animations]
    if any(len(nodes) != 1 for nodes in moved) or len(set.union(*moved)) < len(animations):
        return False
    owners = [document.name(nodes.pop()).lower() for nodes in moved]
    names = [(a.name or "").lower() for a in animations]
    told = [name.replace(owner, "") if owner in name else name for name, owner in zip(names, owners, strict=True)]
    return len({_stem(name) for name in told}) == 1


def _stem(name: str) -> str:
    """A name without its trailing number, as in ``Action.003``."""
    return re.sub(r"[\s._#-]*\d+$", "", name)
