"""Names that are imported when they are first asked for."""

from __future__ import annotations

import importlib
import subprocess
import sys

import pytest

from warpjld.runtime.lazily import lazy_names


@pytest.mark.parametrize("package", ["warpjld.io", "warpjld.io.caches", "warpjld.motion", "warpjld.batch"])
def test_a_package_has_what_it_lists(package: str) -> None:
    found = importlib.import_module(package)
    assert all(getattr(found, name) is not None for name in found.__all__)
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'nothing'"):
        found.nothing  # noqa: B018


def test_a_name_is_imported_once_and_only_when_it_is_asked_for() -> None:
    program = (
        "import sys, warpjld.motion as motion; assert 'numpy' not in sys.modules; "
        "from warpjld.motion import Key, spline; assert vars(motion)['Key'] is Key; "
        "assert spline.Spline is motion.Spline"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_a_name_that_is_also_a_module_is_refused() -> None:
    with pytest.raises(ValueError, match="source_motion is a module and a name"):
        lazy_names("warpjld.motion.out", {"source_motion": "source_motion"})
