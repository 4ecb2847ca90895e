from __future__ import annotations

import pytest

from pytest_garl.execution.flight_id import slots
from pytest_garl.plugin.options import population
from tests.support.landing_project import (
    CONFTEST,
    project,
    run,
)


@pytest.mark.parametrize("budget", [1, 7, 8, 9, 40, 79, 80, 160, 200, 400, 401])
def test_a_budget_makes_exactly_so_many_slots(budget: int) -> None:
    names = slots(budget, population(budget))
    assert len(set(names)) == budget
    assert max(slot.index for slot in names) < population(budget) <= 20


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("--garl-budget=0",), "*--garl-budget: found '0', expected a whole number*"),
        (("--garl-budget=many",), "*--garl-budget: found 'many'*"),
        (
            ("--garl-budget=8", "--garl-method=magic"),
            "*--garl-method: found 'magic', expected one*",
        ),
        (
            ("--garl-budget=8", "--garl-method=nowhere:search"),
            "*--garl-method: search method 'nowhere:search': cannot be loaded*",
        ),
        (("--garl-budget=8", "--garl-npcs=magic"), "*--garl-npcs: found 'magic', expected one of*"),
        (("--garl-budget=8", "--garl-npcs=mine.npz"), "*there are no weights at mine.npz*"),
        (("--garl-budget=8", "--garl-repeat=nowhere"), "*--garl-repeat: found 'nowhere'*"),
        (("--garl-film=all",), "*--garl-film: found 'all', expected one of failures*"),
        (("--garl-budget=8", "-o", "garl_dir=/proc/garl"), "*cannot be written*garl_dir*"),
    ],
)
def test_an_invalid_value_is_one_usage_error(
    pytester: pytest.Pytester, args: tuple[str, ...], words: str
) -> None:
    project(pytester)
    result = run(pytester, *args)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([words])


@pytest.mark.parametrize("where", ["command line", "file"])
@pytest.mark.parametrize(("key", "meant"), [("metod", "method"), ("case", "cases")])
def test_an_unknown_ini_key_is_one_usage_error_that_names_the_nearest(
    pytester: pytest.Pytester, where: str, key: str, meant: str
) -> None:
    project(pytester)
    args = ("-o", f"garl_{key}=random") if where == "command line" else ()
    if not args:
        with (pytester.path / "pytest.ini").open("a") as ini:
            ini.write(f"garl_{key} = random\n")
    result = run(pytester, *args)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    words = f"*garl_{key}: unknown ini key; did you mean garl_{meant}? *"
    result.stderr.fnmatch_lines([words])


@pytest.mark.parametrize(
    ("args", "words"),
    [
        ((), "*method garl, seed 0, NPCs dqn,*"),
        (("--garl-method=garl-paper",), "*NPCs dqn-paper,*"),
        (("--garl-method=random",), "*NPCs waypoint,*"),
        (("--garl-method=surrogate-random",), "*NPCs dqn-paper,*"),
        (("--garl-method=ga",), "*NPCs destination,*"),
        # PyTorch takes seconds to load.
        pytest.param(("--garl-method=offline-rl",), "*NPCs destination,*", marks=pytest.mark.long),
        (("--garl-method=online-rl",), "*NPCs online-rl,*"),
        (("--garl-method=random", "--garl-npcs=stand"), "*NPCs stand,*"),
    ],
)
def test_the_method_chooses_the_npc_policy_unless_an_option_does(
    pytester: pytest.Pytester, args: tuple[str, ...], words: str
) -> None:
    if "--garl-method=offline-rl" in args:
        pytest.importorskip("torch")
    project(pytester)
    result = run(pytester, "--garl-budget=1", "--garl-workers=0", *args)
    result.stdout.fnmatch_lines([words])


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
