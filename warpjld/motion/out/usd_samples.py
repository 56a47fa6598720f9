"""Time samples of joints in USD text, written piece by piece: OpenUSD keeps those of a text layer in memory."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.files.spilled_rows import SpilledRows
from warpjld.files.whole_file import whole_file

__all__ = ["JointSamples"]

_BEGIN = re.compile(rb"\s*\w+\[\] (translations|rotations)\.timeSamples = \{\s*")
_END = b"}"


class JointSamples:
    """Translations and rotations of N joints by frame, which take the place of samples in a text layer.

    Args:
        joints: Count N of joints.
        start: Time code of the first frame.
    """

    def __init__(self, joints: int, start: int) -> None:
        self._joints, self._start = joints, start
        self._rows = SpilledRows(7 * joints)

    def add(self, translations: NDArray[np.float64], rotations: NDArray[np.float64]) -> None:
        """Append a frame.

        Args:
            translations: Shape (N, 3).
            rotations: Quaternions x, y, z, w, shape (N, 4).
        """
        self._rows.extend(np.concatenate([translations.ravel(), np.roll(rotations, 1, axis=-1).ravel()])[None])

    def insert(self, path: Path) -> None:
        """Replace the samples of a layer's ``translations`` and ``rotations``, of which it has one each, by all.

        Raises:
            OSError: The file cannot be written.
        """
        with whole_file(path) as part, path.open("rb") as before, part.open("wb") as after:
            for line in before:
                after.write(line)
                if found := _BEGIN.fullmatch(line):
                    indent = b" " * (len(line) - len(line.lstrip()) + 4)
                    after.writelines(indent + text for text in self._texts(found[1] == b"rotations"))
                    after.write(next(rest for rest in before if rest.strip() == _END))

    def _texts(self, rotations: bool) -> Iterator[bytes]:
        """Lines of the samples; nine digits represent a float32 exactly, and quaternions begin with w."""
        width = 4 if rotations else 3
        columns = slice(3 * self._joints, None) if rotations else slice(0, 3 * self._joints)
        one = "(" + ", ".join(["%.9g"] * width) + ")"
        form = "%d: [" + ", ".join([one] * self._joints) + "],\n"
        time = self._start
        for block in self._rows.blocks():
            for row in block[:, columns].astype(np.float32).tolist():
                yield (form % (time, *row)).encode("ascii")
                time += 1
