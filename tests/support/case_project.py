"""A project with saved cases, for tests that save cases or fly them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from pytest_garl.execution.ledger import Ledger

SEARCH = ("--garl-budget=24", "--garl-workers=0", "--garl-shrink=60")
CASES = ("--garl-workers=0",)
USER_PROPERTY_TEST = """
def test_own(landing, scenario):
    exact = landing.final_distance_m < 0.05
    assert exact or scenario["environment.snow"] < 0.1, "too much snow"
"""


def run(pytester: pytest.Pytester, *args: str) -> pytest.RunResult:
    """Run pytest in a project, by default without a search: it flies only the saved cases."""
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", *(args or CASES))


def cases(pytester: pytest.Pytester) -> list[Path]:
    """Return the files of the saved cases."""
    return sorted((pytester.path / "scenarios" / "regressions" / "systems").glob("*.toml"))


def saved(pytester: pytest.Pytester) -> dict[str, str]:
    """Return the texts of the saved cases by the names of their files."""
    return {path.name: path.read_text() for path in cases(pytester)}


def add_cases_to_git(folder: Path) -> None:
    """Add the project's cases to git's index, so that they are accepted."""
    for command in (["init", "-q"], ["add", "scenarios"]):
        subprocess.run(["git", *command], check=True, cwd=folder)


def violations(pytester: pytest.Pytester) -> list[tuple[int, int, str]]:
    """Return generation, slot and signature of the violations of the last search."""
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    try:
        return [(*row.id.key[1:], row.signature) for row in ledger.queries.violating()]
    finally:
        ledger.close()


def replace_text(path: Path, old: str, new: str) -> None:
    """Replace a text in a file."""
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def let_system_avoid_dog(project: Path) -> None:
    """Fix the landing system: it avoids the dog."""
    replace_text(project / "systems.py", "class Good:\n", "class Good:\n    dodges = True\n")
