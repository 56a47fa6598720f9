"""The kernels compile for CUDA as they are; no GPU is needed for that, only the compiler that comes with Warp."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path

import pytest
import warp as wp
import warpjld_kernels

_MODULES = [m.name for m in pkgutil.iter_modules(warpjld_kernels.__path__)]


@pytest.mark.slow
@pytest.mark.parametrize("name", _MODULES)
def test_compiles_for_cuda(name: str, tmp_path: Path) -> None:
    wp.init()
    module = importlib.import_module(f"warpjld_kernels.{name}")
    if not wp.get_module(module.__name__).kernels:
        pytest.skip(f"{name} holds functions only")
    try:
        wp.compile_aot_module(module, arch=[90], module_dir=str(tmp_path), use_ptx=True)
    except RuntimeError as error:
        if "CUDA" in str(error) and "compil" not in str(error):
            pytest.skip(f"this build of Warp has no CUDA compiler: {error}")
        raise
    assert list(tmp_path.glob("*.ptx"))
