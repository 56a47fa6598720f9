"""The pages that follow from the code: tables' columns, written where `tables.md` asks for them, and the API's names.

python docs/make_tables.py             # a test says when it is due
"""

from __future__ import annotations

import re
from pathlib import Path

import warpjld as wj

REFERENCE = Path(__file__).resolve().parent / "reference"
_GROUP = re.compile(r"^    # (?P<title>.+)$|^    \"(?P<name>\w+)\":", re.M)
_TITLES = {
    "rigs": "Rigs and skeletons",
    "motion": "Motion",
    "covering": "Covering",
    "files": "Files",
    "grasping": "Objects and grasps",
    "contact": "Contact",
    "scripts and studies": "Scripts and studies",
    "errors": "Errors",
}
_RESULTS = {
    "motion.load": ["LoadedMotion"],
    "geometry.surface": ["Surface"],
    "covering.calibrate": ["Calibration"],
    "batch.deform": ["ClipFiles"],
    "baking.baked": ["Baked"],
    "grasp.close_hand": ["ClosedHand"],
    "grasp.auto": ["AutoGrasp"],
    "grasp.judge": ["Verdict"],
    "simulation.simulate": ["Simulation"],
    "simulation.report.verdict": ["ContactVerdict"],
    "simulation.report.table": ["ContactRow"],
    "study.run": ["StudyResult"],
    "study.rerun": ["Rerun"],
}
"""What functions return: to read, not to make."""


def tables() -> dict[str, str]:
    """Tables of columns by the name of their place in the page."""
    from warpjld.simulation.report.tactile_files import TACTILE_COLUMNS
    from warpjld.study.columns import COMMON_COLUMNS
    from warpjld.study.grasping.columns import GRASP_COLUMNS, PRESSED_COLUMNS

    studies = {"study": _table((*COMMON_COLUMNS, *GRASP_COLUMNS)), "pressed": _table(PRESSED_COLUMNS)}
    return {"tactile": _table(TACTILE_COLUMNS), **studies}


def _table(columns: tuple) -> str:
    rows = [f"| `{one.name}` | {one.kind} | {one.unit} | {one.about} |" for one in columns]
    return "\n".join(["| column | kind | unit | what it is |", "|---|---|---|---|", *rows])


def filled(text: str, parts: dict[str, str]) -> str:
    """A page with what stands between its marks replaced."""
    for name, part in parts.items():
        pattern = re.compile(rf"(<!-- {name} -->\n).*?(<!-- /{name} -->)", re.S)
        text, count = pattern.subn(lambda match, part=part: f"{match[1]}{part}\n{match[2]}", text)
        assert count == 1, f"no place for {name}"
    return text


def api() -> str:
    """The page of the library's names."""
    source = Path(wj.__file__).read_text(encoding="utf-8")
    source = source[source.index("_WHERE = {") : source.index("_MODULES = {")]
    lines = [
        "# Names of the library",
        "",
        "`import warpjld as wj`: these are all; what lies in modules besides is how it is done, and may change.",
        "Angles are radians, lengths metres, forces newtons, pressures pascals; arrays are (frames, …); Y is up.",
        "`warpjld.fem` (finite elements), `warpjld.render` (pictures) and `warpjld.shapes` (objects) are modules.",
    ]
    for match in _GROUP.finditer(source):
        if match["title"]:
            lines += ["", f"## {_TITLES[match['title']]}", ""]
        else:
            lines += _entry(f"warpjld.{match['name']}", getattr(wj, match["name"]))
    for title, name in (("Built-in objects", "shapes"), ("Pictures", "render"), ("Finite elements", "fem")):
        module = getattr(wj, name)
        lines += ["", f"## {title}: `warpjld.{name}`", ""]
        for one in module.__all__:
            found = getattr(module, one)
            if callable(found) and found.__module__.startswith("warpjld"):  # an alias of an array is none
                lines += _entry(f"{module.__name__}.{one}", found)
    lines += ["", "## Results", "", "What functions return; read their attributes.", ""]
    for where, names in _RESULTS.items():
        for one in names:
            lines += _entry(f"warpjld.{where}.{one}", type)
    return "\n".join(lines) + "\n"


def _entry(path: str, found: object) -> list[str]:
    kind = "autoexception" if isinstance(found, type) and issubclass(found, Exception) else None
    kind = kind or ("autoclass" if isinstance(found, type) else "autofunction")
    members = [":members:"] if kind == "autoclass" else []
    return ["```{eval-rst}", f".. {kind}:: {path}", *(f"   {line}" for line in members), "```"]


def pages() -> dict[Path, str]:
    """What every page made here should hold."""
    columns = REFERENCE / "tables.md"
    return {columns: filled(columns.read_text(encoding="utf-8"), tables()), REFERENCE / "api.md": api()}


if __name__ == "__main__":
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")
        print(path)
