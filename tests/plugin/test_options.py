from __future__ import annotations

import pytest

from tests.plugin.test_plugin import CONFTEST, project, run

NOTES_SEEDS = """
from pathlib import Path
from pytest_garl.plugin import options

read_options = options.read_options

def noting(config):
    found = read_options(config)
    with Path("seeds.txt").open("a") as file:
        print(found.seed, file=file)
    return found

options.read_options = noting
"""


def seeds(pytester: pytest.Pytester) -> list[str]:
    """Return the seed of each time that the options were read."""
    return (pytester.path / "seeds.txt").read_text().split()


def test_a_search_reads_options_once_and_draws_one_seed(pytester: pytest.Pytester) -> None:
    project(pytester)
    pytester.makeconftest(CONFTEST + NOTES_SEEDS)
    result = run(pytester, "--garl-budget=1", "--garl-workers=0", "--garl-seed=random")
    [seed] = seeds(pytester)
    result.stdout.fnmatch_lines([f"*seed {seed},*"])


def test_marked_tests_share_the_options_of_their_session(pytester: pytest.Pytester) -> None:
    project(pytester)
    pytester.makeconftest(CONFTEST + NOTES_SEEDS)
    run(pytester).assert_outcomes(skipped=3)
    assert seeds(pytester) == ["0"]


def test_workers_of_xdist_take_the_seed_that_their_controller_drew(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    pytester.makeconftest(CONFTEST + NOTES_SEEDS)
    run(pytester, "-n2", "--garl-budget=1", "--garl-seed=random")
    assert len(seeds(pytester)) == 3
    assert len(set(seeds(pytester))) == 1
