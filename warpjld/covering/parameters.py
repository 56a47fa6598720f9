"""The animator's parameters of every joint (A §3, R22–R24), their defaults, and their files."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.reading import reading
from warpjld.files.text_file import read_json
from warpjld.files.whole_file import whole_file
from warpjld.skeleton.channels import ABDUCTION, FLEXION
from warpjld.skeleton.tree import Skeleton
from warpjld.suggest import one_of

__all__ = ["Parameters", "default_parameters", "load_parameters", "save_parameters"]

_SHAPES = ("proximity", "peak", "exponents")  # parameters that shape the coefficient fields; the others scale them

_INFLATION = 0.1  # default for a 90° joint: rounds knuckles, and restores half of the volume that a tube loses there
_PALM = 3.0  # amount of flesh at a joint of the palm relative to a finger's (assumed)
_WIDEST = np.radians(135.0)  # bound of the flexion in defaults: wider limits are not reached by a joint alone


_MOST = 1e3  # largest value of any parameter; defaults are about one


@dataclass(frozen=True, eq=False)
class Parameters:
    """Parameters of J joints. Those of the joints at its two ends determine a segment's deformation.

    Attributes:
        inflation: Amplitude of the rounding of a joint at full flexion, shape (J,) (R22a, R58–R62).
        proximity: Portion of a segment to round: of the segment that begins at the joint, and of the one that ends
            there, shape (J, 2) (R22b; A Fig. 6 has 0.3 and 0.2). Both portions of a segment sum to 1 at most (C21).
        muscle: Amplitude of the internal muscle of the segment that begins at the joint, shape (J,) (R22c, R63).
        peak: Ratio along that segment where the muscle is fullest, in (0, 1), shape (J,) (R22d, R64).
        exponents: Exponent b of the two functions a^b, before and beyond the peak, shape (J, 2) (R65).
        palm: Exponent k of the palm's scale factor where neighbouring segments approach, shape (J,) (R44, C3).

    Examples:
        >>> from dataclasses import replace
        >>> covering = wj.bind(wj.build_hand("left", resolution=1500))
        >>> mine = replace(covering.parameters, inflation=2.0 * covering.parameters.inflation)
        >>> mine
        Parameters(of 26 joints)
        >>> rounder = covering.with_parameters(mine)
    """

    inflation: NDArray[np.float64]
    proximity: NDArray[np.float64]
    muscle: NDArray[np.float64]
    peak: NDArray[np.float64]
    exponents: NDArray[np.float64]
    palm: NDArray[np.float64]

    def __repr__(self) -> str:
        return f"Parameters(of {len(self.inflation)} joints)"

    def shapes_like(self, other: Parameters) -> bool:
        """Whether the parameters that shape coefficient fields are equal, so that at most amplitudes differ."""
        return all(np.array_equal(getattr(self, name), getattr(other, name)) for name in _SHAPES)

    def check(self, skeleton: Skeleton) -> None:
        """Raise InputError where a value is out of its range for this skeleton."""
        count = len(skeleton)
        for field in fields(self):
            array = getattr(self, field.name)
            if array.shape[0] != count:
                raise InputError(f"parameters.{field.name}: want {count} rows, got {array.shape[0]}")
            bad = np.argwhere(~((array >= 0.0) & (array <= _MOST)))
            if len(bad):
                name = skeleton.names[bad[0][0]]
                raise InputError(f"parameters.{field.name} of '{name}' must be finite and ≥ 0, and {_MOST:g} at most")
        outside = np.flatnonzero((self.peak <= 0.0) | (self.peak >= 1.0))
        if outside.size:
            raise InputError(f"parameters.peak of '{skeleton.names[outside[0]]}' must lie between 0 and 1")
        for segment in skeleton.segments:
            total = self.proximity[segment.proximal, 0] + self.proximity[segment.distal, 1]
            if total > 1.0 + 1e-9:
                ends = f"'{skeleton.names[segment.proximal]}' → '{skeleton.names[segment.distal]}'"
                raise InputError(f"proximities of segment {ends} sum to {total:.3g}; at most 1 (C21)")


def default_parameters(skeleton: Skeleton) -> Parameters:
    """Defaults: inflation by the volume that maximal flexion would lose, and no muscles.

    A cross-section turned by φ against its segment loses 1 − cos φ of its volume. The bisector turns cross-sections by
    up to θ/2, so a joint bent by θ loses 1 − sin(θ/2)/(θ/2) of the volume around it. Inflation is relative to the
    maximal flexion (R59), so its amplitudes are proportional to that loss at the maximal flexion: a 20° metacarpal
    joint gets a twentieth of a knuckle's. The remaining loss is compensated by swelling
    (``warpjld.covering.swelling``); muscles, which bulge inside a bend (R63), would be folded in by it.

    Where a finger meets the palm inflation is three times as large: the palm loses volume at that joint too.
    Palm segments that approach thicken what is between them by k = 1, which keeps the area of its cross-section (C3).
    """
    count = len(skeleton)
    largest = np.minimum(skeleton.limits[:, FLEXION, 1], _WIDEST)
    bends = (largest > 1e-6) & (skeleton.parents >= 0) & np.array([bool(c) for c in skeleton.children])
    loss = np.where(bends, _volume_loss(largest) / _volume_loss(np.array(np.pi / 2.0)), 0.0)
    loss[[s.distal for s in skeleton.segments if s.palm]] *= _PALM
    swing = np.minimum(np.hypot(largest, skeleton.limits[:, ABDUCTION, 1]), _WIDEST)
    swings = bends & (swing > 1.01 * largest)
    balls = [s.proximal for s in skeleton.segments if s.palm and swings[s.proximal]]
    loss[balls] = _PALM * _volume_loss(swing[balls]) / _volume_loss(np.array(np.pi / 2.0))
    ones = np.ones(count)
    return Parameters(
        inflation=_INFLATION * loss,
        proximity=np.column_stack([0.3 * ones, 0.3 * ones]),
        muscle=np.zeros(count),
        peak=0.5 * ones,
        exponents=np.column_stack([0.6 * ones, 0.6 * ones]),
        palm=ones,
    )


def _volume_loss(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of the volume around a joint lost by bending it by an angle [rad]."""
    half = np.maximum(angle / 2.0, 1e-3)
    return 1.0 - np.sin(half) / half


def save_parameters(path: str | Path, skeleton: Skeleton, parameters: Parameters) -> None:
    """Write a parameter file (JSON: joint → values).

    Raises:
        InputError: The file cannot be written.

    Examples:
        >>> from tempfile import mkdtemp
        >>> covering = wj.bind(wj.build_hand("left", resolution=1500))
        >>> wj.save_parameters(Path(mkdtemp()) / "hand.json", covering.skeleton, covering.parameters)
    """
    joints = {
        name: {f.name: np.round(getattr(parameters, f.name)[j], 6).tolist() for f in fields(parameters)}
        for j, name in enumerate(skeleton.names)
    }
    content = json.dumps({"warpjld": "parameters", "version": 1, "joints": joints}, indent=1)
    try:
        with whole_file(Path(path)) as part:
            part.write_text(content + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write parameters: {error.strerror}", path=path) from error


def load_parameters(path: str | Path, skeleton: Skeleton) -> Parameters:
    """Read a parameter file; joints it does not name keep the defaults.

    Raises:
        InputError: Unreadable file, unknown joint or field, or a value of the wrong shape or range.

    Examples:
        >>> from tempfile import mkdtemp
        >>> file = Path(mkdtemp()) / "rounder.json"
        >>> _ = file.write_text(
        ...     '{"warpjld": "parameters", "version": 1, "joints": {"left.index.base": {"inflation": 0.2}}}'
        ... )
        >>> skeleton = wj.build_hand("left", resolution=1500).skeleton
        >>> parameters = wj.load_parameters(file, skeleton)
        >>> float(parameters.inflation[skeleton.index("index.base")])
        0.2
    """
    content = read_json(path)
    with reading(path, "a parameter file"):
        return _parameters(content, skeleton)


def _parameters(content: Any, skeleton: Skeleton) -> Parameters:
    """Checked parameters from the parsed JSON of a parameter file."""
    joints = content.get("joints") if isinstance(content, dict) else None
    if not isinstance(joints, dict) or not all(isinstance(values, dict) for values in joints.values()):
        raise InputError("want a JSON object with a 'joints' object that holds values by joint")
    defaults = default_parameters(skeleton)
    known = {f.name: getattr(defaults, f.name) for f in fields(defaults)}
    for name, values in joints.items():
        joint = skeleton.index(name)
        for key, value in values.items():
            if key not in known:
                raise InputError(f"joint '{name}': unknown parameter '{key}'{one_of(key, known)}")
            try:
                known[key][joint] = value
            except (TypeError, ValueError):
                want = "two numbers" if known[key].ndim == 2 else "a number"
                raise InputError(f"joint '{name}': '{key}' wants {want}, got {value!r}") from None
    parameters = Parameters(**known)
    parameters.check(skeleton)
    return parameters
