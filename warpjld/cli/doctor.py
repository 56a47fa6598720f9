"""``warpjld doctor``: report what is installed, what works here, and what is missing."""

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

__all__ = ["doctor_command"]

_REQUIREMENT = re.compile(r"^(?P<name>[\w.-]+)\s*(?P<version>[^;]*?)\s*(?:;.*extra == ['\"](?P<extra>\w+)['\"].*)?$")
_GATHERED = ("all", "dev", "docs")
"""Extras that combine others, or are for developers."""


@click.command("doctor")
@click.option("--no-picture", is_flag=True, help="Do not try to draw.")
@options.json
def doctor_command(no_picture: bool, as_json: bool) -> None:
    """Report what is installed and works here: versions, devices, drawing, extras, caches; and what is missing.

    The exit code is 1 if something that every installation needs does not work.
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
    """Installed versions of required packages, and by extra of optional ones; None where not installed."""
    required: dict[str, str | None] = {}
    extras: dict[str, dict[str, str | None]] = {}
    for line in metadata.requires("warpjld") or ():
        match = _REQUIREMENT.match(line)
        if match is None:  # an extra that refers to other extras of this package
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
    """Devices that kernels can run on."""
    import warp as wp

    return [f"{device.alias}: {device.name}" for device in wp.get_devices()]


def _drawing() -> str:
    """Test whether a picture can be rendered off screen; the result as text."""
    import numpy as np

    from warpjld.render import Camera, shaded

    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    try:
        picture = shaded(corners, faces, Camera.view("front", corners), size=(64, 48))
    except Exception as error:  # any failure of a driver is reported
        return f"failed: {type(error).__name__}: {error}"
    return "works off screen" if np.ptp(picture) else "failed: the picture is empty"


def _caches() -> dict[str, dict[str, Any]]:
    """Cache folders and their sizes."""
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
    above = next((parent for parent in (folder, *folder.parents) if parent.exists()), folder)
    return {"folder": str(folder), "bytes": size, "writable": os.access(above, os.W_OK)}


def _missing(found: dict[str, Any]) -> list[dict[str, Any]]:
    """What does not work, and how to fix it."""
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
            "what": f"{what} cannot be kept in {cache['folder']}",
            "needed": False,
            "do": "set it to a writable folder",
        }
        for what, cache in found["caches"].items()
        if cache["folder"] is not None and not cache["writable"]
    ]
    return problems


def _tell(found: dict[str, Any], missing: list[dict[str, Any]]) -> None:
    click.echo(f"warpjld {found['warpjld']}, Python {found['python']}, {found['cores']} cores")
    click.echo(f"in {Path(__file__).resolve().parents[1]}, run by {sys.executable}")
    click.echo("libraries: " + ", ".join(f"{name} {version}" for name, version in found["libraries"].items()))
    click.echo("devices:   " + "; ".join(found["devices"]))
    click.echo("drawing:   " + found["drawing"])
    for extra, packages in found["extras"].items():
        listed = ", ".join(f"{name} {version or 'is not installed'}" for name, version in packages.items())
        click.echo(f"extra {extra:8} {listed}")
    for what, cache in found["caches"].items():
        where = "off" if cache["folder"] is None else f"{cache['folder']}, {cache['bytes'] / 1e6:.0f} MB"
        click.echo(f"kept {what}: {where}")
    for problem in missing:
        click.echo(f"{'missing' if problem['needed'] else 'optional'}: {problem['what']}: {problem['do']}")
    if not missing:
        click.echo("nothing is missing")
