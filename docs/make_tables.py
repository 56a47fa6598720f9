"""Write the pages that are made from the code: tables of columns, between the marks of a page, and the API's names.

python docs/make_tables.py             # a test fails when a page is out of date
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
    "grasp.find_grasp": ["AutoGrasp"],
    "grasp.judge": ["Verdict"],
    "simulation.simulate": ["Simulation"],
    "simulation.report.verdict": ["ContactVerdict"],
    "simulation.report.table": ["ContactRow"],
    "study.run": ["StudyResult"],
    "study.rerun": ["Rerun"],
}
"""Types that functions return and callers only read."""


def tables() -> dict[str, str]:
    """Tables of columns, by the name of their marks in a page."""
    from warpjld.simulation.report.tactile_files import TACTILE_COLUMNS
    from warpjld.study.columns import COMMON_COLUMNS
    from warpjld.study.grasping.columns import GRASP_COLUMNS, PRESSED_COLUMNS

    studies = {"study": _table((*COMMON_COLUMNS, *GRASP_COLUMNS)), "pressed": _table(PRESSED_COLUMNS)}
    return {"tactile": _table(TACTILE_COLUMNS), **studies}


def _table(columns: tuple) -> str:
    rows = [f"| `{one.name}` | {one.kind} | {one.unit} | {one.about} |" for one in columns]
    return "\n".join(["| column | kind | unit | what it is |", "|---|---|---|---|", *rows])


def filled(text: str, parts: dict[str, str]) -> str:
    """A page with the text between its marks replaced."""
    for name, part in parts.items():
        pattern = re.compile(rf"(<!-- {name} -->\n).*?(<!-- /{name} -->)", re.S)
        text, count = pattern.subn(lambda match, part=part: f"{match[1]}{part}\n{match[2]}", text)
        assert count == 1, f"no marks for {name}"
    return text


def api() -> str:
    """Page of the public names of the library."""
    source = Path(wj.__file__).read_text(encoding="utf-8")
    source = source[source.index("_WHERE = {") : source.index("_MODULES = {")]
    lines = [
        "# Names of the library",
        "",
        "`import warpjld as wj`: these are all public names. Anything else in the modules may change.",
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
    """Text of every page made here, by path."""
    columns, study = REFERENCE / "tables.md", REFERENCE / "grasp-study.md"
    parts = tables()
    return {
        columns: filled(columns.read_text(encoding="utf-8"), parts),
        study: filled(study.read_text(encoding="utf-8"), {"study": parts["study"]}),
        REFERENCE / "api.md": api(),
    }


if __name__ == "__main__":
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")
        print(path)
