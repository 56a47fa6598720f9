"""Binding of an actor's surface to its skeleton, reused until skeleton, method or domains change."""

from __future__ import annotations

from typing import TYPE_CHECKING

from warpjld.script.scene import Actor

if TYPE_CHECKING:
    from warpjld.covering import Covering

__all__ = ["cover"]


def cover(actor: Actor) -> Covering:
    """Covering of an actor with its present parameters, method and domains."""
    from warpjld.covering.kept import bind_kept

    old = actor.covering
    if old is not None and old.skeleton is actor.skeleton and actor.covered == (actor.method, actor.domains):
        if old.parameters is not actor.parameters:
            actor.covering = old.with_parameters(actor.parameters)
    else:
        actor.covering, _ = bind_kept(
            actor.rig,
            skeleton=actor.skeleton,
            parameters=actor.parameters,
            domains=actor.domains,
            method=actor.method,
        )
        actor.covered = (actor.method, actor.domains)
    assert actor.covering is not None
    return actor.covering
