"""Hands and objects of a grasp study, as specified in the study file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from warpjld.errors import InputError
from warpjld.files.names import check_name
from warpjld.files.toml_table import TomlTable
from warpjld.geometry.lengths import check_size
from warpjld.io.identity import content_hash

if TYPE_CHECKING:
    from warpjld.grasp import GraspObject
    from warpjld.rig import Rig

__all__ = ["HandChoice", "ObjectChoice", "read_hand", "read_object"]

_SIZES = ("length", "breadth")


@dataclass(frozen=True)
class HandChoice:
    """A hand: built in, with its size, or from a file.

    Attributes:
        name: Name in the table; unique in a study.
        side: "left" or "right"; None: determined by the file.
        length: Length of a built-in hand, from wrist to the tip of the middle finger [m].
        breadth: Breadth of a built-in hand across the palm [m].
        resolution: Approximate number of vertices of a built-in hand.
        file: Rig file.
        skeleton: Skeleton file of a surface without joints; likewise ``unit``, ``scale``, ``up`` and ``map`` (its
            ``joint_map``), as for ``load_rig``.
    """

    name: str
    side: str | None = None
    length: float = 0.19
    breadth: float = 0.085
    resolution: int = 4000
    file: Path | None = None
    skeleton: Path | None = None
    unit: str | None = None
    up: str | None = None
    scale: float | None = None
    map: Path | None = None

    def inputs(self) -> tuple[Path, ...]:
        """Files it is read from."""
        return tuple(path for path in (self.file, self.skeleton, self.map) if path is not None)

    def moved(self, places: Mapping[Path, Path]) -> HandChoice:
        """Copy that is read from other paths."""
        return replace(self, **_elsewhere(self, ("file", "skeleton", "map"), places))

    def load(self) -> Rig:
        """Build or read the hand."""
        if self.file is None:
            from warpjld.hand.kept import kept_hand

            return kept_hand(self.side or "right", length=self.length, breadth=self.breadth, resolution=self.resolution)
        from warpjld.io.kept_rig import kept_rig

        return kept_rig(
            self.file,
            skeleton=self.skeleton,
            side=self.side,
            unit=self.unit,
            scale=self.scale,
            up=self.up,
            joint_map=self.map,
        )

    def identity(self) -> dict[str, Any]:
        """Settings, with hashes in place of paths."""
        return _hashed(asdict(self))


@dataclass(frozen=True)
class ObjectChoice:
    """An object: built in, with its sizes, or from a file.

    Attributes:
        name: Name in the table; unique in a study.
        shape: Built-in shape, or None for a file.
        sizes: Sizes of the built-in shape by name [m].
        file: Surface file.
        unit: Unit of the file's coordinates.
        up: The file's axis that points up.
        mass: Mass at scale 1 [kg]; None: density times volume.
        centre: Whether the centre of a file's bounding box is moved to the origin; else the file's frame is kept.
    """

    name: str
    shape: str | None = None
    sizes: tuple[tuple[str, float], ...] = ()
    file: Path | None = None
    unit: str = "m"
    up: str = "y"
    mass: float | None = None
    centre: bool = True

    def inputs(self) -> tuple[Path, ...]:
        """File it is read from."""
        return () if self.file is None else (self.file,)

    def moved(self, places: Mapping[Path, Path]) -> ObjectChoice:
        """Copy that is read from another path."""
        return replace(self, **_elsewhere(self, ("file",), places))

    def load(self, scale: float) -> GraspObject:
        """Build or read the object, Y up, its bounding box centred on the origin unless ``centre`` is off."""
        if self.shape is not None:
            from warpjld.grasp.shapes import SHAPES

            return SHAPES[self.shape](**dict(self.sizes), name=self.name).scaled(scale)
        from warpjld.grasp import load_object

        assert self.file is not None
        found = load_object(self.file, name=self.name, unit=self.unit, up=self.up, scale=scale, centre=self.centre)  # type: ignore[arg-type]
        check_size(found.vertices, f"object {self.name} at scale {scale:g}", path=self.file)
        return found

    def identity(self) -> dict[str, Any]:
        """Settings, with hashes in place of paths."""
        return _hashed(asdict(self))


def read_hand(table: TomlTable) -> HandChoice:
    """Read a hand from a table [[hands]].

    Raises:
        InputError: Names line and key.
    """
    if ("builtin" in table) == ("file" in table):
        table.fail("builtin", 'want either builtin = "left" or "right", or file = "…"')
    name = _name(table)
    if "file" in table:
        file = _path(table, "file")
        choice = HandChoice(
            name or file.stem,
            side=table.text("side", known=("left", "right")),
            file=file,
            skeleton=_path(table, "skeleton") if "skeleton" in table else None,
            unit=table.text("unit", known=("m", "cm", "mm")),
            up=table.text("up", known=("y", "z")),
            scale=table.number("scale", above=0.0),
            map=_path(table, "map") if "map" in table else None,
        )
    else:
        side = table.text("builtin", known=("left", "right"))
        assert side is not None
        sizes, words = _hand_sizes(table)
        resolution = table.integer("resolution", 4000, least=1500)
        own = replace(HandChoice(name or f"{side} {words}".strip(), side=side, resolution=resolution), **sizes)  # type: ignore[arg-type]
        choice = own
    table.finish()
    return choice


def _hand_sizes(table: TomlTable) -> tuple[dict[str, float], str]:
    """Read the size of a built-in hand: sizes [m] by name, and words for its default name."""
    share = table.number("percentile", above=0.0, most=99.999)
    sex = table.text("sex", known=("female", "male"))
    own = {key: table.number(key, above=0.0) for key in _SIZES}
    given = {key: value for key, value in own.items() if value is not None}
    if share is None and sex is None:
        return given, " ".join(f"{1000 * value:g}" for value in given.values())
    if share is None or sex is None:
        table.fail("percentile" if share is None else "sex", "is missing: percentile and sex go together")
    if given:
        table.fail(next(iter(given)), "cannot be given beside percentile and sex")
    from warpjld.hand import percentile

    return percentile(share, sex), f"{sex} {share:g} %"


def read_object(table: TomlTable) -> ObjectChoice:
    """Read an object from a table [[objects]].

    Raises:
        InputError: Names line and key.
    """
    from warpjld.grasp.object_file import UNITS
    from warpjld.grasp.shapes import SHAPES

    if ("builtin" in table) == ("file" in table):
        table.fail("builtin", f'want either builtin = one of {", ".join(SHAPES)}, or file = "…"')
    name, mass = _name(table), table.number("mass", above=0.0)
    if "file" in table:
        file = _path(table, "file")
        unit, up = table.text("unit", "m", known=tuple(UNITS)), table.text("up", "y", known=("x", "y", "z"))
        choice = ObjectChoice(name or file.stem, file=file, unit=unit or "m", up=up or "y", mass=mass)
    else:
        shape = table.text("builtin", known=tuple(SHAPES))
        assert shape is not None
        sizes = {key: table.number(key, above=0.0) for key in _size_names(SHAPES[shape])}
        given = tuple((key, value) for key, value in sizes.items() if value is not None)
        choice = ObjectChoice(name or shape, shape=shape, sizes=given, mass=mass)
    table.finish()
    return choice


def _size_names(build: Any) -> list[str]:
    """Names of a built-in shape's sizes: its positional arguments."""
    from inspect import Parameter, signature

    return [p.name for p in signature(build).parameters.values() if p.kind is Parameter.POSITIONAL_OR_KEYWORD]


def _name(table: TomlTable) -> str | None:
    name = table.text("name")
    if name is None:
        return None
    try:
        return check_name(name, "the name")
    except InputError as error:
        table.fail("name", error.message)


def _path(table: TomlTable, key: str) -> Path:
    text = table.text(key)
    assert text is not None
    path = table.folder / text
    if not path.is_file():
        table.fail(key, f"no such file: {path}")
    return path


def _elsewhere(choice: Any, names: tuple[str, ...], places: Mapping[Path, Path]) -> dict[str, Any]:
    """Fields ``names`` of a choice with their paths replaced."""
    paths = {name: getattr(choice, name) for name in names}
    return {name: places.get(path, path) for name, path in paths.items() if path is not None}


def _hashed(settings: dict[str, Any]) -> dict[str, Any]:
    """Settings with name and hash in place of every path."""
    for key, value in settings.items():
        if isinstance(value, Path):
            try:
                settings[key] = {"name": value.name, "sha256": content_hash(value)}
            except OSError as error:
                raise InputError(f"cannot be read: {error.strerror}", path=value) from error
    return settings
