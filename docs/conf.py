"""Sphinx: `sphinx-build -W docs build/docs` makes the pages; nothing here is fetched from elsewhere."""

from __future__ import annotations

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx
from sphinx.highlighting import lexers

import warpjld

project = "warpjld"
author = "The warpjld developers"
copyright = "The warpjld developers, Apache-2.0"
version = release = warpjld.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_click"]
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "reference/names.txt"]
suppress_warnings = ["misc.highlighting_failure", "ref.python"]  # two modules have a Scene: neither is linked

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
napoleon_use_rtype = False
napoleon_use_ivar = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
add_module_names = False

html_theme = "furo"
html_title = f"warpjld {release}"
html_static_path = ["styles"]
html_css_files = ["tables.css"]
html_copy_source = False
html_show_sphinx = False
smartquotes = False


def bars(app: object, what: str, name: str, found: object, options: object, lines: list[str]) -> None:
    """Bars are absolute values in docstrings, not substitutions as reStructuredText has them."""
    for k, line in enumerate(lines):
        if ">>>" not in line and "..." not in line:
            parts = line.split("``")
            lines[k] = "``".join(part.replace("|", "\\|") if n % 2 == 0 else part for n, part in enumerate(parts))


def setup(app: Sphinx) -> None:
    """Words that pages use for code blocks and Pygments does not know; docstrings as they are written here."""
    lexers["mermaid"] = lexers["jld"] = TextLexer()
    app.connect("autodoc-process-docstring", bars)
