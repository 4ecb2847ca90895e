from __future__ import annotations

import fnmatch

import pytest

from tests.support.landing_project import (
    CONFTEST,
    project,
    run,
)

POLICY = """
from pytest_garl.simulation.npc_policy import PolicySpec

class Wild:
    def reset(self, situation, rng): pass
    def decide(self, situation): return 7

@pytest.fixture(scope="session")
def npcs():
    return PolicySpec(name="wild", factory="systems_and_policy:Wild")
"""


@pytest.mark.parametrize("args", [(), ("-n2",)], ids=["alone", "xdist"])
def test_an_npc_policy_with_invalid_answers_ends_the_run_before_a_flight(
    pytester: pytest.Pytester, args: tuple[str, ...]
) -> None:
    project(pytester)
    pytester.makepyfile(systems_and_policy="import pytest\n" + POLICY)
    conftest = CONFTEST + "\nfrom systems_and_policy import npcs"
    pytester.makeconftest(conftest)
    result = run(pytester, "--garl-budget=8", *args)
    assert result.ret == pytest.ExitCode.INTERNAL_ERROR
    words = "*NPC policy Wild, deciding for person-1: found 7; expected Move*"
    result.stdout.fnmatch_lines([words])
    assert not list((pytester.path / ".garl").glob("flights/*"))


@pytest.mark.parametrize(
    ("fixture", "error"),
    [
        ("return 'waypoint'", ""),
        ("return 'wayponit'", "unknown NPC policy 'wayponit'; expected one of"),
        (
            "return 3",
            "fixture npcs: found 3, expected the name of a policy as --garl-npcs takes it",
        ),
    ],
)
def test_the_npcs_fixture_takes_a_name(pytester: pytest.Pytester, fixture: str, error: str) -> None:
    project(pytester)
    with (pytester.path / "conftest.py").open("a") as file:
        file.write(f"import pytest\n@pytest.fixture(scope='session')\ndef npcs():\n    {fixture}\n")
    result = run(pytester, "--garl-budget=2", "--garl-workers=0")
    output = result.stdout.str() + result.stderr.str()
    assert (error in output) if error else (result.ret in (0, 1))
    assert "Traceback" not in output


def test_a_class_that_the_command_line_names_moves_the_npcs(pytester: pytest.Pytester) -> None:
    project(pytester)
    pytester.makepyfile(
        walkers="from pytest_garl.npcs.policies.greedy import Greedy\n"
        "class Mine(Greedy):\n    pass\n"
    )
    result = run(pytester, "--garl-budget=1", "--garl-workers=0", "--garl-npcs=walkers:Mine")
    result.stdout.fnmatch_lines(["domain *, NPCs walkers:Mine"])


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("walkers:Mine", "'walkers:Mine' cannot be loaded (No module named 'walkers'); expected"),
        ("walkers", "'walkers', expected one of *, or 'module:class' of an importable module"),
    ],
)
def test_what_the_command_line_names_must_exist(
    pytester: pytest.Pytester, name: str, words: str
) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=1", "--garl-workers=0", f"--garl-npcs={name}")
    assert result.ret not in (0, 1)
    output = result.stdout.str() + result.stderr.str()
    assert fnmatch.fnmatch(output, f"*{words}*")
    assert "Traceback" not in output
