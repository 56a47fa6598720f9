"""Opening of USD stages; OpenUSD's diagnostics become one error, or notes."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError, MissingExtraError
from warpjld.files.archive import check_archive
from warpjld.files.input_file import open_input, read_bytes
from warpjld.files.nesting import nesting
from warpjld.io.usd.crate import MAGIC, check_crate
from warpjld.io.usd.text_layer import layer_in_parts
from warpjld.limits import check_limit

__all__ = ["UsdFile", "check_usd_content", "open_usd", "usd_matrices"]

_PIECE = 1 << 20  # bytes of a text that are looked at together
_MOST_WARNINGS = 5  # largest number of OpenUSD's warnings that are passed on
_PLACE = re.compile(r"^Error in '[^']*' at line \d+ in file \S+ : '(.*?)'?$")


@dataclass
class UsdFile:
    """An open stage.

    Attributes:
        path: The file.
        stage: Its ``Usd.Stage``, fully loaded, with the file's variant selections.
        metres: The unit of length [m], or None if not stated.
        up: ``y`` or ``z``, or None if not stated.
        notes: What was repaired or left out so far.
    """

    path: Path
    stage: Any
    metres: float | None
    up: str | None
    notes: list[str] = field(default_factory=list)

    def prims(self) -> list[Any]:
        """All active, defined, loaded prims, including those of instances."""
        from pxr import Usd

        found = []
        for prim in Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies()):  # instances of instances multiply
            found.append(prim)
            check_limit("nodes", len(found), path=self.path)
        return found


def check_usd_content(path: Path) -> None:
    """Reject content that OpenUSD would take very long to reject, or would unpack without limit."""
    with open_input(path) as file:
        if file.read(5) == b"#usda":
            check_limit(
                "depth", nesting(iter(lambda: file.read(_PIECE), b""), b"[{(", b"]})"), of="brackets", path=path
            )
            return
    raw = read_bytes(path)
    if raw.startswith(b"PK"):
        check_archive(path, "USD package (.usdz)")
        with zipfile.ZipFile(path) as package:
            for name in package.namelist():
                with package.open(name) as part:  # textures are not read whole
                    if (head := part.read(len(MAGIC))) == MAGIC:
                        check_crate(head + part.read(), path)
    elif raw.startswith(MAGIC):
        check_crate(raw, path)


@contextmanager
def open_usd(path: str | Path) -> Iterator[UsdFile]:
    """Context with an open stage; OpenUSD's warnings become notes instead of text on stderr.

    Raises:
        InputError: Not a USD file, an unresolved reference, or an error of OpenUSD while reading.
        MissingExtraError: OpenUSD is not installed.
    """
    path = Path(path)
    if not path.exists():
        raise InputError("no such file", path=path)
    check_usd_content(path)
    try:
        from pxr import Tf, Usd, UsdGeom, UsdUtils
    except ImportError as error:
        raise MissingExtraError("USD", "usd") from error
    told = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        stage = Usd.Stage.Open(layer_in_parts(path) or str(path))
        broken = stage.GetCompositionErrors()
        told.TakeUncoalescedDiagnostics()
        if broken:
            raise InputError(f"its parts do not come together: {_line(str(broken[0]))}", path=path)
        metres = UsdGeom.GetStageMetersPerUnit(stage) if UsdGeom.StageHasAuthoredMetersPerUnit(stage) else None
        if metres is not None and not 0.0 < metres < float("inf"):
            raise InputError(f"metersPerUnit: want a length above 0, got {metres:g}", path=path)
        up = UsdGeom.GetStageUpAxis(stage).lower() if stage.HasAuthoredMetadata("upAxis") else None
        file = UsdFile(path, stage, metres, up)
        yield file
        warned = dict.fromkeys(_line(one.commentary) for one in told.TakeUncoalescedDiagnostics())
        file.notes += [f"OpenUSD: {line}" for line in list(warned)[:_MOST_WARNINGS]]
    except Tf.ErrorException as error:
        raise InputError(f"OpenUSD cannot read it: {_reason(_told(error))}", path=path) from None
    except (AttributeError, IndexError, KeyError, OverflowError, TypeError, ValueError) as error:
        # a stage may declare attributes with wrong types, which raises only where they are used
        raise InputError(
            f"an attribute is not of the type that UsdSkel wants: {_line(str(error))}", path=path
        ) from error
    finally:
        told.TakeUncoalescedDiagnostics()


def usd_matrices(values: Any) -> NDArray[np.float64]:
    """A Gf.Matrix4d or an array of them, transposed to column vectors (USD: row vectors), (4, 4) or (N, 4, 4)."""
    return np.array(values, dtype=np.float64).swapaxes(-1, -2)


def _told(error: Exception) -> str:
    try:
        return str(error)
    except UnicodeDecodeError:  # the message quotes the file
        return "text that is not UTF-8"


def _reason(text: str) -> str:
    lines = [line.strip() for line in text.strip().splitlines()]
    found = _PLACE.search(lines[0]) if lines else None
    return _line(found.group(1) if found else text)


def _line(text: str) -> str:
    return " ".join(text.split())[:300]
