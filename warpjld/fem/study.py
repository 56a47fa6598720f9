"""A study from a TOML file: mesh, materials, sets, and load steps one after another."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.ball import ball, cylinder, finger
from warpjld.fem.body import Body
from warpjld.fem.box import box
from warpjld.fem.entries import like, one_of, three_numbers, whole
from warpjld.fem.hexmesh import HexMesh
from warpjld.fem.linear import METHODS, PRECISIONS
from warpjld.fem.loads import Centrifugal, Loads, external_forces
from warpjld.fem.materials import Fung, LinearElastic, Material, MooneyRivlin, NeoHooke
from warpjld.fem.prescribed import Prescribed, prescribe
from warpjld.fem.solution import Instant, Solution
from warpjld.fem.static import FREE, solve

__all__ = ["Reached", "Step", "Study", "load_study"]

_LAWS: dict[str, Callable[..., Material]] = {
    "linear": LinearElastic,
    "neo-hooke": NeoHooke,
    "mooney-rivlin": MooneyRivlin,
    "fung": Fung,
}
_CONSTANTS = {
    "mooney-rivlin": ("c10", "c01", "poisson", "density"),
    "fung": ("young", "stiffening", "poisson", "density"),
}
_STEP_KEYS = ("name", "instants", "free", "gravity", "centrifugal", "pressure", "traction", "force", "prescribed")


@dataclass(frozen=True)
class Step:
    """Loads and prescribed displacements that are reached together.

    Attributes:
        name: For tables and pictures.
        loads: At the end of the step.
        prescribed: As in the file: ``where`` with ``x``, ``y``, ``z`` (displacements) or ``onto`` (planes).
        instants: Number of load instants.
        free: ``refuse`` or ``hold``.
    """

    name: str
    loads: Loads
    prescribed: tuple[Mapping[str, Any], ...]
    instants: int
    free: str


@dataclass(frozen=True, eq=False)
class Reached:
    """An equilibrium of a study.

    Attributes:
        step: The step it belongs to.
        time: Steps done so far, this one's share included.
        instant: The equilibrium.
        solution: That of the whole step.
        held: Prescribed degrees of freedom by the set they were given for.
    """

    step: Step
    time: float
    instant: Instant
    solution: Solution
    held: dict[str, NDArray[np.int64]]


@dataclass(frozen=True, eq=False)
class Study:
    """What a study file says.

    Attributes:
        title: For people.
        body: Mesh and materials.
        steps: Load steps in order.
        path: The file.
        method: Linear solver.
        precision: Its precision.
        notes: What was found while meshing, for people.
    """

    title: str
    body: Body
    steps: tuple[Step, ...]
    path: Path
    method: str = "auto"
    precision: str = "float64"
    notes: tuple[str, ...] = ()

    def run(self, progress: Callable[[str], None] | None = None) -> Iterator[Reached]:
        """Equilibria in order, as whole steps are done; the last one's solution may not have converged."""
        after: Solution | None = None
        for number, step in enumerate(self.steps):
            known = Prescribed(np.empty(0, np.int64), np.empty(0))
            held: dict[str, NDArray[np.int64]] = {}
            for entry in step.prescribed:
                part = _prescribed(self.body.mesh, entry)
                known = known + part
                held[str(entry["where"])] = part.degrees
            solution = solve(
                self.body,
                known,
                step.loads,
                after=after,
                instants=step.instants,
                free=step.free,
                method=self.method,
                precision=self.precision,
                check=False,
                progress=None if progress is None else lambda text, name=step.name: progress(f"{name}: {text}"),  # type: ignore[misc]
            )
            if len(solution.held):
                held["held because free"] = solution.held
            for instant in solution.instants:
                yield Reached(step, number + instant.factor, instant, solution, held)
            if not solution.converged:
                return
            after = solution


def load_study(path: Path) -> Study:
    """Read and check a study file.

    Raises:
        InputError: Not TOML, or an entry that is unknown, missing or wrong.
    """
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"not TOML: {error}", path=path) from error
    try:
        _known("the study", table, ("title", "mesh", "material", "sets", "step", "solver", "initial_stress"))
        mesh, notes = _mesh(_need("the study", table, "mesh", dict), path.parent)
        for name, chosen in table.get("sets", {}).items():
            mesh = mesh.with_nodes(**{name: _set(mesh, name, chosen)})
        materials = {n: _material(n, t) for n, t in _need("the study", table, "material", dict).items()}
        body = Body(mesh, materials, initial_stress=table.get("initial_stress"))
        steps = tuple(_step(k, t) for k, t in enumerate(_need("the study", table, "step", list)))
        for step in steps:
            external_forces(body, step.loads)
            for entry in step.prescribed:
                _prescribed(mesh, entry)
        solver = table.get("solver", {})
        _known("[solver]", solver, ("method", "precision"))
        for key, words in (("method", METHODS), ("precision", PRECISIONS)):
            if key in solver:
                one_of(f"[solver] {key}", solver[key], words)
        return Study(str(table.get("title", path.stem)), body, steps, path, notes=notes, **solver)
    except InputError as error:
        if error.path is None:
            raise InputError(error.message, path=path) from error
        raise
    except (TypeError, ValueError, AttributeError, IndexError) as error:
        raise InputError(f"an entry is of the wrong kind: {error}", path=path) from error


def _mesh(table: Mapping[str, Any], folder: Path) -> tuple[HexMesh, tuple[str, ...]]:
    kind = _need("[mesh]", table, "kind", str)
    options = {k: v for k, v in table.items() if k != "kind"}
    makers: dict[str, Callable[..., HexMesh]] = {"box": box, "ball": ball, "cylinder": cylinder, "finger": finger}
    if kind == "file":
        from warpjld.fem.exchange import read_mesh

        _known("[mesh]", options, ("path", "scale"))
        path = folder / _need("[mesh]", options, "path", str)
        return read_mesh(path, scale=float(options.get("scale", 1.0))), ()
    if kind == "surface":
        from warpjld.fem.fit import mesh_surface_file

        _known("[mesh]", options, ("path", "spacing", "scale"))
        fit = mesh_surface_file(
            folder / _need("[mesh]", options, "path", str),
            spacing=_need("[mesh]", options, "spacing", float),
            scale=float(options.get("scale", 1.0)),
        )
        fitted = f"fitted to the surface: gap at most {1e3 * fit.gap:.2g} mm, volume {100 * fit.volume:.1f} % of it"
        return fit.mesh, (fitted, *fit.notes)
    if kind not in makers:
        raise InputError(f"[mesh] kind: {_choice(kind, [*makers, 'file', 'surface'])}")
    import inspect

    parameters = inspect.signature(makers[kind]).parameters
    _known("[mesh]", options, tuple(parameters))
    for key, value in options.items():
        like(f"[mesh] {key}", value, parameters[key].default)
    return makers[kind](**options), ()


def _material(name: str, table: Mapping[str, Any]) -> Material:
    where = f"[material.{name}]"
    law = _need(where, table, "law", str)
    if law not in _LAWS:
        raise InputError(f"{where} law: {_choice(law, list(_LAWS))}")
    keys = _CONSTANTS.get(law, ("young", "poisson", "density"))
    options = {k: v for k, v in table.items() if k != "law"}
    _known(where, options, keys)
    for key in keys[:2]:
        _need(where, table, key, float)
    try:
        return _LAWS[law](**options)
    except InputError as error:
        raise InputError(f"{where} {error.message}") from error


def _set(mesh: HexMesh, name: str, table: Mapping[str, Any]) -> NDArray[np.int32]:
    where = f"[sets.{name}]"
    _known(where, table, ("of", "above", "below"))
    nodes = mesh.node_set(str(table.get("of", "surface")))
    for key, sign in (("above", 1.0), ("below", -1.0)):
        for axis, value in table.get(key, {}).items():
            nodes = nodes[sign * mesh.nodes[nodes, _axis(where, axis)] >= sign * float(value) - 1e-9 * mesh.size]
    if len(nodes) == 0:
        raise InputError(f"{where} holds no node")
    return nodes


def _step(number: int, table: Mapping[str, Any]) -> Step:
    name = str(table.get("name", f"step {number + 1}"))
    where = f"[[step]] '{name}'"
    _known(where, table, _STEP_KEYS)
    centrifugal = table.get("centrifugal")
    if centrifugal is not None:
        _known(f"{where} centrifugal", centrifugal, tuple(f.name for f in fields(Centrifugal)))
    loads = Loads(
        gravity=three_numbers(f"{where} gravity", table.get("gravity", (0.0, 0.0, 0.0))),
        centrifugal=None if centrifugal is None else Centrifugal(**centrifugal),
        pressure=table.get("pressure", {}),
        traction=table.get("traction", {}),
        forces=table.get("force", {}),
    )
    instants = whole(f"{where} instants", table.get("instants", 1), least=1)
    free = one_of(f"{where} free", table.get("free", "hold"), FREE)
    return Step(name, loads, tuple(table.get("prescribed", ())), instants, free)


def _prescribed(mesh: HexMesh, entry: Mapping[str, Any]) -> Prescribed:
    _known("prescribed", entry, ("where", "x", "y", "z", "onto"))
    where = str(_need("prescribed", entry, "where", str))
    moves = {axis: float(entry[axis]) for axis in "xyz" if axis in entry}
    if "onto" not in entry:
        return prescribe(mesh, where, **moves)
    nodes = mesh.node_set(where)
    target = np.full((len(nodes), 3), np.nan)
    for axis, value in entry["onto"].items():
        column = _axis("prescribed onto", axis)
        target[:, column] = float(value) - mesh.nodes[nodes, column]
    for axis, value in moves.items():
        target[:, _axis("prescribed", axis)] = value
    return prescribe(mesh, nodes, displacement=target)


def _axis(where: str, name: str) -> int:
    if name not in ("x", "y", "z"):
        raise InputError(f"{where}: want x, y or z, got '{name}'")
    return "xyz".index(name)


def _known(where: str, table: Mapping[str, Any], keys: tuple[str, ...]) -> None:
    for key in table:
        if key not in keys:
            raise InputError(f"{where}: {_choice(key, list(keys))}")


def _choice(word: str, known: list[str]) -> str:
    close = get_close_matches(word, known, n=1)
    hint = f", did you mean '{close[0]}'?" if close else ";"
    return f"unknown '{word}'{hint} There are: {', '.join(known)}"


def _need(where: str, table: Mapping[str, Any], key: str, kind: type) -> Any:
    if key not in table:
        raise InputError(f"{where}: '{key}' is missing")
    value = table[key]
    if kind is float and isinstance(value, int):
        value = float(value)
    if not isinstance(value, kind):
        names = {dict: "a table", list: "an array of tables", str: "a text", float: "a number"}
        raise InputError(f"{where} {key}: want {names[kind]}, got {value!r}")
    return value
