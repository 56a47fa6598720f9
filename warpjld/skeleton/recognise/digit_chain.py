"""Selection of one digit's joint chain among all joints named after it: helpers and duplicates are left out."""

from __future__ import annotations

import re
from collections.abc import Sequence

from warpjld.skeleton.recognise.digits import Digit
from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.names import Meaning
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["digit_chain"]


def digit_chain(
    tree: SourceTree, joints: Sequence[int], meanings: Sequence[Meaning], flesh: JointFlesh, wrist: int | None
) -> Digit | None:
    """The joints that form one digit, from the root outwards; None where they form no chain.

    Args:
        tree: The file's joints.
        joints: Joints named after the digit, in any order.
        meanings: Parsed names of all joints of the file.
        flesh: Which joints own skin.
        wrist: The hand's wrist, if known.
    """
    chain = sorted(joints, key=lambda j: _sort_key(tree, meanings[j], j))
    if not tree.flat:
        chain = _longest_chain(tree, chain)
    ranks = [meanings[j].rank for j in chain]
    if flesh.known:
        chain, ranks = _without_helpers(tree, chain, meanings, flesh)
    if not chain or (len(chain) == 1 and (wrist is None or flesh.bare[chain[0]])):
        return None
    return Digit(chain, ranks)


def _sort_key(tree: SourceTree, meaning: Meaning, joint: int) -> tuple[int, int, int, int]:
    """Sort key: depth, then rank (metacarpal, 01, 02, tip), then number, then index."""
    return tree.depth(joint), *_rank_key(meaning), joint


def _rank_key(meaning: Meaning) -> tuple[int, int]:
    number = meaning.number or 0
    return (number if meaning.rank is None else meaning.rank), number


def _longest_chain(tree: SourceTree, chain: list[int]) -> list[int]:
    """The longest chain of ancestors and descendants among joints sorted by depth."""
    best: dict[int, list[int]] = {}
    for j in chain:
        above = next((a for a in tree.ancestors(j) if a in best), None)
        best[j] = [*(best[above] if above is not None else []), j]
    longest = max(best.values(), key=len, default=[])
    # in a partly flat file, where no two joints are related, all of them form the digit
    return longest if len(longest) > 1 else chain


def _without_helpers(
    tree: SourceTree, chain: list[int], meanings: Sequence[Meaning], flesh: JointFlesh
) -> tuple[list[int], list[int | None]]:
    """Leave out joints without skin, but for those whose name fills a gap in the sequence and one as the end."""
    bare, fleshy = flesh.bare, [j for j in chain if not flesh.bare[j]]
    if not fleshy:
        return chain, [meanings[j].rank for j in chain]
    last = chain.index(fleshy[-1]) if not tree.flat else _last_by_rank(chain, meanings, fleshy)
    stems = {_stem(tree.names[j]) for j in fleshy}
    taken = {meanings[j].rank for j in fleshy}
    inner: list[int] = []
    beyond: list[int] = []
    for k, j in enumerate(chain):
        rank = meanings[j].rank
        if not bare[j]:
            inner.append(j)
        elif k > last or (tree.flat and rank == 4):
            beyond.append(j)
        elif _stem(tree.names[j]) in stems or (rank in (0, 1, 2, 3) and rank not in taken):
            taken.add(rank)
            inner.append(j)
    ranks = [meanings[j].rank for j in inner]
    # the shortest name: index-finger-tip before index-finger-tip_null
    end = min(beyond, key=lambda j: (meanings[j].rank != 4, len(tree.names[j])), default=None)
    return (inner, ranks) if end is None else ([*inner, end], [*ranks, 4])


def _last_by_rank(chain: list[int], meanings: Sequence[Meaning], fleshy: list[int]) -> int:
    order = [_rank_key(meanings[j]) for j in chain]
    return max(k for k, at in enumerate(order) if at <= max(order[chain.index(j)] for j in fleshy))


def _stem(name: str) -> str:
    """A name with its numbers replaced: shared by joints of one digit that are only numbered."""
    return re.sub(r"\d+", "#", name.lower())
