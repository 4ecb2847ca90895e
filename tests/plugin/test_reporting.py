from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from tests.support.landing_project import project, run

PARALLEL = pytest.mark.parametrize("parallel", [(), pytest.param(("-n2",), marks=pytest.mark.long)])
SEARCH = ("--garl-budget=8", "--garl-workers=1", "-o", "garl_dir=elsewhere")
HIT = "collided with dog-1 at 1.0 m/s, 0.0 m up, over the marker"
AGAIN = (
    'Repeat: pytest "test_it.py::test_collisions[lawn-g00-s01]" --garl-repeat=lawn-g00-s01 '
    "-o garl_dir=elsewhere"
)


@PARALLEL
def test_the_sentence_stands_where_people_look(
    pytester: pytest.Pytester, parallel: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    monkeypatch.setenv("COLUMNS", "150")
    result = run(pytester, *SEARCH, "--junitxml=out.xml", *parallel)
    text = result.stdout.str()
    assert f"<Landing lawn-g00-s01: {HIT}>.collisions" in text
    assert AGAIN in text
    assert f"FAILED test_it.py::test_collisions[lawn-g00-s01] - {HIT}" in text
    messages = [
        str(failure.get("message"))
        for failure in ElementTree.parse(Path(pytester.path) / "out.xml").iter("failure")
    ]
    assert f"{HIT}\n{AGAIN}" in messages


def test_a_printed_command_flies_the_failure_again(pytester: pytest.Pytester) -> None:
    project(pytester)
    first = run(pytester, *SEARCH)
    (line,) = [each for each in first.outlines if each.startswith(AGAIN[:50])]
    words = re.fullmatch(r'Repeat: pytest "(.+)" (--garl-repeat=\S+) (-o) (\S+)', line)
    assert words
    again = run(pytester, *words.groups())
    again.assert_outcomes(failed=1)
    assert f"{HIT}" in again.stdout.str()


@pytest.mark.parametrize(
    "columns",
    [
        pytest.param("60", marks=pytest.mark.long),
        "80",
        pytest.param("120", marks=pytest.mark.long),
    ],
)
def test_lines_of_our_own_fit_the_terminal(
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
    prose = [line for line in ours if not re.search(r"--garl-repeat=|^ledger: |^saved ", line)]
    assert len(prose) > 20
    assert max(len(line) for line in prose) <= int(columns)


def test_a_scenario_is_told_with_v_in_physical_units(pytester: pytest.Pytester) -> None:
    project(pytester)
    quiet = run(pytester, *SEARCH).stdout.str()
    assert "Scenario (seed" not in quiet
    assert "environment." not in quiet
    told = run(pytester, *SEARCH, "-v").stdout.str().replace("\n  ", " ")
    assert re.search(r"Scenario \(seed \d+\): dust, visibility \d+ m; fog, visibility \d+ m;", told)
    assert re.search(r"falling rain, [\d.]+ mm/h", told)
    assert re.search(r"dog-1 a dog of up to [\d.]+ m/s, from \(-?[\d.]+, -?[\d.]+\) m", told)
    assert "environment." not in told


@PARALLEL
def test_own_assertions_that_fail_are_violations_in_the_summary(
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
        "from pytest_garl.simulation.flight_file import hash_of\n"
        "def calm(scenario, *args, **kwargs):\n"
        "    nominal = {'environment.fog': 0.0, 'dog-1.velocity': 0.1}\n"
        "    return tiny_simulator.fly(scenario.replace(nominal), *args, **kwargs)\n"
        "def pytest_garl_fly(config): return calm\n"
    )
    result = run(pytester, "--garl-budget=4", "--garl-workers=1", *parallel)
    result.assert_outcomes(failed=1, xfailed=3)
    result.stdout.fnmatch_lines(
        [
            "Good on lawn: 4 flown, violations 100.0 %*",
            "*distance decided in 4 of 4 flights, time in 4",
            "*4  own:test_own:*",
            "*too slow for us",
            "own: an assertion of a test",
        ]
    )


@PARALLEL
def test_github_shows_a_table_of_what_was_found(
    pytester: pytest.Pytester, parallel: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    project(pytester)
    page = pytester.path / "summary.md"
    page.write_text("before\n")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
    result = run(pytester, *SEARCH, "-rs", *parallel)
    lines = page.read_text().splitlines()
    assert lines[:2] == ["before", "## pytest-garl"]
    assert (
        f"| Good on lawn | IV:dog:last-metre:unseen | 3 | {HIT} | "
        "`pytest test_it.py --garl-repeat=lawn-g00-s01 -o garl_dir=elsewhere` |"
    ) in lines
    folded = [line for line in result.outlines if line.startswith("SKIPPED")]
    assert folded == ["SKIPPED [6] test_it.py: not decided: the flight ended before (-v tells how)"]


def test_a_command_to_keep_patches_names_those_of_this_run(
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


def test_a_folder_of_cases_that_cannot_be_written_is_told_in_the_summary(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    (pytester.path / "taken").write_text("a file")
    result = pytester.runpytest_subprocess(
        "-p", "no:cacheprovider", *SEARCH, "-o", "garl_cases=taken/cases"
    )
    assert result.ret == pytest.ExitCode.INTERNAL_ERROR
    result.stdout.fnmatch_lines(["*garl: cases*", "nothing more was saved: *ini key garl_cases"])


def test_landing_is_exported_for_annotations() -> None:
    import pytest_garl
    from pytest_garl.plugin.landing import Landing

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
    both = result.stdout.str() + result.stderr.str()
    told = "search method 'broken_method:Broken': ask() returned 3, expected a list of 2"
    assert both.count(told) == 1
    assert "Traceback" not in both
