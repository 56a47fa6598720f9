"""How the house is kept: no two public names alike, no long files, no long functions."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
LONGEST_FILE = 350
LONGEST_FUNCTION = 60
"""Lines of code, docstring and signature aside."""


def files() -> Iterator[Path]:
    for room in ("warpjld", "kernels"):
        yield from sorted((ROOT / room).rglob("*.py"))


class Module(NamedTuple):
    """What a file has; not its syntax tree, a million objects for all of them."""

    path: str
    public: set[str]
    functions: list[tuple[int, str, int]]


@cache
def modules() -> list[Module]:
    out = []
    for path in files():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        found = [(one.lineno, one.name, body_lines(one)) for one in functions(tree)]
        out.append(Module(str(path.relative_to(ROOT)), public(tree) & defined(tree), found))
    return out


def functions(tree: ast.AST) -> Iterator[ast.FunctionDef]:
    """Those in statements, however deep: expressions have none."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef):
            yield node
        if isinstance(node, ast.stmt | ast.excepthandler | ast.match_case):
            yield from functions(node)


def defined(tree: ast.Module) -> set[str]:
    """Names that a module makes itself, not those that it imports."""
    names = set()
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        targets = (
            node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        )
        names.update(target.id for target in targets if isinstance(target, ast.Name))
    return names


def public(tree: ast.Module) -> set[str]:
    """What ``__all__`` lists; nothing where it is computed."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == "__all__" for t in node.targets):
            return set(ast.literal_eval(node.value)) if isinstance(node.value, ast.List) else set()
    return set()


def test_no_two_public_names_are_alike() -> None:
    where = defaultdict(list)
    for module in modules():
        for name in module.public:
            where[name].append(module.path)
    assert sum(len(module.functions) for module in modules()) > 3000
    assert len(where) > 1000
    assert {name: paths for name, paths in where.items() if len(paths) > 1} == {}


def test_no_file_is_long() -> None:
    lengths = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8").count("\n") for path in files()}
    assert {path: lines for path, lines in lengths.items() if lines > LONGEST_FILE} == {}


def body_lines(function: ast.FunctionDef) -> int:
    body = function.body
    if isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
        body = body[1:]
    return (function.end_lineno or 0) - body[0].lineno + 1 if body else 0


def test_no_function_is_long() -> None:
    long = {
        f"{module.path}:{line} {name}": lines
        for module in modules()
        if module.path.startswith("warpjld")
        for line, name, lines in module.functions
        if lines > LONGEST_FUNCTION
    }
    assert long == {}
