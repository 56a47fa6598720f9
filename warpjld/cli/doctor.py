"""``warpjld doctor``: what is installed, what it can do here, and what is missing."""

from __future__ import annotations

import os
import platform
import re
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

import click

from warpjld import __version__
from warpjld.cli import options
from warpjld.errors import WarpjldError

__all__ = ["command"]

_REQUIREMENT = re.compile(r"^(?P<name>[\w.-]+)\s*(?P<version>[^;]*?)\s*(?:;.*extra == ['\"](?P<extra>\w+)['\"].*)?$")
_GATHERED = ("all", "dev", "docs")
"""Extras that gather others, or are for people who change the program."""


@click.command("doctor")
@click.option("--no-picture", is_flag=True, help="Do not try to draw.")
@options.json
def command(no_picture: bool, as_json: bool) -> None:
    """Say what is installed and what works here: versions, devices, drawing, extras, caches; and what is missing.

    The exit code is 1 where something does not work that every installation has.
    """
    from warpjld.cli.answer import answer
    from warpjld.runtime.quiet import silence_warp

    silence_warp()
    required, extras = _requirements()
    found = {
        "warpjld": __version__,
        "python": f"{platform.python_version()} on {platform.platform(terse=True)} {platform.machine()}",
        "cores": os.cpu_count(),
        "libraries": required,
        "devices": _devices(),
        "drawing": "not tried" if no_picture else _drawing(),
        "extras": extras,
        "caches": _caches(),
    }
    missing = _missing(found)
    if as_json:
        answer({**found, "missing": missing})
    else:
        _tell(found, missing)
    if any(problem["needed"] for problem in missing):
        raise WarpjldError("something that every installation needs does not work")


def _requirements() -> tuple[dict[str, str | None], dict[str, dict[str, str | None]]]:
    """Installed versions of what is required, and by extra of what is optional; None where it is not installed."""
    required: dict[str, str | None] = {}
    extras: dict[str, dict[str, str | None]] = {}
    for line in metadata.requires("warpjld") or ():
        match = _REQUIREMENT.match(line)
        if match is None:  # an extra that names this package's own
            continue
        name, extra = match["name"], match["extra"]
        if extra in _GATHERED:
            continue
        where = required if extra is None else extras.setdefault(extra, {})
        try:
            where[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            where[name] = None
    return required, extras


def _devices() -> list[str]:
    """What kernels run on."""
    import warp as wp

    return [f"{device.alias}: {device.name}" for device in wp.get_devices()]


def _drawing() -> str:
    """Whether a picture can be drawn off screen, and by what."""
    import numpy as np

    from warpjld.render import Camera, shaded

    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    try:
        picture = shaded(corners, faces, Camera.view("front", corners), size=(64, 48))
    except Exception as error:  # whatever a driver does: it is told, not raised
        return f"failed: {type(error).__name__}: {error}"
    return "works off screen" if np.ptp(picture) else "failed: the picture is empty"


def _caches() -> dict[str, dict[str, Any]]:
    """Folders where things are kept from one run to the next, and how much is in them."""
    import warp as wp

    from warpjld.files.kept_files import kept_folder

    kept = kept_folder()
    folders = {
        "bindings and hands (WARPJLD_CACHE)": kept,
        "kernels (WARP_CACHE_PATH)": Path(wp.config.kernel_cache_dir),
    }
    return {what: _size(folder) for what, folder in folders.items()}


def _size(folder: Path | None) -> dict[str, Any]:
    if folder is None:
        return {"folder": None, "bytes": 0, "writable": False}
    size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file()) if folder.is_dir() else 0
    above = next((one for one in (folder, *folder.parents) if one.exists()), folder)
    return {"folder": str(folder), "bytes": size, "writable": os.access(above, os.W_OK)}


def _missing(found: dict[str, Any]) -> list[dict[str, Any]]:
    """What does not work, and what would mend it."""
    problems: list[dict[str, Any]] = [
        {"what": name, "needed": True, "do": f"pip install {name}"}
        for name, version in found["libraries"].items()
        if version is None
    ]
    if found["drawing"].startswith("failed"):
        what = f"drawing {found['drawing']}"
        do = "install a software renderer, such as the packages libgl1 and libosmesa6 of Debian"
        problems.append({"what": what, "needed": True, "do": do})
    problems += [
        {"what": f"{extra}: {', '.join(packages)}", "needed": False, "do": f"pip install 'warpjld[{extra}]'"}
        for extra, packages in found["extras"].items()
        if None in packages.values()
    ]
    problems += [
        {
            "what": f"{what} cannot be kept in {one['folder']}",
            "needed": False,
            "do": "name a folder that can be written",
        }
        for what, one in found["caches"].items()
        if one["folder"] is not None and not one["writable"]
    ]
    return problems


def _tell(found: dict[str, Any], missing: list[dict[str, Any]]) -> None:
    click.echo(f"warpjld {found['warpjld']}, Python {found['python']}, {found['cores']} cores")
    click.echo(f"in {Path(__file__).resolve().parents[1]}, run by {sys.executable}")
    click.echo("libraries: " + ", ".join(f"{name} {version}" for name, version in found["libraries"].items()))
    click.echo("devices:   " + "; ".join(found["devices"]))
    click.echo("drawing:   " + found["drawing"])
    for extra, packages in found["extras"].items():
        told = ", ".join(f"{name} {version or 'is not installed'}" for name, version in packages.items())
        click.echo(f"extra {extra:8} {told}")
    for what, one in found["caches"].items():
        where = "off" if one["folder"] is None else f"{one['folder']}, {one['bytes'] / 1e6:.0f} MB"
        click.echo(f"kept {what}: {where}")
    for problem in missing:
        click.echo(f"{'missing' if problem['needed'] else 'optional'}: {problem['what']}: {problem['do']}")
    if not missing:
        click.echo("nothing is missing")
