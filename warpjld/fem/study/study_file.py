"""Reader of study files (TOML), whose tables and keys are listed in ``docs/reference/fem-study.md``."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Ints32
from warpjld.fem.body import Body
from warpjld.fem.load.loads import Centrifugal, Loads, external_forces
from warpjld.fem.material.materials import Fung, LinearElastic, Material, MooneyRivlin, NeoHooke
from warpjld.fem.mesh.generated import ball_hexes, box_hexes, cylinder_hexes, finger_hexes
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.fem.solver.linear import METHODS, PRECISIONS
from warpjld.fem.solver.static import FREE
from warpjld.fem.study.study import FemStudy, Step, Support
from warpjld.files.names import check_name, clash
from warpjld.files.toml_table import TomlTable, read_toml
from warpjld.geometry.lengths import check_size
from warpjld.limits import check_limit

__all__ = ["load_study"]

_MESHES: dict[str, Callable[..., HexMesh]] = {
    "box": box_hexes,
    "ball": ball_hexes,
    "cylinder": cylinder_hexes,
    "finger": finger_hexes,
}
_LAWS: dict[str, tuple[Callable[..., Material], tuple[str, ...]]] = {
    "linear": (LinearElastic, ("young", "poisson")),
    "neo-hooke": (NeoHooke, ("young", "poisson")),
    "mooney-rivlin": (MooneyRivlin, ("c10", "c01")),
    "fung": (Fung, ("young", "stiffening")),
}
"""Name of each law → its constructor and required constants."""

_AXES = ("x", "y", "z")


def load_study(path: str | Path) -> FemStudy:
    """Read and check a study file.

    Raises:
        InputError: Not TOML, or an entry that is unknown, missing or invalid, with file, line and entry.
    """
    top = read_toml(path)
    top.needed("mesh", "material", "step")
    try:
        title = top.text("title") or Path(path).stem
        mesh, notes = _mesh(top.table("mesh"))
        for name, chosen in top.named_tables("sets").items():
            mesh = mesh.with_nodes(**{name: _nodes(mesh, chosen)})
        materials = {region: _material(table) for region, table in top.named_tables("material").items()}
        stress = top.numbers("initial_stress", (0.0,) * 6, count=6)
        steps = tuple(_step(k, table) for k, table in enumerate(top.tables("step")))
        if twice := clash(step.name.replace(" ", "-") for step in steps):
            top.fail("step", f"two are called '{twice[0]}'; pictures are called by their names: give each its own")
        solver = top.table("solver")
        method = solver.text("method", "auto", known=METHODS) or "auto"
        precision = solver.text("precision", "float64", known=PRECISIONS) or "float64"
        solver.finish()
        top.finish()
        check_size(mesh.nodes, "[mesh]", "its size or scale")
        body = Body(mesh, materials, initial_stress=stress)
        for step in steps:
            external_forces(body, step.loads)
            for support in step.prescribed:
                support.on(mesh)
    except InputError as error:
        if error.path is None:
            raise InputError(error.message, path=path) from error
        raise
    return FemStudy(title, body, steps, method, precision, notes)


def _mesh(table: TomlTable) -> tuple[HexMesh, tuple[str, ...]]:
    """The mesh, and notes on its making."""
    table.needed("kind")
    kind = table.text("kind", known=(*_MESHES, "surface", "file"))
    if kind in _MESHES:
        parameters = inspect.signature(_MESHES[kind]).parameters
        options = {name: table.like(name, parameter.default) for name, parameter in parameters.items()}
        table.finish()
        check_limit("elements", _most_elements(kind or "", options), of="[mesh]", path=table.file)
        return _MESHES[kind](**options), ()
    table.needed("path")
    file = table.folder / (table.text("path") or "")
    scale = table.number("scale", 1.0, above=0.0) or 1.0
    if kind == "file":
        from warpjld.fem.mesh.exchange import read_volume_mesh

        table.finish()
        return read_volume_mesh(file, scale=scale), ()
    from warpjld.fem.mesh.fit import mesh_surface_file
    from warpjld.io.mesh_file import read_mesh as read_surface

    table.needed("spacing")
    spacing = table.number("spacing", above=0.0)
    table.finish()
    assert spacing is not None
    size = np.ptp(read_surface(file).vertices, axis=0) * scale
    check_limit("elements", float(np.prod(size / spacing)), of=f"[mesh] spacing {spacing:g} m: about", path=table.file)
    fit = mesh_surface_file(file, spacing=spacing, scale=scale)
    fitted = f"fitted to the surface: gap at most {1e3 * fit.gap:.2g} mm, volume {100 * fit.volume:.1f} % of it"
    return fit.mesh, (fitted, *fit.notes)


def _most_elements(kind: str, options: dict[str, Any]) -> float:
    """Approximate number of elements that a mesh with these options would have."""
    if kind == "box":
        return math.prod(float(count) for count in options["counts"])
    n = float(options["n"])
    layers = float(options["layers"] or n)
    along = float(options.get("along", 0)) + {"ball": n, "finger": n / 2}.get(kind, 0.0)
    return n * n * along + (4.0 * n * along + 2.0 * n * n) * layers  # the core, and the layers around it


def _material(table: TomlTable) -> Material:
    table.needed("law")
    law, constants = _LAWS[table.text("law", known=tuple(_LAWS)) or ""]
    table.needed(*constants)
    names = dict.fromkeys((*constants, "poisson", "density"))
    given = {name: table.number(name) for name in names}
    table.finish()
    try:
        return law(**{name: value for name, value in given.items() if value is not None})
    except InputError as error:
        name, _, message = error.message.partition(": ")
        if name in given:
            table.fail(name, message)
        raise InputError(f"[{table.name}] {error.message}") from error


def _nodes(mesh: HexMesh, table: TomlTable) -> Ints32:
    """Nodes of a set, restricted by planes."""
    nodes = mesh.node_set(table.text("of", "surface") or "")
    for key, sign in (("above", 1.0), ("below", -1.0)):
        for axis, value in _along_axes(table.table(key)).items():
            nodes = nodes[sign * mesh.nodes[nodes, axis] >= sign * value - 1e-9 * mesh.size]
    table.finish()
    if len(nodes) == 0:
        raise InputError(f"[{table.name}] holds no node")
    return nodes


def _step(number: int, table: TomlTable) -> Step:
    name = table.text("name") or f"step {number + 1}"
    try:
        check_name(name, "the step's name")  # it is part of the pictures' file names
    except InputError as error:
        table.fail("name", error.message)
    step = Step(
        name=name,
        loads=Loads(
            gravity=table.vector("gravity", (0.0, 0.0, 0.0)),
            centrifugal=_centrifugal(table.table("centrifugal")) if "centrifugal" in table else None,
            pressure=_numbers(table.table("pressure")),
            traction=_vectors(table.table("traction")),
            forces=_vectors(table.table("force")),
        ),
        prescribed=tuple(_support(entry) for entry in table.tables("prescribed", least=0)),
        instants=table.integer("instants", 1, least=1, within="instants"),
        free=table.text("free", "hold", known=FREE) or "hold",
    )
    table.finish()
    return step


def _centrifugal(table: TomlTable) -> Centrifugal:
    table.needed("axis", "speed")
    turn = Centrifugal(table.vector("axis"), table.number("speed") or 0.0, table.vector("point", (0.0, 0.0, 0.0)))
    table.finish()
    return turn


def _support(table: TomlTable) -> Support:
    table.needed("where")
    where = table.text("where") or ""
    onto = _along_axes(table.table("onto"))
    moves = _along_axes(table)
    if not moves and not onto:
        table.fail("where", "is given no displacement x, y or z, and no planes onto")
    return Support(where, moves, onto)


def _along_axes(table: TomlTable) -> dict[int, float]:
    """Numbers by axis index; unknown keys of the table are rejected."""
    found = {axis: table.number(name) for axis, name in enumerate(_AXES)}
    table.finish()
    return {axis: value for axis, value in found.items() if value is not None}


def _numbers(table: TomlTable) -> dict[str, float]:
    return {name: table.number(name) or 0.0 for name in table}


def _vectors(table: TomlTable) -> dict[str, tuple[float, float, float]]:
    return {name: table.vector(name) for name in table}
