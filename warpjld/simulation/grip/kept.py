"""Conversion of grip results to plain values for a checkpoint, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

from warpjld.errors import InputError
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.grip.found import FoundGrip, SupportRelease
from warpjld.simulation.specification import ContactSpecification

__all__ = ["grip_content", "restored_grip"]

_APART = ("request", "over")
"""Fields that are kept elsewhere: the request in the specification, arrays in the checkpoint's own."""


def grip_content(found: FoundGrip) -> dict[str, Any]:
    """A grip result as plain values; its specification is identified by the first frame."""
    content = {one.name: getattr(found, one.name) for one in fields(found) if one.name not in _APART}
    release = None if found.release is None else asdict(found.release)
    edits = [asdict(edit) for edit in found.edits]
    return content | {"first": found.request.first, "edits": edits, "release": release, "digits": dict(found.digits)}


def restored_grip(content: Mapping[str, Any], contact: ContactSpecification) -> FoundGrip:
    """Grip result from the values of ``grip_content``.

    Raises:
        InputError: The specification has no grip that begins at that frame.
    """
    request = next((grip for grip in contact.grips if grip.first == content["first"]), None)
    if request is None:
        raise InputError(f"it holds a grip at frame {content['first']}, which is not in the specification")
    rest = {name: value for name, value in content.items() if name != "first"}
    rest["edits"] = tuple(AngleEdit(**edit) for edit in rest["edits"])
    rest["release"] = None if rest["release"] is None else SupportRelease(**rest["release"])
    rest["digits"] = {name: tuple(numbers) for name, numbers in rest["digits"].items()}
    return FoundGrip(request, **rest | {"rows": tuple(rest["rows"])})
