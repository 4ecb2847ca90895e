"""Write the table of the built-in domains into docs/domain.md: ``python -m lab.domain_table``.

The ranges are those of ``pytest_garl/scenarios/domains/*.toml``.
"""

from __future__ import annotations

import re
from pathlib import Path

from pytest_garl.cli.domain_command import range_in_words, ranges_of
from pytest_garl.scenarios.domains.domain import CONDITIONS
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.names import BUILT_IN

PAGE = Path(__file__).parents[1] / "docs" / "domain.md"
BEGIN = "<!-- table of the built-in domains: python -m lab.domain_table -->\n"
ALIKE = re.compile(r"-\d\b")
END = "<!-- end of the table -->\n"


def table() -> str:
    """Return the table in Markdown: a condition a row, a domain a column."""
    domains = {name: domain_named(name) for name in BUILT_IN}
    ranges = {
        name: {key: (low, high) for key, low, high in ranges_of(domain)}
        for name, domain in domains.items()
    }
    lines = [f"| condition | {' | '.join(BUILT_IN)} |", "| --- |" + " --- |" * len(BUILT_IN)]
    for key in CONDITIONS:
        if any(key in each for each in ranges.values()):
            cells = [
                range_in_words(key, *ranges[name][key]) if key in ranges[name] else "–"
                for name in BUILT_IN
            ]
            lines.append(f"| `{ALIKE.sub('-N', key)}` | {' | '.join(cells)} |")
    moved = [each.npc_behaviour for each in domains.values()]
    # Rows of objects that differ by their number only are one.
    return "\n".join([*dict.fromkeys(lines), f"| NPCs at most | {' | '.join(moved)} |"]) + "\n"


def with_table(page: str) -> str:
    """Return the page with the table as it is now."""
    head, begin, rest = page.partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not begin or not end:
        raise SystemExit(f"{PAGE}: found no lines {BEGIN!r} and {END!r}")
    return f"{head}{begin}\n{table()}\n{end}{tail}"


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text()))
