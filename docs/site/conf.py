"""Settings of Sphinx, which makes a site with a search of the pages: `make docs`."""

from __future__ import annotations

import re
from typing import Any

PAGES = (
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "ARCHITECTURE.md",
    "docs/*.md",
    "docs/**/*.md",
)
CONTENTS = "docs/index"

project = "pytest-garl"
author = "The pytest-garl developers"
root_doc = CONTENTS
include_patterns = [*PAGES]
extensions = ["myst_parser"]
html_theme = "furo"
html_title = project
html_show_sphinx = False
html_copy_source = False
html_extra_path = ["start"]
# A heading is linked to as on GitHub.
myst_heading_anchors = 4


def with_contents(app: Any, page: str, text: list[str]) -> None:
    """Give the index a table of contents that Sphinx reads: its own lists of pages."""
    if page != CONTENTS:
        return
    first, *parts = re.split(r"^## ", text[0], flags=re.MULTILINE)
    for part in (first.replace("# Documentation of pytest-garl", "Start", 1), *parts):
        title, _, rest = part.partition("\n")
        pages = dict.fromkeys(re.findall(r"\]\(([^)#]+\.md)[)#]", rest))
        text[0] += f"\n```{{toctree}}\n:hidden:\n:caption: {title}\n\n"
        text[0] += "\n".join(pages) + "\n```\n"


def setup(app: Any) -> None:
    """Register what this file adds to Sphinx."""
    app.connect("source-read", with_contents)
