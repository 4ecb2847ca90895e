"""The operational domain of a search: who names it, and what follows from it."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.names import DEFAULT_DOMAIN
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.groups import GROUPS
from pytest_garl.scenarios.maps.loading import load_map
from tests.support.case_project import add_cases_to_git, cases
from tests.support.case_project import run as run_cases
from tests.support.landing_project import project, run

ONE = ("--garl-budget=1", "--garl-workers=0")
WINDY = 'extends = "calm"\n[wind]\nmean_mps = [0, 2]\n'


def mark(pytester: pytest.Pytester, domain: str) -> None:
    """Let the project's tests name a domain."""
    file = pytester.path / "test_it.py"
    text = file.read_text().replace("maps=['lawn']", f"maps=['lawn'], domain={domain}")
    assert domain in text
    file.write_text(text)


def named(pytester: pytest.Pytester, domain: str) -> None:
    project(pytester)
    mark(pytester, domain)


def npcs_in(file: Path) -> str:
    ledger = Ledger(file)
    [(_, job)] = ledger.searches()
    ledger.close()
    return parse_job(job).npcs.name


def in_default_domain(pytester: pytest.Pytester) -> None:
    """Write a project that names no domain."""
    project(pytester)
    (pytester.path / "pytest.ini").unlink()


def test_summary_names_the_domain_and_who_moves_the_npcs(pytester: pytest.Pytester) -> None:
    in_default_domain(pytester)
    result = run(pytester, *ONE)
    result.stdout.fnmatch_lines(["garl: *NPCs graded, domain field, *"])
    result.stdout.fnmatch_lines(["domain field, NPCs graded"])


def test_search_draws_from_the_default_domain(pytester: pytest.Pytester) -> None:
    """Its scenarios are sparse, and have conditions that the world of the paper lacks."""
    in_default_domain(pytester)
    result = run(pytester, "--garl-budget=40", "--garl-workers=0")
    result.stdout.fnmatch_lines(["Good on lawn: 40 flown, *", "domain field, NPCs graded"])
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    scenarios = [parse_scenario(flight.scenario) for flight in ledger.queries.flights()]
    ledger.close()
    domain, map = domain_named(DEFAULT_DOMAIN), load_map("lawn")
    assert [domain.outside(each, map) for each in scenarios] == [()] * 40
    conditions = {key.partition(".")[0] for each in scenarios for key, _ in each.genes}
    # Which ones is chance: 40 sparse scenarios have most of the groups that only this domain has.
    assert len(conditions & {*GROUPS}) >= len(GROUPS) / 2
    present = [len({key for key, _ in each.genes if "velocity" in key}) for each in scenarios]
    assert 0 in present
    assert max(present) <= 3


def test_case_that_the_default_domain_found_is_saved_and_flown(pytester: pytest.Pytester) -> None:
    in_default_domain(pytester)
    run_cases(pytester, "--garl-budget=100", "--garl-workers=0", "--garl-shrink=60")
    saved = cases(pytester)
    assert saved
    add_cases_to_git(pytester.path)
    result = run_cases(pytester, "--garl-workers=0")
    outcomes = result.parseoutcomes()
    assert (outcomes["xfailed"], outcomes.get("failed", 0)) == (len(saved), 0)
    result.stdout.no_fnmatch_line("*outside the domain*")


@pytest.mark.parametrize(
    ("marker", "args", "expected"),
    [
        ("", ("-o", "garl_domain=calm"), "domain calm, NPCs graded"),
        ("'calm'", ("-o", "garl_domain=field"), "domain calm, NPCs graded"),
        ("'calm'", ("--garl-domain=field",), "domain field, NPCs graded"),
        ("'calm'", ("--garl-domain=paper",), "domain paper, NPCs dqn"),
        ("", ("--garl-domain=calm", "-o", "garl_domain=paper"), "domain calm, NPCs graded"),
        ("'calm'", ("--garl-npcs=stand",), "domain calm, NPCs stand"),
        ("'calm'", ("--garl-method=garl-paper",), "domain calm, NPCs graded"),
        ("'mine.toml'", (), "domain mine (????????), NPCs graded"),
    ],
)
def test_option_wins_over_marker_and_marker_over_ini_key(
    pytester: pytest.Pytester, marker: str, args: tuple[str, ...], expected: str
) -> None:
    project(pytester)
    if marker:
        mark(pytester, marker)
    (pytester.path / "mine.toml").write_text(WINDY)
    result = run(pytester, *ONE, *args)
    result.stdout.fnmatch_lines([expected])


def test_domain_of_a_marker_is_announced_and_named_under_xdist(pytester: pytest.Pytester) -> None:
    named(pytester, "'calm'")
    run(pytester, *ONE).stdout.fnmatch_lines(["garl: domain of Good: calm, NPCs graded"])
    spread = run(pytester, "--garl-budget=2", "--garl-workers=1", "-n2")
    spread.stdout.fnmatch_lines(["domain calm, NPCs graded"])


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("--garl-domain=sea",), "*--garl-domain=sea: *found 'sea', expected field, calm*"),
        (("--garl-domain=no.toml",), "*--garl-domain=no.toml: *no.toml*"),
        (("--garl-domain=wild.toml",), "*wild.toml: key 'npc_behaviour': found 'wild', expected*"),
    ],
)
def test_invalid_domain_is_one_usage_error(
    pytester: pytest.Pytester, args: tuple[str, ...], words: str
) -> None:
    project(pytester)
    (pytester.path / "wild.toml").write_text('extends = "calm"\nnpc_behaviour = "wild"\n')
    result = run(pytester, *ONE, *args)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines([words])
    assert "Traceback" not in result.stderr.str()


@pytest.mark.parametrize(
    ("domain", "words"),
    [
        ("'sea'", "*mark.garl: domain='sea': *expected field, calm*"),
        ("7", "*mark.garl: domain=7: expected a name such as 'field', or a TOML file*"),
        ("'wild.toml'", "*wild.toml: key 'wind.mean_mps': found *3, 1*lowest value first*"),
    ],
)
def test_invalid_domain_of_a_marker_names_file_and_key(
    pytester: pytest.Pytester, domain: str, words: str
) -> None:
    named(pytester, domain)
    (pytester.path / "wild.toml").write_text("[wind]\nmean_mps = [3, 1]\n")
    result = run(pytester, *ONE)
    assert result.ret == pytest.ExitCode.INTERRUPTED
    result.stdout.fnmatch_lines([words])


def test_domain_without_a_search_is_an_option_without_effect(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, "--garl-domain=calm")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*--garl-domain has no effect without --garl-budget*"])


def test_fixture_npcs_wins_over_the_domain(pytester: pytest.Pytester) -> None:
    """Also if it names the policy that the session's own domain has."""
    named(pytester, "'calm'")
    with (pytester.path / "conftest.py").open("a") as file:
        file.write("import pytest\n@pytest.fixture(scope='session')\ndef npcs(): return 'dqn'\n")
    run(pytester, *ONE, "-o", "garl_domain=paper").stdout.fnmatch_lines(["domain calm, NPCs dqn"])


def test_repeated_slot_has_the_npcs_of_its_search(pytester: pytest.Pytester) -> None:
    named(pytester, "'calm'")
    run(pytester, *ONE)
    run(pytester, "--garl-repeat=lawn-g00-s00", "--garl-workers=0", "-o", "garl_domain=paper")
    assert npcs_in(pytester.path / ".garl" / "repeat.sqlite") == "graded"


def test_absent_npcs_take_part_in_no_flight(pytester: pytest.Pytester) -> None:
    named(pytester, "'mine.toml'")
    (pytester.path / "mine.toml").write_text('extends = "calm"\nnpc_behaviour = "absent"\n')
    result = run(pytester, "--garl-budget=4", "--garl-workers=0")
    result.stdout.fnmatch_lines(["domain mine*, NPCs stationary"])
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    scenarios = [flight.scenario for flight in ledger.queries.flights()]
    ledger.close()
    assert len(scenarios) == 4
    assert all("velocity" not in scenario for scenario in scenarios)


@pytest.mark.parametrize(
    "args", [(), pytest.param(("-n2",), marks=pytest.mark.long)], ids=["alone", "xdist"]
)
def test_case_outside_the_domain_is_flown_and_named(
    searched: pytest.Pytester, args: tuple[str, ...]
) -> None:
    (searched.path / "mine.toml").write_text('extends = "calm"\nnpc_behaviour = "absent"\n')
    inside = run_cases(searched, "--garl-workers=0")
    inside.stdout.no_fnmatch_line("*outside the domain*")
    workers = "--garl-workers=1" if args else "--garl-workers=0"
    outside = run_cases(searched, workers, "-o", "garl_domain=mine.toml", *args)
    assert outside.parseoutcomes() == inside.parseoutcomes()
    dogs = [
        line for line in outside.outlines if "outside the domain mine" in line and "dog" in line
    ]
    assert len(dogs) == 1
    assert dogs[0].startswith("flown, although lawn-IV-dog-")


@pytest.mark.parametrize("where", ["ini file", "marker", "file"])
def test_resume_refuses_another_domain(pytester: pytest.Pytester, where: str) -> None:
    named(pytester, "'mine.toml'" if where == "file" else "'calm'")
    mine = pytester.path / "mine.toml"
    mine.write_text(WINDY)
    run(pytester, *ONE)
    if where == "file":
        mine.write_text(WINDY.replace("2", "3"))
    elif where == "marker":
        test = pytester.path / "test_it.py"
        test.write_text(test.read_text().replace("'calm'", "'field'"))
    args = ("-o", "garl_domain=field") if where == "ini file" else ()
    result = run(pytester, *ONE, "--garl-resume", *args)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*domain * was *, is *run without --garl-resume*"])
