"""The summary shows violations, commands and saved cases."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from pytest_garl.execution.ledger import Ledger
from tests.support.landing_project import project, run
from tests.support.search_tests import HIT

PARALLEL = pytest.mark.parametrize("parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)])
SEARCH = ("--garl-budget=8", "--garl-workers=0", "-o", "garl_dir=elsewhere")


@pytest.mark.parametrize(
    "columns",
    [
        pytest.param("60", marks=pytest.mark.long),
        "80",
        pytest.param("120", marks=pytest.mark.long),
    ],
)
def test_lines_fit_the_terminal(
    pytester: pytest.Pytester, columns: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    monkeypatch.setenv("COLUMNS", columns)
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", *SEARCH, "-v")
    sections = re.split(r"^([-=_]{3}.*)$", result.stdout.str(), flags=re.MULTILINE)
    ours = [
        line
        for title, body in zip(sections[1::2], sections[2::2], strict=True)
        if " garl: " in title
        for line in body.splitlines()
    ]
    # A command is never broken, so that it can be copied.
    prose = [
        line for line in ours if not re.search(r"--garl-repeat=|^ledger: |^saved |^ +garl ", line)
    ]
    assert len(prose) > 20
    assert max(len(line) for line in prose) <= int(columns)


@PARALLEL
def test_summary_counts_failures_of_users_properties_as_violations(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    project(pytester)
    (pytester.path / "test_it.py").write_text(
        "import pytest\n"
        "from systems import *\n"
        "pytestmark = pytest.mark.garl(system=Good, maps=['lawn'])\n\n"
        "def test_own(landing):\n"
        "    assert landing.elapsed_s < 14.0, 'too slow for us'\n"
    )
    (pytester.path / "conftest.py").write_text(
        "import dataclasses, tiny_simulator\n"
        "from pytest_garl.flight.flight_file import hash_of\n"
        "def calm(scenario, *args, **kwargs):\n"
        "    nominal = {'environment.fog': 0.0, 'dog-1.velocity': 0.1}\n"
        "    return tiny_simulator.fly(scenario.replace(nominal), *args, **kwargs)\n"
        "def pytest_garl_fly(config): return calm\n"
    )
    result = run(pytester, "--garl-budget=4", "--garl-workers=0", *parallel)
    result.assert_outcomes(failed=1, xfailed=3)
    result.stdout.fnmatch_lines(
        [
            "Good on lawn: 4 flown, landed 100 %, violations 100 %*",
            "  by the paper's definition, which counts not landing: violations 0 %",
            "  gave up: needless 0 %, excused 0 %, blocked 0 %; not landed 0 %",
            "*distance decided in 4 of 4 flights, time in 4",
            "*4  own:test_own:*",
            "*too slow for us",
            "own: an assertion of a test",
        ]
    )


@PARALLEL
def test_step_summary_holds_a_table_of_violations(
    pytester: pytest.Pytester, parallel: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    page = pytester.path / "summary.md"
    page.write_text("before\n")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    result = run(pytester, *SEARCH, "-rs", *parallel)
    lines = page.read_text().splitlines()
    assert lines[:2] == ["before", "## pytest-garl"]
    paper = "by the paper's definition, which counts not landing"
    gave_up = "gave up: needless | gave up: excused | gave up: blocked"
    assert lines[3:6:2] == [
        f"| where | flown | landed | violations | {paper} | {gave_up} "
        "| not landed | crashed | inconclusive |",
        "| Good on lawn | 8 | 75 % | 38 % | 38 % | 0 % | 0 % | 0 % | 0 % | 0 % | 0 % |",
    ]
    assert (
        f"| Good on lawn | IV:dog:last-metre:unseen | 2 | {HIT} | "
        "unusual in lawn-g00-s02: a hostile dog at 0.0 m/s for 14.2 s, 3 others there | "
        "`pytest test_it.py --garl-repeat=lawn-g00-s02 -o garl_dir=elsewhere` |"
    ) in lines
    folded = [line for line in result.outlines if line.startswith("SKIPPED")]
    reason = "not judged: the flight ended before, or another test fails (-v: which)"
    assert folded == [f"SKIPPED [4] test_it.py: {reason}"]


@PARALLEL
def test_summary_shows_what_the_random_flights_found(
    pytester: pytest.Pytester, parallel: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    page = pytester.path / "summary.md"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    monkeypatch.setenv("COLUMNS", "120")
    search = ("--garl-budget=12", "--garl-population=4", "--garl-workers=0", "--garl-shrink=0")
    result = run(pytester, *search, *parallel)
    few = "against random flights: too few random flights to say (4 of 20)"
    result.stdout.fnmatch_lines([f"  {few}", "*seen in * of 4 random flights"])
    lines = page.read_text().splitlines()
    assert f"Good on lawn: {few}" in [line.replace("\\", "") for line in lines]
    assert re.search(r"\| \d+ \(\d of 4 random\) \|", page.read_text())
    # All is in the ledger: a run that is over shows the same once more.
    again = run(pytester, *search, "--garl-resume", *parallel)
    again.stdout.fnmatch_lines([f"  {few}", "*seen in * of 4 random flights"])
    for other in (("--garl-repeat=lawn-g00-s01",), (*search, "--garl-method=random")):
        assert "random flights" not in run(pytester, *other, *parallel).stdout.str()


def test_command_to_keep_patches_names_those_of_this_run(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    monkeypatch.setenv("CI", "1")
    (pytester.path / "elsewhere" / "patches").mkdir(parents=True)
    (pytester.path / "elsewhere" / "patches" / "older.patch").write_text("another run's")
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider", *SEARCH)
    text = result.stdout.str()
    command = text[text.index("git apply") :].split("\n\n")[0].split("=====")[0]
    files = re.findall(r"elsewhere/patches/\S+\.patch", command)
    assert len(files) == 2
    assert "elsewhere/patches/older.patch" not in files
    for name in ("git init", "git apply " + " ".join(files)):
        assert pytester.run(*name.split()).ret == 0
    assert len(list((pytester.path / "scenarios" / "regressions").rglob("*.toml"))) == 2


def test_summary_says_that_the_folder_of_cases_cannot_be_written(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    (pytester.path / "taken").write_text("a file")
    result = pytester.runpytest_subprocess(
        "-p", "no:cacheprovider", *SEARCH, "-o", "garl_cases=taken/cases"
    )
    assert result.ret == pytest.ExitCode.INTERNAL_ERROR
    result.stdout.fnmatch_lines(["*garl: cases*", "nothing more was saved: *ini key garl_cases"])


@pytest.mark.parametrize(
    ("module", "function", "part"),
    [
        ("terminal.summary", "write_run", "the summary"),
        ("terminal.github_summary", "write_step_summary", "the step summary"),
        ("session.session_status", "problems", "this list"),
    ],
)
def test_an_error_in_the_summary_is_one_red_line(
    pytester: pytest.Pytester, module: str, function: str, part: str
) -> None:
    project(pytester)
    with (pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(
            f"import pytest_garl.plugin.{module} as module\n"
            f"def broken(*args): raise RuntimeError('it broke')\n"
            f"module.{function} = broken\n"
        )
    result = run(pytester, "--garl-budget=2", "--garl-workers=0")
    assert result.ret == pytest.ExitCode.INTERNAL_ERROR
    output = " ".join(result.stdout.str().split())
    assert f"{part} is not complete because of an error in pytest-garl" in output
    assert output.count("RuntimeError: it broke") == 1
    result.stdout.no_fnmatch_line("Traceback*")
    result.stdout.fnmatch_lines(["=* short test summary info =*", "=*failed*"])


def test_landing_is_exported_for_annotations() -> None:
    import pytest_garl
    from pytest_garl.plugin.items.landing import Landing

    assert pytest_garl.Landing is Landing
    assert "Landing" in pytest_garl.__all__


def test_a_broken_users_method_is_reported_once(pytester: pytest.Pytester) -> None:
    project(pytester)
    (pytester.path / "broken_method.py").write_text(
        "class Broken:\n"
        "    learns = False\n"
        "    def __init__(self, plan): pass\n"
        "    def ask(self): return 3\n"
        "    def tell(self, flown): return []\n"
    )
    method = ("--garl-method=broken_method:Broken", "-o", "pythonpath=.")
    result = run(pytester, "--garl-budget=2", "--garl-workers=0", *method)
    output = result.stdout.str() + result.stderr.str()
    error = "search method 'broken_method:Broken': ask() returned 3, expected a list of 2"
    assert output.count(error) == 1
    assert "Traceback" not in output


@PARALLEL
def test_lf_flies_only_the_failing_slots_again(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    project(pytester)
    args = ("--garl-budget=24", "--garl-shrink=0", "--garl-workers=0", "-rf", *parallel)

    def failed(result: pytest.RunResult) -> set[str]:
        return {line.split(" - ")[0] for line in result.outlines if line.startswith("FAILED")}

    first = failed(pytester.runpytest_subprocess(*args))
    assert len(first) == 2
    result = pytester.runpytest_subprocess(*args, "--lf")
    result.assert_outcomes(failed=2)
    assert failed(result) == first
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    flown = {each.id.slot_id for each in ledger.queries.flights()}
    ledger.close()
    assert flown == {re.findall(r"\[(.+)\]", line)[0] for line in first}


@PARALLEL
def test_junit_carries_properties_of_the_flight(
    pytester: pytest.Pytester, parallel: tuple[str, ...]
) -> None:
    project(pytester)
    run(pytester, "--garl-budget=8", "--garl-workers=0", "--junitxml=out.xml", *parallel)
    cases = list(ElementTree.parse(Path(pytester.path) / "out.xml").iter("testcase"))
    assert len(cases) == 24
    for case in cases:
        found = {each.get("name"): each.get("value", "") for each in case.iter("property")}
        assert set(found) == {
            "garl.slot",
            "garl.flight",
            "garl.outcome",
            "garl.signature",
            "garl.story",
            "garl.final_distance_m",
            "garl.elapsed_s",
            "garl.excuse",
            "garl.trajectory_sha256",
        }
        assert f"[{found['garl.slot']}]" in str(case.get("name"))
        assert float(found["garl.elapsed_s"]) == 14.2
        assert found["garl.trajectory_sha256"]


def test_step_summary_escapes_names_outside_its_tables(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    page = pytester.path / "summary.md"
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    name = "<img src=x>[x](y)"
    systems = pytester.path / "systems.py"
    systems.write_text(
        f"{systems.read_text()}\nGood.__qualname__ = {name!r}\nglobals()[{name!r}] = Good\n"
    )
    run(pytester, *SEARCH)
    assert name.replace("<", "") in page.read_text().replace("\\", "").replace("<", "")
    assert "<img" not in page.read_text().replace("\\<", "")
    assert not re.search(r"(?<!\\)\[x", page.read_text())
