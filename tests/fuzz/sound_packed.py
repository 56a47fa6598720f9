"""Sound packages, volume meshes and folders of studies, and what reads each: see ``tests.fuzz.sound``."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest import mock

import numpy as np

from tests.study.dice import Dice
from warpjld.errors import InputError
from warpjld.grasp.object_file import load_object
from warpjld.study import run_study
from warpjld.study.pool import TrialWork

__all__ = ["PACKED"]

_DICE = Dice(trials=6)
_KEPT = ("table.csv", "columns.json", "poses.npz")
"""What is the same however often a study was stopped, and whatever of its trials was damaged."""
_TWICE = """<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
 <resources>
  <object id="1" type="model"><mesh>
   <vertices>VERTICES</vertices><triangles>TRIANGLES</triangles>
  </mesh></object>
  <object id="2" type="model"><components>
   <component objectid="1"/><component objectid="1" transform="1 0 0 0 1 0 0 0 1 80 0 0"/>
  </components></object>
 </resources>
 <build><item objectid="2"/></build>
</model>
"""


def _usdz(path: Path) -> None:
    from pxr import UsdUtils

    from tests.fuzz.sound import KINDS

    KINDS["a.usdc"][0](path.with_suffix(".usdc"))
    UsdUtils.CreateNewUsdzPackage(str(path.with_suffix(".usdc")), str(path))


def _usd(path: Path) -> object:
    from tests.fuzz.sound import KINDS

    return KINDS["a.usdc"][1](path)


def _3mf(path: Path) -> None:
    """A box, twice, as slicers write it."""
    import trimesh

    box = trimesh.creation.box((50.0, 60.0, 70.0))
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in box.vertices)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in box.faces)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("3D/3dmodel.model", _TWICE.replace("VERTICES", vertices).replace("TRIANGLES", triangles))


def _volume(path: Path) -> None:
    import meshio
    import trimesh

    box = trimesh.creation.box((0.05, 0.06, 0.07))
    meshio.Mesh(np.asarray(box.vertices), [("triangle", np.asarray(box.faces))]).write(path)


@cache
def _study() -> dict[str, bytes]:
    """The files of a finished study, by name."""
    with TemporaryDirectory() as folder, _here():
        run_study(_DICE, folder, processes=1, table="csv")
        return {
            path.relative_to(folder).as_posix(): path.read_bytes()
            for path in sorted(Path(folder).rglob("*"))
            if path.name == "study.json" or path.name in _KEPT or path.parent.parent.name == "trials"
        }


def _folder(path: Path) -> None:
    """The folder of a study as an archive, so that damage hits any file of it."""
    with zipfile.ZipFile(path, "w") as file:
        for name, content in _study().items():
            file.writestr(name, content)


def _resumed(path: Path) -> object:
    """The study goes on in the damaged folder: its results are those of an undisturbed one, or it is refused."""
    folder = path.with_name("study-folder")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    try:
        with zipfile.ZipFile(path) as file:
            if sum(member.file_size for member in file.infolist()) > 1 << 28:
                raise InputError("a larger folder than can be unpacked here")
            file.extractall(folder)
    except InputError:
        raise
    except Exception:
        raise InputError("no folder any more") from None
    with _here():
        run_study(_DICE, folder, processes=1, table="csv")
    for name in _KEPT:
        assert (folder / name).read_bytes() == _study()[name], f"{name} is not that of an undisturbed study"
    return None


@contextmanager
def _here() -> Iterator[None]:
    """Trials are run in this process, and without a summary's pictures: neither reads what is damaged."""

    def trials(experiment: Dice, trials: list[int], folder: Path, *, processes: int, done: Callable) -> None:
        work = TrialWork(experiment, folder)
        for trial in trials:
            done(trial, work.do(trial))

    with mock.patch("warpjld.study.run.run_trials", trials), mock.patch("warpjld.study.run.write_summary", _no_summary):
        yield


def _no_summary(*_: object) -> list[Path]:
    return []


def _loaded(path: Path) -> object:
    return load_object(path)


PACKED: dict[str, tuple[Callable[[Path], None], Callable[[Path], object]]] = {
    "a.usdz": (_usdz, _usd),
    "study.zip": (_folder, _resumed),
    **{f"object.{kind}": (_volume, _loaded) for kind in ("vtk", "vtu", "mesh", "inp", "nas")},
}
"""How a sound file of each kind is written, and what reads it."""
if find_spec("lxml") is not None and find_spec("networkx") is not None:
    PACKED["object.3mf"] = (_3mf, _loaded)
