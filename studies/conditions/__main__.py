"""Draw the picture of a group of conditions to ``docs/domain/``.

``python -m studies.conditions wind`` calls ``draw(folder)`` of ``studies/conditions/wind.py``.
"""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path

HERE = Path(__file__).parent
FOLDER = HERE.parents[1] / "docs" / "domain"


def main() -> None:
    """Draw the groups that the command line names."""
    known = sorted(file.stem for file in HERE.glob("*.py") if not file.stem.startswith("_"))
    parser = argparse.ArgumentParser(prog="python -m studies.conditions", description=__doc__)
    parser.add_argument("names", nargs="+", choices=known, metavar="NAME", help=", ".join(known))
    FOLDER.mkdir(exist_ok=True)
    for name in parser.parse_args().names:
        importlib.import_module(f"studies.conditions.{name}").draw(FOLDER)


if __name__ == "__main__":
    main()
