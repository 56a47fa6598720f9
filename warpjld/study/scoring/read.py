"""Reading files of grasps; the format is chosen by suffix and content."""

from __future__ import annotations

from pathlib import Path

from warpjld.errors import InputError
from warpjld.study.scoring.channel_table import read_channel_table
from warpjld.study.scoring.dexgraspbench import dexgraspbench_grasps, is_dexgraspbench
from warpjld.study.scoring.given import GivenGrasp
from warpjld.study.scoring.isaac import read_isaac
from warpjld.study.scoring.mano import is_mano_grasp, mano_grasps
from warpjld.study.scoring.meshes import LISTED, read_meshes
from warpjld.study.scoring.own_study import read_own_study, study_tables
from warpjld.study.scoring.pickled_values import read_object_array
from warpjld.study.scoring.reading_grasps import GraspReading

__all__ = ["grasp_files", "read_grasps"]

_READ = (".npy", ".yaml", ".yml", ".csv", ".json")


def read_grasps(path: Path, how: GraspReading) -> list[GivenGrasp]:
    """Grasps of a file, or of all files in a folder and its subfolders, in the order of their names.

    Raises:
        InputError: There are none, or one cannot be used; names the file.
    """
    table = study_tables(path)
    if table is not None:
        return read_own_study(table, how)
    files = grasp_files(path)
    many = len(files) > 1
    return [grasp for file in files for grasp in _read(file, str(file.relative_to(path)) if many else file.stem, how)]


def grasp_files(path: Path) -> list[Path]:
    """The files that are read for a path.

    Raises:
        InputError: There are none.
    """
    table = study_tables(path)
    if table is not None:
        return [table, table.parent / "poses.npz"]
    if not path.is_dir():
        if path.exists() and path.suffix.lower() not in _READ:
            raise InputError(
                f"grasps are not read from '{path.suffix}' files; want one of {', '.join(_READ)}", path=path
            )
        return [path]
    listed = sorted(path.rglob(LISTED))
    if listed:
        return listed
    files = sorted(file for file in path.rglob("*") if file.suffix.lower() in _READ[:-1] and file.is_file())
    if not files:
        raise InputError(f"has no files of grasps ({', '.join(_READ)})", path=path)
    return files


def _read(file: Path, name: str, how: GraspReading) -> list[GivenGrasp]:
    match file.suffix.lower():
        case ".yaml" | ".yml":
            return read_isaac(file, how)
        case ".csv":
            return read_channel_table(file, how)
        case ".json":
            return read_meshes(file, how)
    content = read_object_array(file)
    try:
        if is_dexgraspbench(content):
            return dexgraspbench_grasps(content, name, how)
        if is_mano_grasp(content):
            return mano_grasps(content, name, how)
    except InputError as error:
        raise InputError(error.message, path=file) from None
    raise InputError("want grasp_qpos (DexGraspBench), or a hand with trans, rot and pose (GraspXL)", path=file)
