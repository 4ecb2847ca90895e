from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.slot import slots
from pytest_garl.plugin.options import population

SAVED = Path(__file__).parents[2] / "docs" / "tutorial" / "scenarios"

SYSTEMS = """
import os, time, math
from pytest_garl import Land, VelocitySetpoint

class Good:
    def reset(self, mission): pass
    def step(self, observation): return Land()

class Raises(Good):
    def step(self, observation): raise ZeroDivisionError("no plan")

class Exits(Good):
    def step(self, observation): os._exit(3)

class Sleeps(Good):
    def step(self, observation): time.sleep(60)

class NoStep:
    def reset(self, mission): pass
"""
CONFTEST = """
import tiny_simulator
def pytest_garl_fly(config):
    return tiny_simulator.fly
"""
TESTS = """
import pytest
from systems import *
pytestmark = pytest.mark.garl(system={system}, maps={maps})

def test_distance(landing):
    assert landing.distance_to_landing_m <= 1.5

def test_time(landing):
    assert landing.time_to_landing_s <= 120

def test_collisions(landing):
    assert not landing.collisions
"""


def write_project(folder: Path, system: str = "Good", maps: str = "['lawn']") -> None:
    shutil.copy(Path(__file__).with_name("tiny_simulator.py"), folder)
    (folder / "systems.py").write_text(SYSTEMS)
    (folder / "test_it.py").write_text(TESTS.format(system=system, maps=maps))
    (folder / "conftest.py").write_text(CONFTEST)


def project(pytester: pytest.Pytester, system: str = "Good", maps: str = "['lawn']") -> None:
    write_project(pytester.path, system, maps)


def run(pytester: pytest.Pytester, *args: str) -> pytest.RunResult:
    """Run pytest; what a search finds is saved only where a test asks for it."""
    searches = any(arg.startswith("--garl-budget") for arg in args)
    off = ("--garl-shrink=0",) if searches else ()
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", *off, *args)


def result_hash(pytester: pytest.Pytester) -> str:
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    try:
        return ledger.queries.result_hash()
    finally:
        ledger.close()


@pytest.mark.parametrize("budget", [1, 7, 8, 9, 40, 79, 80, 160, 200, 400, 401])
def test_slots_are_exactly_the_budget(budget: int) -> None:
    names = slots(budget, population(budget))
    assert len(set(names)) == budget
    assert max(slot.index for slot in names) < population(budget) <= 20


@pytest.mark.parametrize("parallel", [(), ("-n2",)])
def test_one_event_fails_one_test_and_its_twins_are_xfailed(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=24", "--garl-workers=1", *parallel)
    outcomes = result.parseoutcomes()
    # Two mechanisms (a dog, and fog that misleads) fail once each.
    assert outcomes["failed"] == 2
    assert outcomes["xfailed"] >= 2
    assert outcomes["passed"] + outcomes["skipped"] + outcomes["xfailed"] + 2 == 72
    result.stdout.fnmatch_lines(
        ["*garl: what happened*", "*Collided with dog-1*", "*Repeat: pytest*"]
    )
    result.stdout.fnmatch_lines(["*Good on lawn: 24 flown*"])
    result.stdout.fnmatch_lines(["* IV:dog:* pytest test_it.py --garl-repeat=lawn-g*"])


def test_the_same_seed_gives_the_same_results_for_any_workers(pytester: pytest.Pytester) -> None:
    project(pytester)
    hashes = set()
    for args in (("0",), ("1",), ("4",), ("2", "-n2", "--dist=worksteal")):
        run(pytester, "--garl-budget=16", f"--garl-workers={args[0]}", *args[1:])
        hashes.add(result_hash(pytester))
    assert len(hashes) == 1
    run(pytester, "--garl-budget=16", "--garl-workers=0", "--garl-seed=1")
    assert result_hash(pytester) not in hashes


@pytest.mark.long
def test_a_network_that_learns_in_pytest_finds_the_same_for_any_workers(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    hashes = set()
    for args in (("--garl-workers=0",), ("--garl-workers=2", "-n2")):
        run(pytester, "--garl-budget=80", "--garl-method=offline-rl", "-k", "test_time", *args)
        hashes.add(result_hash(pytester))
    assert len(hashes) == 1


def test_duplicates_can_be_shown_as_failures(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=24", "--garl-workers=0", "--garl-duplicates=fail")
    outcomes = result.parseoutcomes()
    assert outcomes["failed"] > 2
    assert "xfailed" not in outcomes


def test_the_lowest_slot_fails_whatever_the_order(pytester: pytest.Pytester) -> None:
    project(pytester)
    straight = run(pytester, "--garl-budget=24", "--garl-workers=0", "-rf")
    backwards = CONFTEST + "\ndef pytest_collection_modifyitems(items): items.reverse()\n"
    pytester.makeconftest(backwards)
    reverse = run(pytester, "--garl-budget=24", "--garl-workers=0", "-rf")

    def failed(result: pytest.RunResult) -> set[str]:
        return {line.split(" - ")[0] for line in result.outlines if line.startswith("FAILED")}

    assert failed(straight) == failed(reverse)
    assert len(failed(straight)) == 2


@pytest.mark.parametrize("parallel", [(), ("-n2",)])
@pytest.mark.parametrize(
    ("system", "words", "share"),
    [
        ("Raises", "*ZeroDivisionError: no plan*", "Python error"),
        ("Exits", "*its process ended with exit status 3*", "died"),
        ("Sleeps", "*one call took longer than*", "hung"),
    ],
)
def test_a_broken_system_is_a_finding_and_the_run_goes_on(
    pytester: pytest.Pytester, system: str, words: str, share: str, parallel: tuple[str, ...]
) -> None:
    project(pytester, system)
    result = run(pytester, "--garl-budget=2", "--garl-workers=1", "--garl-timeout=0.3", *parallel)
    result.assert_outcomes(failed=1, skipped=4, xfailed=1)
    result.stdout.fnmatch_lines([words])
    result.stdout.fnmatch_lines(["*2 flown, violations 100.0 %*", f"*{share} 100.0 %*"])


def test_collecting_flies_nothing(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=40", "--collect-only", "-q")
    result.stdout.fnmatch_lines(["test_it.py::test_distance[[]lawn-g00-s00[]]"])
    assert not (pytester.path / ".garl").exists()


def test_a_selected_slot_is_flown_alone(pytester: pytest.Pytester) -> None:
    project(pytester)
    selected = ("--garl-budget=40", "--garl-workers=0", "-k", "lawn-g02-s03")
    result = run(pytester, *selected, "--garl-method=random")
    result.stdout.fnmatch_lines(["*lawn: 1 flown*"])
    # A bred slot needs its parents: two generations of eight.
    result = run(pytester, *selected, "--garl-method=garl-paper")
    result.stdout.fnmatch_lines(["*lawn: 17 flown*"])


def test_without_a_budget_the_tests_say_why_they_skip(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "-rs")
    result.assert_outcomes(skipped=3)
    result.stdout.fnmatch_lines(["*no --garl-budget given*"])


def test_a_slot_is_repeated_from_the_ledger(pytester: pytest.Pytester) -> None:
    project(pytester)
    run(pytester, "--garl-budget=16", "--garl-workers=0")
    before = result_hash(pytester)
    result = run(pytester, "--garl-workers=0", "--garl-repeat=lawn-g01-s05")
    result.stdout.fnmatch_lines(["*1 flown*"])
    assert result_hash(pytester) == before


@pytest.mark.parametrize(("args", "policy"), [((), "stand"), (("--garl-npcs=greedy",), "greedy")])
def test_a_slot_is_repeated_with_the_objects_of_its_search_unless_one_says(
    pytester: pytest.Pytester, args: tuple[str, ...], policy: str
) -> None:
    project(pytester)
    run(pytester, "--garl-budget=1", "--garl-workers=0", "--garl-npcs=stand")
    run(pytester, "--garl-workers=0", "--garl-repeat=lawn-g00-s00", *args)
    ledger = Ledger(pytester.path / ".garl" / "repeat.sqlite")
    [(_, job)] = ledger.searches()
    ledger.close()
    assert parse_job(job).npcs.name == policy


def test_a_slot_of_a_ledger_that_cannot_be_read_is_one_clear_error(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    (pytester.path / ".garl").mkdir()
    (pytester.path / ".garl" / "ledger.sqlite").write_text("no ledger")
    result = run(pytester, "--garl-repeat=lawn-g00-s00")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*--garl-repeat=lawn-g00-s00: *ledger.sqlite*"])


def test_stops_at_the_first_failure_with_x(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=24", "--garl-workers=1", "-x")
    assert result.parseoutcomes()["failed"] == 1


def test_junit_carries_the_signature(pytester: pytest.Pytester) -> None:
    project(pytester)
    run(pytester, "--garl-budget=24", "--garl-workers=0", "--junitxml=out.xml")
    text = (pytester.path / "out.xml").read_text()
    assert 'name="garl.signature" value="IV:dog:' in text


def test_importlib_mode_reaches_the_children(pytester: pytest.Pytester) -> None:
    project(pytester)
    inline = SYSTEMS + TESTS.format(system="Good", maps="['lawn']").replace(
        "from systems import *", ""
    )
    pytester.makepyfile(test_it=inline)
    (pytester.path / "systems.py").unlink()
    result = run(
        pytester,
        "--garl-budget=8",
        "--garl-workers=1",
        "--import-mode=importlib",
        "-o",
        "pythonpath=.",
    )
    result.stdout.fnmatch_lines(["*8 flown*"])


def test_a_saved_case_is_not_repeated_but_replayed(pytester: pytest.Pytester) -> None:
    project(pytester)
    case = next(SAVED.rglob("*.toml"))
    result = run(pytester, f"--garl-repeat={case}")
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines([f"*found a saved case*garl cases replay {case}*"])


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
        (("--garl-budget=8", "-o", "garl_dir=/proc/garl"), "*cannot be written*garl_dir*"),
    ],
)
def test_nonsense_on_the_command_line_is_one_clear_error(
    pytester: pytest.Pytester, args: tuple[str, ...], words: str
) -> None:
    project(pytester)
    result = run(pytester, *args)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([words])


@pytest.mark.parametrize(
    ("args", "words"),
    [
        ((), "*method garl, seed 0, NPCs dqn,*"),
        (("--garl-method=garl-paper",), "*NPCs dqn-paper,*"),
        (("--garl-method=random",), "*NPCs waypoint,*"),
        (("--garl-method=surrogate-random",), "*NPCs dqn-paper,*"),
        (("--garl-method=ga",), "*NPCs destination,*"),
        (("--garl-method=offline-rl",), "*NPCs destination,*"),
        (("--garl-method=online-rl",), "*NPCs online-rl,*"),
        (("--garl-method=random", "--garl-npcs=stand"), "*NPCs stand,*"),
    ],
)
def test_the_method_chooses_the_npc_policy_unless_an_option_does(
    pytester: pytest.Pytester, args: tuple[str, ...], words: str
) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=1", "--garl-workers=0", *args)
    result.stdout.fnmatch_lines([words])


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
def test_a_policy_of_ones_own_that_answers_nonsense_ends_the_run_before_a_flight(
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
    ("system", "maps", "words"),
    [
        ("Good", "['moon']", "*unknown map 'moon'; expected one of court, *lawn*"),
        ("NoStep", "['lawn']", "*NoStep has no method 'step'*"),
        ("Good()", "['lawn']", "*expected a class*"),
        ("(lambda: type('Local', (Good,), {}))()", "['lawn'], limits=dict(mass=1)", "*mass*"),
    ],
)
def test_a_bad_marker_is_one_clear_error_and_other_tests_run(
    pytester: pytest.Pytester, system: str, maps: str, words: str
) -> None:
    project(pytester, system, maps)
    pytester.makepyfile(test_other="def test_fine(): pass")
    result = run(pytester, "--garl-budget=8", "--continue-on-collection-errors")
    result.stdout.fnmatch_lines([words])
    result.assert_outcomes(passed=1, errors=1)


def test_check_refuses_a_class_inside_a_function(pytester: pytest.Pytester) -> None:
    project(pytester)
    pytester.makepyfile(
        test_it=TESTS.format(system="make()", maps="['lawn']").replace(
            "pytestmark", "def make():\n    class Inner(Good): pass\n    return Inner\npytestmark"
        )
    )
    result = run(pytester, "--garl-budget=8")
    result.stdout.fnmatch_lines(["*is defined inside a function*"])


def test_a_run_without_landing_tests_imports_nothing_heavy(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_plain="def test_plain(): pass")
    code = (
        "import sys, pytest\n"
        "pytest.main(['-q', '-p', 'no:hypothesispytest', '-p', 'no:cacheprovider'])\n"
        "heavy = {'numpy', 'cv2', 'pybullet', 'pymoo', 'torch', 'hypothesis', 'scipy'}\n"
        "print('HEAVY', sorted(heavy & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=pytester.path
    )
    assert "HEAVY []" in done.stdout


def test_the_plugin_can_be_left_out(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_plain="def test_plain(): pass")
    result = pytester.runpytest_subprocess("-p", "no:garl")
    result.assert_outcomes(passed=1)
