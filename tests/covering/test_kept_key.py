"""A kept binding is made anew when any program that binding runs through has changed."""

from __future__ import annotations

import ast
import importlib.util
from collections.abc import Iterable
from pathlib import Path

from warpjld.covering.kept_key import binding_key, binding_sources
from warpjld.rig import Rig

_PACKAGES = ("warpjld", "warpjld_kernels")
_ROOTS = ("warpjld.covering.surface_binding", "warpjld.covering.kept")


def _imported(module: str, file: Path) -> set[str]:
    """Modules of the packages that a file imports anywhere, inside functions too."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{module}: relative import"
            assert node.module is not None
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    # how a covering is shown is no part of binding
    return {n for n in found if n.partition(".")[0] in _PACKAGES and not n.startswith("warpjld.page")}


def _file(module: str) -> Path | None:
    try:
        spec = importlib.util.find_spec(module)
    except ModuleNotFoundError:  # a function or class: not a module
        return None
    return None if spec is None or spec.origin is None else Path(spec.origin)


def modules_reached(roots: Iterable[str]) -> dict[str, Path]:
    """Modules of the packages that these import, directly or not, and their files."""
    reached: dict[str, Path] = {}
    todo = list(roots)
    while todo:
        module = todo.pop()
        file = _file(module)
        if module in reached or file is None:
            continue
        reached[module] = file
        # packages' own files only gather names: what they import is imported by name where it is wanted
        todo += [] if file.name == "__init__.py" else _imported(module, file)
    return reached


def test_every_module_that_binding_runs_through_counts() -> None:
    counted = {file.resolve() for _, file in binding_sources()}
    reached = modules_reached(_ROOTS)
    assert len(reached) > 40
    missing = {module for module, file in reached.items() if file.resolve() not in counted}
    assert missing <= set(_PACKAGES), f"binding imports {sorted(missing)}, of which kept_key.py knows nothing"


def test_all_that_is_given_counts(hands: dict[str, Rig]) -> None:
    hand = hands["left"]
    assert binding_key(hand) == binding_key(hand)
    assert binding_key(hand) != binding_key(hands["right"])
    assert binding_key(hand) != binding_key(hand, domains="skin")
