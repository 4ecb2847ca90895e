from __future__ import annotations

from pathlib import Path

from pytest_garl.cases.case_file import dump_case, load_case

MOST_BYTES = 3000
"""What a person reads in one go; a saved case of today's searches has 2 to 2.7 kB."""
CASES = Path(__file__).parents[2] / "scenarios" / "regressions"


def test_saved_cases_of_this_repository_are_small() -> None:
    sizes = {
        path.name: len(dump_case(load_case(path)).encode())
        for path in sorted(CASES.glob("*/*.toml"))
    }
    assert sizes
    assert {name: size for name, size in sizes.items() if size > MOST_BYTES} == {}
