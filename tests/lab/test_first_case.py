"""The way from nothing to the first case, with commands that take no time."""

from __future__ import annotations

from pathlib import Path

import pytest

from lab.first_case import SEARCH, STEPS, FirstCase, first_case, table

README = Path(__file__).parents[2] / "README.md"
PYTHON = """#!/bin/sh
mkdir -p "$3/bin"
printf '#!/bin/sh\\necho Python 3.99.1\\n' > "$3/bin/python"
chmod +x "$3/bin/python"
head -c 2000000 /dev/zero > "$3/package"
"""
FOUND = """mkdir -p scenarios/regressions/mine && touch scenarios/regressions/mine/one.toml
python > version; echo "ledger: .garl/ledger.sqlite  results 0123abcd"; exit 1"""


@pytest.fixture
def python(tmp_path: Path) -> str:
    """Return an interpreter that makes an environment of two megabytes."""
    file = tmp_path / "python"
    file.write_text(PYTHON)
    file.chmod(0o755)
    return str(file)


def test_a_way_tells_times_size_cases_and_the_hash(python: str, tmp_path: Path) -> None:
    found = first_case(python, tmp_path, (("install", "sleep 0.1"), ("search", FOUND)))
    assert (found.python, found.cases, found.results) == ("3.99.1", 1, "0123abcd")
    assert found.megabytes == pytest.approx(2, abs=0.01)
    clock, cpu = found.seconds["install"]
    assert clock >= 0.1 > cpu
    assert (tmp_path / "project" / "version").read_text() == "Python 3.99.1\n"


def test_a_step_that_fails_ends_the_way(python: str, tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match=r"garl check.*status 127"):
        first_case(python, tmp_path, (("check", "garl check nothing"),))


def test_the_table_has_a_column_for_each_step() -> None:
    way = FirstCase(
        python="3.12.1",
        seconds={"install": (46.2, 30.1), "search": (158.0, 120.0)},
        megabytes=837.4,
        cases=4,
        results="93ab",
    )
    assert table([way]).splitlines() == [
        "| Python | megabytes | install, s (of CPU) | search, s (of CPU) | cases | results |",
        "| --- | ---: | ---: | ---: | ---: | --- |",
        "| 3.12.1 | 837 | 46 (30) | 158 (120) | 4 | 93ab |",
    ]


def test_the_steps_are_those_of_the_readme() -> None:
    text = README.read_text()
    _, init, check, search = (command for _, command in STEPS)
    assert all(f"    {' '.join(command.split()[:2])} " in text for command in (init, check))
    assert search == SEARCH
    assert search.partition("=")[0] in text
