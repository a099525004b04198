"""How the pages become a site: make docs. Sphinx, MyST and Furo, in an environment of their own."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]

project = "dmpcli"
author = "the dmpcli authors"
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
exclude_patterns: list[str] = []
html_theme = "furo"
html_title = "dmpcli"
html_show_sphinx = False
html_copy_source = False
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
myst_links_external_new_tab = True
suppress_warnings = ["myst.header"]  # pages of the repository may begin anywhere

BESIDE = {
    "contributing": ROOT / "CONTRIBUTING.md",
    "changelog": ROOT / "CHANGELOG.md",
    "sample_runs": ROOT / "sample_runs" / "README.md",
}
"""Pages that lie elsewhere in the repository; their stubs here are written as the site is made."""

HOME = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md"}
HOME |= {"CHANGELOG.md": "changelog.md", "sample_runs/README.md": "sample_runs.md"}
HOME |= {"sample_runs/": "sample_runs.md"}


def _moved(found: re.Match[str], here: Path) -> str:
    """Return a link as it is in the site; of a file that is no page, its name alone."""
    words, target, anchor = found[1], found[2], found[3] or ""
    if re.match(r"[a-z]+:", target) or not target:
        return found[0]
    inside = (here.parent / target).resolve()
    try:
        name = str(inside.relative_to(ROOT)) + ("/" if target.endswith("/") else "")
    except ValueError:
        return found[0]
    if name in HOME:
        return f"[{words}](/{HOME[name]}{'' if HOME[name] == 'index.md' else anchor})"
    if name.startswith("docs/"):
        return f"[{words}](/{name.removeprefix('docs/')}{anchor})"
    return words if words.startswith("`") else f"`{name}`"


def _read(app: object, name: str, source: list[str]) -> None:
    """Take a page from where it lies, and its links to where the site has them."""
    del app
    here = BESIDE.get(name, ROOT / "docs" / f"{name}.md")
    text = here.read_text(encoding="utf-8") if name in BESIDE else source[0]
    pictures = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)#\s]*)(#[^)\s]*)?\)")
    source[0] = pictures.sub(lambda found: _moved(found, here), text)


def setup(app: object) -> None:
    """Register what is above."""
    app.connect("source-read", _read)  # type: ignore[attr-defined]
