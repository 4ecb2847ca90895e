from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from pytest_garl.cli import main
from pytest_garl.execution.ledger import Ledger
from pytest_garl.regressions.case_file import dump_case, load_case
from tests.support.landing_project import project, result_hash, write_project

SEARCH = ("--garl-budget=24", "--garl-workers=0", "--garl-shrink=60")
CASES = ("--garl-workers=0",)


def run(pytester: pytest.Pytester, *args: str) -> pytest.RunResult:
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", *(args or CASES))


def cases(pytester: pytest.Pytester) -> list[Path]:
    return sorted((pytester.path / "scenarios" / "regressions" / "systems").glob("*.toml"))


def saved(pytester: pytest.Pytester) -> dict[str, str]:
    return {path.name: path.read_text() for path in cases(pytester)}


def commit(folder: Path) -> None:
    """Put the project under git's care, so that its cases are known."""
    for command in (["init", "-q"], ["add", "scenarios"]):
        subprocess.run(["git", *command], check=True, cwd=folder)


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a project whose search has saved two cases: a dog, and fog that misleads.

    They are committed.
    """
    folder = tmp_path_factory.mktemp("searched")
    write_project(folder)
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *SEARCH]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == pytest.ExitCode.TESTS_FAILED, done.stdout
    assert "confirming and shrinking 2 new kinds of violation" in done.stdout
    assert "saved scenarios/regressions/systems/lawn-IV-dog-" in done.stdout
    assert "New cases fail until they are fixed, committed, or accepted" in done.stdout
    commit(folder)
    return folder


@pytest.fixture
def searched(pytester: pytest.Pytester, template: Path) -> pytest.Pytester:
    """Return a copy of that project."""
    shutil.copytree(template, pytester.path, dirs_exist_ok=True)
    return pytester


def violations(pytester: pytest.Pytester) -> list[tuple[int, int, str]]:
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    try:
        return [(*row.id.key[1:], row.signature) for row in ledger.queries.violating()]
    finally:
        ledger.close()


def change(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def dodge(project: Path) -> None:
    """Repair the landing system so that it is hit by no dog."""
    change(project / "systems.py", "class Good:\n", "class Good:\n    dodges = True\n")


def test_what_a_search_finds_is_saved_small_and_then_expected(searched: pytest.Pytester) -> None:
    fog, dog = cases(searched)
    assert (fog.name[:14], dog.name[:11]) == ("lawn-I-unknown", "lawn-IV-dog")
    found = load_case(dog)
    assert set(found.scenario.removed_objects) == {"bird-1", "person-1", "person-2"}
    assert found.scenario["environment.fog"] == 0.0
    assert 0.7 < found.scenario["dog-1.velocity"] < 0.8
    assert load_case(fog).scenario["environment.fog"] < 0.12
    assert load_case(dog).test == "test_it.py::test_collisions"
    assert load_case(fog).test == "test_it.py::test_distance"
    result = run(searched, *CASES, "-rx")
    result.assert_outcomes(passed=2, skipped=2, xfailed=2)
    result.stdout.fnmatch_lines(["*case-lawn-I*known: I?:unknown (scenarios/regressions/*"])
    assert result.ret == 0
    assert not list((searched.path / ".garl").glob("cases-*"))


def test_a_search_expects_what_is_known_and_saves_nothing_twice(searched: pytest.Pytester) -> None:
    before = saved(searched)
    result = run(searched, *SEARCH)
    assert result.ret == 0
    assert "failed" not in result.parseoutcomes()
    assert saved(searched) == before


@pytest.mark.parametrize("how", [("--garl-workers=1",), ("--garl-workers=2", "-n2")])
def test_the_same_search_saves_the_same_bytes(
    searched: pytest.Pytester, how: tuple[str, ...]
) -> None:
    before, known = saved(searched), result_hash(searched)
    shutil.rmtree(searched.path / "scenarios")
    run(searched, *SEARCH, *how)
    assert saved(searched) == before
    assert result_hash(searched) == known


def test_cases_of_a_search_with_destinations_keep_them_and_are_flown(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    run(pytester, *SEARCH, "--garl-method=ga")
    found = [load_case(path) for path in cases(pytester)]
    assert {case.policy for case in found} == {"destination"}
    (dog,) = [case for case in found if case.violation.signature.startswith("IV:dog")]
    assert -1 <= dog.scenario["dog-1.destination_x"] <= 1
    assert not any(key.startswith("person-1") for key, _ in dog.scenario.genes)
    commit(pytester.path)
    run(pytester, *CASES).assert_outcomes(passed=2, skipped=2, xfailed=2)


def test_what_the_cap_does_not_reach_is_saved_unshrunk_and_told(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=8", "--garl-workers=0")
    fog, dog = (load_case(path) for path in cases(pytester))
    assert (fog.evidence.neighbours, dog.evidence.neighbours) == (3, 0)
    assert fog.evidence.removed.startswith("4 of 4 objects")
    assert dog.evidence.removed == "nothing"
    result.stdout.fnmatch_lines(
        [
            "*confirming and shrinking 2 new kinds of violation, at most * flights, about * s",
            "*(as the search found it,*",
            "1 kind of violation not shrunk: *",
        ]
    )
    assert "--garl-shrink=12" in result.stdout.str()
    run(pytester, *CASES).assert_outcomes(passed=2, skipped=2, failed=2)


def test_each_new_kind_has_flights_of_its_own(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=8", "--garl-workers=0", "--garl-shrink=12")
    assert [load_case(path).evidence.neighbours for path in cases(pytester)] == [3, 3]
    assert "not shrunk" not in result.stdout.str()


def test_a_python_exception_takes_two_flights_at_most(pytester: pytest.Pytester) -> None:
    project(pytester, "Raises")
    result = run(pytester, "--garl-budget=4", "--garl-workers=0", "--garl-shrink=100")
    result.stdout.fnmatch_lines(["*1 new kind of violation, at most 2 flights, *"])
    (path,) = cases(pytester)
    assert len(load_case(path).scenario.removed_objects) == 4
    assert "; 1 flight)" in result.stdout.str().replace("\n    ", " ")


@pytest.mark.parametrize("few", ["1", "7"])
def test_too_few_flights_to_shrink_are_refused(pytester: pytest.Pytester, few: str) -> None:
    project(pytester)
    result = run(pytester, "--garl-budget=8", f"--garl-shrink={few}")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([f"*--garl-shrink: found '{few}', expected 0, or at least 8 *"])


def test_cases_fly_under_xdist(searched: pytest.Pytester) -> None:
    run(searched, "-n2", "--garl-workers=1").assert_outcomes(passed=2, skipped=2, xfailed=2)
    assert not list((searched.path / ".garl").glob("cases-*"))


def test_shrinking_can_be_switched_off(pytester: pytest.Pytester) -> None:
    project(pytester)
    run(pytester, *SEARCH, "--garl-shrink=0")
    assert not cases(pytester)


def test_an_open_case_that_passes_since_the_simulator_changed_is_stale(
    searched: pytest.Pytester,
) -> None:
    change(searched.path / "tiny_simulator.py", "> 0.7 and", "> 7 and")
    result = run(searched)
    result.assert_outcomes(passed=5, xfailed=1)
    result.stdout.fnmatch_lines(["stale: *IV-dog*.toml passes, but the simulator has changed"])
    result.stdout.no_fnmatch_line("maybe fixed*")


def test_an_open_case_that_passes_may_be_fixed(searched: pytest.Pytester) -> None:
    dodge(searched.path)
    result = run(searched)
    result.assert_outcomes(passed=5, xfailed=1)
    result.stdout.fnmatch_lines(
        [
            "maybe fixed: scenarios/*IV-dog*.toml passes; if it is fixed:",
            "    garl cases promote scenarios/*IV-dog*.toml",
        ]
    )
    assert result.ret == 0
    strict = run(searched, *CASES, "-o", "garl_xfail_strict=true")
    assert strict.ret == pytest.ExitCode.TESTS_FAILED
    strict.stdout.fnmatch_lines(["*is open but passes (garl_xfail_strict)*"])


@pytest.mark.parametrize("status", ["open", "fixed", "unavoidable"])
@pytest.mark.parametrize("repaired", [False, True])
def test_an_edge_case_fails_no_run_whichever_way_it_goes(
    searched: pytest.Pytester, status: str, repaired: bool
) -> None:
    dog = cases(searched)[1]
    change(dog, "neighbours_failed = 3", "neighbours_failed = 2")
    change(dog, 'status = "open"', f'status = "{status}"')
    if repaired:
        dodge(searched.path)
    result = run(searched, "--garl-workers=0", "-rx", "-o", "garl_xfail_strict=true", "-kIV")
    ends = "passes" if repaired else "fails"
    result.stdout.fnmatch_lines([f"*case-lawn-IV-dog*edge: {ends}; IV:dog:*"])
    assert result.ret == 0
    result.stdout.no_fnmatch_line("maybe fixed*")


def test_an_edge_case_does_not_hide_a_mistake_in_a_test(searched: pytest.Pytester) -> None:
    change(cases(searched)[1], "neighbours_failed = 3", "neighbours_failed = 2")
    change(searched.path / "test_it.py", "not landing.collisions", "not landing.colisions")
    result = run(searched, "--garl-workers=0", "-kIV")
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def test_an_open_case_that_passes_is_told_though_its_flight_ends_in_an_abort(
    searched: pytest.Pytester,
) -> None:
    change(searched.path / "tiny_simulator.py", 'outcome = "collision"', 'outcome = "aborted"')
    result = run(searched)
    result.assert_outcomes(passed=3, skipped=2, xfailed=1)
    result.stdout.fnmatch_lines(["stale: scenarios/*IV-dog*.toml passes, but the simulator*"])
    strict = run(searched, *CASES, "-o", "garl_xfail_strict=true")
    strict.assert_outcomes(passed=2, skipped=2, xfailed=1, failed=1)
    assert strict.ret == pytest.ExitCode.TESTS_FAILED


def test_a_case_hides_no_property_that_it_is_not_about(searched: pytest.Pytester) -> None:
    tests = searched.path / "test_it.py"
    own = "\ndef test_own(landing):\n    assert landing.flight.elapsed_s < 14\n"
    tests.write_text(tests.read_text() + own + "\ndef test_typo(landing):\n    landing.hits\n")
    result = run(searched)
    # Both fail in each of the two cases, whose own failures stay expected.
    result.assert_outcomes(passed=2, skipped=2, xfailed=2, failed=4)
    again = run(searched, *SEARCH)
    kinds = [line for line in again.outlines if line.startswith("FAILED")]
    assert sum("test_own[lawn" in line for line in kinds) == 1
    assert sum("test_typo[lawn" in line for line in kinds) == 24


def test_an_open_case_that_fails_in_another_way_fails(searched: pytest.Pytester) -> None:
    change(searched.path / "tiny_simulator.py", 'body="dog-1"', 'body="tree-1"')
    change(searched.path / "tiny_simulator.py", 'kind="dog"', 'kind="tree"')
    change(searched.path / "tiny_simulator.py", '"dynamic"', '"static"')
    result = run(searched)
    result.stdout.fnmatch_lines(
        ["*IV-dog*fails in another way.", "Saved: IV:dog:*", "Flown: III:tree:*", "See it: garl*"]
    )
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def test_a_fixed_case_must_pass_with_its_moves_and_with_a_live_policy(
    searched: pytest.Pytester,
) -> None:
    change(cases(searched)[1], 'status = "open"', 'status = "fixed"')
    broken = run(searched)
    broken.assert_outcomes(passed=2, skipped=4, xfailed=1, failed=2)
    broken.stdout.fnmatch_lines(["*case-lawn-IV-dog-*-live*", "*was fixed and fails again.*"])
    change(searched.path / "tiny_simulator.py", "> 0.7 and", "> 7 and")
    run(searched).assert_outcomes(passed=8, xfailed=1)


def test_what_cannot_be_avoided_gates_nothing(pytester: pytest.Pytester) -> None:
    project(pytester)
    change(pytester.path / "tiny_simulator.py", "is False", "is None")
    result = run(pytester, *SEARCH)
    result.stdout.fnmatch_lines(["*UNAVOIDABLE, gates nothing*"])
    assert {load_case(path).status for path in cases(pytester)} == {"unavoidable"}
    commit(pytester.path)
    assert run(pytester).ret == 0


def test_what_cannot_be_avoided_excuses_no_other_violation_of_its_kind(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    change(pytester.path / "tiny_simulator.py", "is False", "is None")
    run(pytester, *SEARCH)
    commit(pytester.path)
    again = run(pytester, *SEARCH, "--garl-seed=1")
    assert again.parseoutcomes()["failed"] == 2
    assert again.ret == pytest.ExitCode.TESTS_FAILED


def test_a_case_is_known_when_it_is_committed_or_accepted(
    searched: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.rmtree(searched.path / ".git")
    monkeypatch.setenv("COLUMNS", "200")
    files = [str(path) for path in cases(searched)]
    for _ in range(2):
        result = run(searched, *CASES)
        result.assert_outcomes(passed=2, skipped=2, failed=2)
        result.stdout.fnmatch_lines(
            [
                "garl: cannot tell which cases are committed (*not a git repository*",
                "If that is known: commit it, or: garl cases accept *IV-dog*.toml",
            ]
        )
        result.stdout.fnmatch_lines(
            ["FAILED *IV-dog* - collided with dog-1 at *; this case is new and not accepted yet"]
        )
        # A search says the same, however often.
        assert run(searched, *SEARCH).parseoutcomes()["failed"] == 4
    assert CliRunner().invoke(main, ["cases", "accept", *files]).exit_code == 0
    run(searched).assert_outcomes(passed=2, skipped=2, xfailed=2)
    assert run(searched, *SEARCH).ret == 0


def test_a_repeat_shows_the_failure_of_a_known_case(searched: pytest.Pytester) -> None:
    run(searched, *SEARCH)
    slot = next(
        f"lawn-g{generation:02d}-s{slot:02d}"
        for generation, slot, signature in violations(searched)
        if signature.startswith("IV:dog")
    )
    result = run(searched, "--garl-workers=0", f"--garl-repeat={slot}")
    result.assert_outcomes(failed=1, skipped=2)
    result.stdout.fnmatch_lines(["*Collided with dog-1*"])


def test_who_repairs_need_not_outrun_what_the_reference_pilot_does_not(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    simulator = pytester.path / "tiny_simulator.py"
    change(simulator, "    del npcs, time_limit_s\n", "")
    hit = "> 0.7 and (not knows or npcs.name != 'recorded')"
    change(simulator, "> 0.7 and not knows", hit)
    result = run(pytester, *SEARCH)
    told = " ".join(result.stdout.str().split())
    assert "the reference pilot violates nothing unless it is pursued as well" in told
    fog, dog = cases(pytester)
    assert (load_case(fog).avoidable, load_case(dog).avoidable) == ("live", "recorded")
    assert load_case(dog).status == "open"
    change(dog, 'status = "open"', 'status = "fixed"')
    change(simulator, hit, "> 7")
    change(fog, 'status = "open"', 'status = "open"\naccepted = true')
    run(pytester).assert_outcomes(passed=5, xfailed=1)


def test_with_ci_set_the_tree_is_left_alone_and_a_patch_brings_the_case(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CI", "true")
    project(pytester)
    result = run(pytester, *SEARCH)
    assert not cases(pytester)
    result.stdout.fnmatch_lines(
        ["patch .garl/patches/*.patch", "    git apply *\\", "        .garl/patches/*.patch"]
    )
    patches = sorted((pytester.path / ".garl" / "patches").glob("*.patch"))
    assert len(patches) == 2
    subprocess.run(["git", "init", "-q"], check=True, cwd=pytester.path)
    subprocess.run(["git", "apply", *map(str, patches)], check=True, cwd=pytester.path)
    for path in cases(pytester):
        assert dump_case(load_case(path)) == path.read_text()
    commit(pytester.path)
    assert run(pytester).ret == 0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('status = "open"', "status = open", "not valid TOML"),
        ("schema = 1", "schema = 9", "key 'schema': found 9, expected 1"),
        ("fog = 0.0", "fog = 1.5", "'genes.environment.fog': found 1.5"),
        ('map = "lawn"', 'map = "moon"', "key 'map': unknown map 'moon'"),
        ('"systems:Good"', '"systems:Other"', "key 'system': found 'systems:Other', expected"),
        ("dog-1 = []", "dog-1 = [[1, 2.0, 0.0]]", "'moves.dog-1': found [[]1, 2.0, 0.0]"),
        ("dog-1 = []", "cat-1 = []", "'moves.cat-1': unknown key"),
    ],
)
def test_a_broken_case_errs_alone_and_names_file_and_key(
    searched: pytest.Pytester, old: str, new: str, words: str
) -> None:
    path = cases(searched)[1]
    change(path, old, new)
    result = run(searched)
    result.assert_outcomes(passed=2, xfailed=1, errors=3)
    result.stdout.fnmatch_lines([f"*{path.name}*{words}*"])


def test_a_system_that_is_not_deterministic_is_told_so(pytester: pytest.Pytester) -> None:
    project(pytester)
    simulator = pytester.path / "tiny_simulator.py"
    change(simulator, "else off", "else off\n    off += 1e-6 * __import__('random').random()")
    result = run(pytester, *SEARCH, "--garl-shrink=0")
    told = ["Nondeterministic landing system: *", "*trajectories, from * s on*"]
    result.stdout.fnmatch_lines(told)
    assert result.ret == pytest.ExitCode.TESTS_FAILED


def hit_by_the_dog(pytester: pytest.Pytester, when: str) -> None:
    """Let the dog hit a system only in some of a scenario's flights in one process."""
    simulator = pytester.path / "tiny_simulator.py"
    # In the fog it would fail each time, in one way or the other.
    change(simulator, '["environment.fog"] > 0.1', '["environment.fog"] > 1')
    change(
        simulator,
        "and not knows:\n        outcome",
        f"and not knows and {when}:\n        outcome",
    )
    change(simulator, "    contacts: tuple", "    SEEN.append(scenario.seed)\n    contacts: tuple")
    change(simulator, "\n\ndef fly(", "\n\nSEEN = ['']\n\n\ndef fly(")


FLAKY = (*SEARCH, "--garl-method=random", "--garl-shrink=0", "-rxf")


@pytest.mark.parametrize("marked", [True, False])
def test_a_violation_in_three_of_five_flights_fails_and_is_called_flaky(
    pytester: pytest.Pytester, marked: bool
) -> None:
    project(pytester)
    if marked:
        change(pytester.path / "test_it.py", "maps=", "deterministic=False, maps=")
    hit_by_the_dog(pytester, "SEEN.count(scenario.seed) % 2 == 1")
    result = run(pytester, *FLAKY)
    assert result.parseoutcomes()["failed"] == 1
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["FLAKY: 3 of 5 flights fail [[]*, *[]] %*"])
    assert ("Nondeterministic landing system" in result.stdout.str()) is not marked


def test_a_violation_in_one_of_five_flights_did_not_repeat(pytester: pytest.Pytester) -> None:
    project(pytester)
    change(pytester.path / "test_it.py", "maps=", "deterministic=False, maps=")
    hit_by_the_dog(pytester, "SEEN.count(scenario.seed) == 1")
    result = run(pytester, *FLAKY)
    assert "failed" not in result.parseoutcomes()
    assert result.parseoutcomes()["xfailed"] >= 1
    result.stdout.fnmatch_lines(
        [
            "Good on lawn: * violations in 24 flights did not repeat, at most 1 may:*",
            "*did not repeat: 1 of 5 flights fail [[]*[]] % (IV:dog*",
        ]
    )
    assert result.ret == pytest.ExitCode.TESTS_FAILED


OWN = """
def test_own(landing, scenario):
    exact = landing.final_distance_m < 0.05
    assert exact or scenario["environment.snow"] < 0.1, "too much snow"
"""


@pytest.mark.parametrize(
    "how",
    [("--garl-workers=0",), pytest.param(("--garl-workers=1", "-n2"), marks=pytest.mark.long)],
)
def test_a_property_of_ones_own_is_shrunk_and_saved_for_its_test(
    pytester: pytest.Pytester, how: tuple[str, ...]
) -> None:
    project(pytester)
    tests = pytester.path / "test_it.py"
    tests.write_text(tests.read_text() + OWN)
    result = run(pytester, *SEARCH, *how, "--garl-shrink=120")
    result.stdout.fnmatch_lines(["own:test_own:*: a property of your own"])
    (own,) = [path for path in cases(pytester) if "-own-" in path.name]
    case = load_case(own)
    assert (case.test, case.own_test) == ("test_it.py::test_own", "test_own")
    assert case.violation.type == "own"
    assert case.violation.description.startswith("test_own: too much snow")
    assert len(case.scenario.removed_objects) == 4
    assert 0.1 <= case.scenario["environment.snow"] <= 0.11
    commit(pytester.path)
    known = run(pytester)
    # Four tests fly each of the two built-in cases, one flies its own.
    assert sum(known.parseoutcomes().values()) == 4 * 2 + 1
    assert known.ret == 0
    change(tests, "< 0.1,", "< 0.09,")
    assert run(pytester).ret == pytest.ExitCode.TESTS_FAILED
