"""Configuration of the guide: ``sphinx-build -W -c studies/site studies build/site``.

The sources are the pages of this folder, the README of every study beside it and the docstrings of the package.
"""

from __future__ import annotations

import re
from pathlib import Path

import etc_engine
from etc_engine.models import CATALOGUE

STUDIES = Path(__file__).parents[1]
NOTEBOOKS = STUDIES / "site" / "notebooks"
OUTSIDE = {"CHANGELOG.md": "changelog", "tests/VALIDATION.md": "validation", "jobs/README.md": "cluster"}
"""Files above the sources, and the page of this folder that includes each."""

project = "etc_engine"
author = "the etc_engine authors"
copyright = author
release = version = etc_engine.__version__

root_doc = "site/index"
extensions = ["myst_parser", "numpydoc", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
exclude_patterns = ["**/__pycache__"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
nitpicky = False

html_theme = "alabaster"
html_theme_options = {"description": "Effective thermal conductivity of particle systems", "page_width": "1100px"}
html_show_sourcelink = False

myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3

autodoc_typehints = "none"  # the docstrings name shapes and units
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False


def gallery() -> str:
    """Return one row per study: its picture, its title and its question."""
    rows = []
    for page in sorted(STUDIES.glob("*/README.md")):
        text = page.read_text()
        title = re.search(r"^# (.*)", text, re.M)
        image = re.search(r"!\[(.*?)\]\((\S+?\.png)\)", text)
        if title and image:
            name = page.parent.name
            rows.append(f"| [{title[1]}](../{name}/README.md) | ![{image[1]}](../{name}/{image[2]}) |")
    return "\n".join(["| study | result |", "| --- | --- |", *rows])


def study_keys() -> str:
    """Return the keys of study files, as the README of the studies lists them."""
    text = (STUDIES / "README.md").read_text()
    part = text[text.index("## Study files") : text.index("## From a sweep")].partition("\n")[2]
    return re.sub(r"\]\((?![#/.]|https?:)", "](../", part)


def models() -> str:
    """Return one row per conductivity model: its name, where it holds and its source."""
    rows = []
    for name, model in CATALOGUE.items():
        where = ", ".join(f"{d}D" for d in model.dimensions)
        rows.append(f"| `{name}` | {where} | {model.kind} | {model.reference} |")
    return "\n".join(["| model | holds in | kind | source |", "| --- | --- | --- | --- |", *rows])


def notebook(path: Path) -> str:
    """Return a notebook in percent format as a page: its words, and its code in fences."""
    _, *parts = re.split(r"^# %%(.*)\n", path.read_text(), flags=re.M)
    page = []
    for kind, body in zip(parts[::2], parts[1::2], strict=True):
        if "[markdown]" in kind:
            page.append(re.sub(r"^# ?", "", body.strip(), flags=re.M))
        else:
            page.append(f"```python\n{body.strip()}\n```")
    return "\n\n".join(page)


MADE = {"<!-- gallery -->": gallery, "<!-- study keys -->": study_keys, "<!-- models -->": models}
"""Marks on pages, and what takes their place."""


def without_bars(lines: list[str]) -> list[str]:
    """Escape the bars of absolute values, which mean substitutions in reStructuredText, outside of literal text."""
    out, literal = [], -1  # indentation of the line that opened a literal block
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if literal >= 0 and line.strip() and indent <= literal:
            literal = -1
        if literal < 0 and not line.lstrip().startswith(">>>"):
            parts = re.split(r"(``.*?``)", line)
            line = "".join(part if part.startswith("``") else part.replace("|", r"\|") for part in parts)  # noqa: PLW2901
            if line.rstrip().endswith("::") or line.lstrip().startswith(".. math::"):
                literal = indent
        out.append(line)
    return out


def literal_formulas(app: object, what: str, name: str, thing: object, options: object, lines: list[str]) -> None:
    """Set the indented formulas above the first section of a docstring as they stand."""
    title = next((i for i, line in enumerate(lines) if re.fullmatch(r"-{3,}", line.strip())), len(lines) + 1) - 1
    out: list[str] = []
    for i, line in enumerate(lines):
        starts = line.startswith("  ") and i < title and i > 0 and not lines[i - 1].strip()
        previous = next((text for text in reversed(out) if text.strip()), "")
        if starts and not previous.startswith(("  ", "..", "- ", "* ")) and not previous.endswith("::"):
            out += ["::", ""]
        out.append(line)
    lines[:] = without_bars(out)


def fill(app: object, name: str, source: list[str]) -> None:
    """Put what is made into its places; turn links that leave the sources to pages that hold their target."""
    for mark, make in MADE.items():
        if mark in source[0]:
            source[0] = source[0].replace(mark, make())
    source[0] = re.sub(r"<!-- notebook (\w+) -->", lambda found: notebook(NOTEBOOKS / f"{found[1]}.py"), source[0])
    for path, page in OUTSIDE.items():
        source[0] = re.sub(rf"\]\((\.\./)+{re.escape(path)}(#[\w-]*)?\)", rf"](/site/{page}.md\2)", source[0])


def setup(app: object) -> None:
    """Register both with Sphinx."""
    app.connect("source-read", fill)  # type: ignore[attr-defined]
    app.connect("autodoc-process-docstring", literal_formulas, priority=100)  # type: ignore[attr-defined]
