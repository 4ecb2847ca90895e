"""Names of a report's files, and of what stands in it; names from users' code are cut."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from pytest_garl.execution.facts import SearchKey

_UNSAFE = re.compile(r"[^A-Za-z0-9]+")
GENERATOR = "pytest-garl report"
"""The generator that each page names, by which a report is known as one."""
INDEX = "index.html"
KINDS = "kinds"
"""The folder of the pages of kinds."""
STILLS = "stills"
"""The folder of the pictures that others show, such as the summary of a build: one per kind."""
_MOST_CHARS = 60


def page_name(system: str, map: str, search: str, signature: str) -> str:
    """Return the name of a kind's page without ending, the same for the same kind.

    ``search`` is what texts call the search that found it.
    """
    key = SearchKey(system=system, map=map)
    words, identity = f"{key.class_name}-{map}", [system, map, signature]
    if search != key.place:
        words, identity = search, [*identity, search]
    safe = _UNSAFE.sub("-", f"{words}-{signature}").strip("-")[:_MOST_CHARS].rstrip("-")
    digest = hashlib.sha256("\n".join(identity).encode()).hexdigest()
    return f"{safe}-{digest[:6]}"


def page_address(name: str) -> str:
    """Return where a kind's page lies in the folder of a report."""
    return f"{KINDS}/{name}.html"


def still_address(name: str) -> str:
    """Return where a kind's picture lies in the folder of a report."""
    return f"{STILLS}/{name}.jpg"


def shown_file(path: Path) -> str:
    """Return a path as seen from the present folder, so that a report says the same anywhere."""
    here = Path.cwd()
    absolute = path.absolute()
    return str(absolute.relative_to(here) if absolute.is_relative_to(here) else path)
