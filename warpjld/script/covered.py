"""An actor's surface bound to its skeleton."""

from __future__ import annotations

from typing import TYPE_CHECKING

from warpjld.script.scene import Actor

if TYPE_CHECKING:
    from warpjld.covering import Covering

__all__ = ["cover"]


def cover(actor: Actor) -> Covering:
    """Bind with the actor's parameters, method and domains."""
    from warpjld.covering import bind

    rig = actor.rig
    return bind(
        actor.skeleton, rig.surface, parameters=actor.parameters, skin=rig.skin, domains=actor.domains
    )
