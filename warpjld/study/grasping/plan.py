"""Plan of a grasp study, read from a TOML file."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from warpjld.files.manifest import versions
from warpjld.files.toml_table import TomlTable, read_toml
from warpjld.skeleton import CHANNELS, DIGITS
from warpjld.skeleton.hand import HAND_PARENTS
from warpjld.study.grasping.choices import HandChoice, ObjectChoice, read_hand, read_object
from warpjld.study.grasping.pressing import ContactPlan, read_pressing

__all__ = ["COMPUTING", "GraspPlan", "Measuring", "WristRange", "load_plan"]

COMPUTING = ("warpjld", "numpy", "scipy", "warp-lang")
"""Packages whose versions belong to a study's identity, since another version may give other last digits."""


@dataclass(frozen=True)
class WristRange:
    """Ranges that the wrist's placement is drawn from; each pair is a uniform distribution.

    Attributes:
        elevation: Elevation of the direction that the hand comes from [°]; uniform over the sphere's area.
        azimuth: Azimuth of that direction about the object's Y axis, 0 along +Z [°].
        roll: Rotation of the fingers about the direction of approach [°].
        tilt: Angle between the palm's normal and the direction of approach [°].
        gap: Distance from palm to object along the approach [m].
        offset: Distance of the palm's aim from the object's centre, relative to the object's half extent.
        best_of: 0 draws one placement from these ranges; n takes the best grasp of n placements of
            `warpjld.grasp.find_grasp.find_grasp` (the script's GRASP … AUTO), and the ranges are not used.
        palm: With ``best_of``: accept power grips only: the palm and all digits but one are in contact.
    """

    elevation: tuple[float, float] = (-90.0, 90.0)
    azimuth: tuple[float, float] = (-180.0, 180.0)
    roll: tuple[float, float] = (-180.0, 180.0)
    tilt: tuple[float, float] = (0.0, 20.0)
    gap: tuple[float, float] = (0.0, 0.02)
    offset: tuple[float, float] = (0.0, 0.3)
    best_of: int = 0
    palm: bool = False


Posture = str | tuple[tuple[str, str, float], ...]
"""Name of a posture, or "auto" for one chosen by the object's shape; or (joint without side, channel, angle [°])."""


@dataclass(frozen=True)
class Measuring:
    """Settings of the metrics, and limits for success.

    Attributes:
        contact: Largest distance of skin that counts as contact [m].
        edges: Number of edges of the friction cones.
        norm: Norm of the wrench space, "L1" or "Linf".
        torque_scale: Length torques are divided by [m]; None: the object's largest radius about its centre of mass.
        density: Density of objects without a given mass [kg/m³].
        squeeze: Sum of normal forces before gravity acts [N].
        normal_stiffness: Normal stiffness of the skin at a contact [N/m], see ``gravity_displacement``.
        tangential_stiffness: Tangential stiffness likewise [N/m].
        penetration: Largest penetration of a success [m].
        displacement: Largest displacement under gravity of a success [m]; None: no limit.
    """

    contact: float = 5e-4
    edges: int = 8
    norm: Literal["L1", "Linf"] = "L1"
    torque_scale: float | None = None
    density: float = 300.0
    squeeze: float = 10.0
    normal_stiffness: float = 3500.0
    tangential_stiffness: float = 2400.0
    penetration: float = 1e-3
    displacement: float | None = None


@dataclass(frozen=True)
class GraspPlan:
    """Plan of a grasp study.

    Trial k uses combination k modulo hands × objects × scales × frictions × weights of ``pressing``, in this order,
    the last varying fastest. It does not depend on the number of trials, so a study can be extended later.
    """

    title: str
    trials: int
    seed: int
    hands: tuple[HandChoice, ...]
    objects: tuple[ObjectChoice, ...]
    scales: tuple[float, ...]
    frictions: tuple[float, ...]
    digits: tuple[str, ...]
    posture: Posture
    coupling: tuple[float, float]
    wrist: WristRange
    measuring: Measuring
    pressing: ContactPlan | None = None

    @property
    def combinations(self) -> int:
        """Count of combinations of hand, object, scale, friction and weight."""
        kinds = (self.hands, self.objects, self.scales, self.frictions, self._weights)
        return math.prod(len(kind) for kind in kinds)

    @property
    def _weights(self) -> tuple[float | None, ...]:
        return (None,) if self.pressing is None else self.pressing.weights

    def weight(self, trial: int) -> float | None:
        """Weight to be held in a trial [N]; None if contact is not solved."""
        return self._weights[trial % len(self._weights)]

    def combination(self, trial: int) -> tuple[HandChoice, ObjectChoice, float, float]:
        """Hand, object, scale and friction of a trial."""
        rest, friction = divmod(trial // len(self._weights), len(self.frictions))
        rest, scale = divmod(rest, len(self.scales))
        rest, thing = divmod(rest, len(self.objects))
        return self.hands[rest % len(self.hands)], self.objects[thing], self.scales[scale], self.frictions[friction]

    def identity(self) -> dict[str, Any]:
        """Everything that determines the results, as JSON, with hashes in place of files."""
        settings = asdict(self)
        del settings["trials"], settings["title"]
        if self.pressing is None:
            del settings["pressing"]
        if not self.wrist.palm:  # keeps the identity of studies begun before this setting existed
            del settings["wrist"]["palm"]
        settings["hands"] = [hand.identity() for hand in self.hands]
        settings["objects"] = [thing.identity() for thing in self.objects]
        return settings | {"versions": {name: versions([name])[name] for name in COMPUTING}}


def load_plan(path: str | Path) -> GraspPlan:
    """Read a study file; see ``docs/reference/grasp-study.md`` for its keys.

    Raises:
        InputError: Unreadable, an unknown key (with a suggestion), or a value out of range: file, line and key named.
    """
    top = read_toml(path)
    title = top.text("title", Path(path).stem)
    plan = GraspPlan(
        title=title or Path(path).stem,
        trials=top.integer("trials", least=1, within="trials"),
        seed=top.integer("seed", least=0),
        hands=tuple(read_hand(table) for table in top.tables("hands")),
        objects=tuple(read_object(table) for table in top.tables("objects")),
        scales=top.numbers("scales", (1.0,), above=0.0, most=100.0),
        frictions=top.numbers("friction", (0.6,), above=0.0, most=10.0),
        digits=top.texts("digits", tuple(reversed(DIGITS)), known=DIGITS),
        posture=_read_posture(top),
        coupling=_read_coupling(top),
        wrist=_read_wrist(top.table("wrist")),
        measuring=_read_measuring(top.table("measuring")),
        pressing=read_pressing(top.table("contact")) if "contact" in top else None,
    )
    top.finish()
    if plan.wrist.best_of and (len(plan.digits) < len(DIGITS) or not isinstance(plan.posture, str)):
        top.fail("posture" if len(plan.digits) == len(DIGITS) else "digits", "cannot be chosen with wrist.best_of")
    for kind, names in (("hands", [h.name for h in plan.hands]), ("objects", [o.name for o in plan.objects])):
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            top.fail(kind, f"two are called '{twice[0]}'; give them a name each")
    return plan


def _read_posture(top: TomlTable) -> Posture:
    """A name, or tables [posture."thumb.base"] of channels in degrees."""
    from warpjld.grasp.postures import POSTURES

    if not top.is_table("posture"):
        return top.text("posture", "auto", known=("auto", *POSTURES)) or "auto"
    table, joints = top.table("posture"), [name for name in HAND_PARENTS if not name.endswith(".tip")]
    found = []
    for joint in joints:
        if joint not in table:
            continue
        channels = table.table(joint)
        for channel in CHANNELS:
            angle = channels.number(channel, least=-180.0, most=180.0)
            if angle is not None:
                found.append((joint, channel, angle))
        channels.finish()
    table.finish(joints)
    return tuple(found)


def _read_coupling(top: TomlTable) -> tuple[float, float]:
    second, third = top.numbers("coupling", (1.0, 0.7), least=0.0, most=10.0, count=2)
    return second, third


def _read_wrist(table: TomlTable) -> WristRange:
    default = WristRange()
    found = WristRange(
        elevation=_range(table, "elevation", default.elevation, -90.0, 90.0),
        azimuth=_range(table, "azimuth", default.azimuth, -360.0, 360.0),
        roll=_range(table, "roll", default.roll, -360.0, 360.0),
        tilt=_range(table, "tilt", default.tilt, 0.0, 90.0),
        gap=_range(table, "gap", default.gap, 0.0, 1.0),
        offset=_range(table, "offset", default.offset, 0.0, 1.0),
        best_of=table.integer("best_of", default.best_of),
        palm=table.truth("palm", default.palm),
    )
    if found.palm and not found.best_of:
        table.fail("palm", "is for best_of: ranges alone choose no grasp")
    table.finish()
    return found


def _read_measuring(table: TomlTable) -> Measuring:
    default = Measuring()

    def number(key: str, **limits: float) -> float:
        value = table.number(key, getattr(default, key), **limits)
        assert value is not None
        return value

    norm = table.text("norm", default.norm, known=("L1", "Linf"))
    found = Measuring(
        contact=number("contact", above=0.0, most=0.01),
        edges=table.integer("edges", default.edges, least=3),
        norm="Linf" if norm == "Linf" else "L1",
        torque_scale=table.number("torque_scale", above=0.0),
        density=number("density", above=0.0),
        squeeze=number("squeeze", least=0.0),
        normal_stiffness=number("normal_stiffness", above=0.0),
        tangential_stiffness=number("tangential_stiffness", above=0.0),
        penetration=number("penetration", least=0.0),
        displacement=table.number("displacement", above=0.0),
    )
    table.finish()
    return found


def _range(table: TomlTable, key: str, default: tuple[float, float], least: float, most: float) -> tuple[float, float]:
    low, high = table.numbers(key, default, least=least, most=most, count=2)
    if low > high:
        table.fail(key, f"want the smaller number first, got {low:g} and {high:g}")
    return low, high
