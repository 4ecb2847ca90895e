"""The archive of `garl_archive`: what a search of one night leaves to that of the next."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from pytest_garl.execution.ledger import Ledger
from pytest_garl.search.archive import Archive, read_archive
from tests.cli.test_report_command import garl
from tests.plugin.test_resume import FLOWN, query, wait_for
from tests.support.landing_project import project, result_hash, run

SEARCH = ("--garl-budget=16", "--garl-population=4", "--garl-workers=0", "--garl-map=lawn")
INI = "[pytest]\ngarl_domain = {domain}\ngarl_archive = night.archive\n"


def carrying(pytester: pytest.Pytester, domain: str = "field") -> Path:
    """Write a project whose searches keep an archive; return its file."""
    project(pytester)
    (pytester.path / "pytest.ini").write_text(INI.format(domain=domain))
    return pytester.path / "night.archive"


def night(pytester: pytest.Pytester, seed: int, *args: str) -> list[str]:
    """Search; return the lines that tell of the archive."""
    result = run(pytester, *SEARCH, f"--garl-seed={seed}", *args)
    assert result.ret in (0, 1)
    text = result.stdout.str().replace("\n  ", " ")
    return [line for line in text.splitlines() if line.startswith("archive: ")]


def origins(folder: Path) -> list[str]:
    """Return how the scenarios of the latest search were made, and the names of their parents."""
    ledger = Ledger(folder / ".garl" / "ledger.sqlite")
    try:
        found = [
            origin
            for search, _ in ledger.searches()
            for generation in range(4)
            for origin in ledger.facts.origins(search, generation)
        ]
    finally:
        ledger.close()
    return [" ".join([each.how, *each.parents]) for each in found]


def test_a_second_night_breeds_from_the_first_and_says_so(pytester: pytest.Pytester) -> None:
    archive = carrying(pytester)
    assert night(pytester, 1) == [
        "archive: none when the search began, which is written to night.archive"
    ]
    first = read_archive(archive)
    [own] = first.searches
    assert (own.system, own.map, len(own.flights)) == ("systems:Good", "lawn", 16)
    result = run(pytester, *SEARCH, "--garl-seed=2")
    result.stdout.fnmatch_lines(
        [
            f"garl: budget 16 *, archive {first.sha256}, *",
            "=* garl: violations =*",
            f"archive: {first.sha256}, 16 flights known",
        ]
    )
    lines = result.outlines
    section = next(place for place, line in enumerate(lines) if "garl: violations" in line)
    assert lines[section + 1].startswith("archive: ")
    made = origins(pytester.path)
    assert [how.split()[0] for how in made[:4]] == ["control"] * 4
    assert any("archived-" in how for how in made[10:])
    [both] = read_archive(archive).searches
    assert len(both.flights) == 32
    assert both.flights[:16] == own.flights
    assert json.loads(garl(pytester.path, "report", "--json"))["run"]["archive"] == first.sha256


def test_the_same_archive_gives_the_same_bytes(pytester: pytest.Pytester) -> None:
    archive = carrying(pytester)
    night(pytester, 2)
    alone = result_hash(pytester)
    archive.unlink()
    night(pytester, 1)
    before = archive.read_bytes()
    night(pytester, 2)
    expected, after = result_hash(pytester), archive.read_bytes()
    assert expected != alone
    for args in (("--garl-workers=2",), ("-n2", "--garl-workers=1")):
        archive.write_bytes(before)
        assert len(night(pytester, 2, *args)) == 1
        assert result_hash(pytester) == expected
        assert archive.read_bytes() == after


SLOW = """
import time
from pytest_garl import Land

class Good:
    def reset(self, mission): time.sleep(0.2)
    def step(self, observation): return Land()
"""


def test_a_killed_run_goes_on_with_the_archive_that_its_ledger_names(
    pytester: pytest.Pytester,
) -> None:
    archive = carrying(pytester)
    (pytester.path / "systems.py").write_text(SLOW)
    night(pytester, 1)
    before = archive.read_bytes()
    night(pytester, 2)
    expected, after = result_hash(pytester), archive.read_bytes()
    archive.write_bytes(before)
    shutil.rmtree(pytester.path / ".garl")
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--garl-shrink=0"]
    process = subprocess.Popen(
        [*command, *SEARCH, "--garl-seed=2"],
        cwd=pytester.path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.DEVNULL,
        text=True,
    )
    ledger = pytester.path / ".garl" / "ledger.sqlite"
    wait_for(ledger, 6, process)
    process.send_signal(signal.SIGKILL)
    process.wait()
    [(flown,)] = query(ledger, f"SELECT count(*) {FLOWN}")
    assert flown < 16
    # Another search wrote a newer one meanwhile.
    Archive().save(archive)
    [line] = night(pytester, 2, "--garl-resume")
    assert "16 flights known" in line
    assert result_hash(pytester) == expected
    assert archive.read_bytes() == after
    [kept] = (pytester.path / ".garl").glob("archive-*")
    kept.unlink()
    result = run(pytester, *SEARCH, "--garl-seed=2", "--garl-resume")
    result.stderr.fnmatch_lines(["*that this run began with is not there; run without *"])
    assert result.ret == pytest.ExitCode.USAGE_ERROR


def test_a_changed_system_flies_what_failed_before_again(pytester: pytest.Pytester) -> None:
    carrying(pytester, "paper")
    night(pytester, 1)
    systems = pytester.path / "systems.py"
    systems.write_text(systems.read_text() + "\n# Changed.\n")
    [line] = night(pytester, 2)
    assert "0 flights known, 2 to fly again that failed in other searches" in line
    assert [how for how in origins(pytester.path) if how == "replayed"] == ["replayed"] * 2
    [line] = night(pytester, 3)
    assert line.endswith(", 16 flights known")


def test_an_archive_that_cannot_be_read_ends_the_session_before_a_flight(
    pytester: pytest.Pytester,
) -> None:
    carrying(pytester).write_text("nothing")
    result = run(pytester, *SEARCH)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["ERROR: *night.archive: this archive is damaged*Remove it*"])
    assert not (pytester.path / ".garl" / "flights").exists()


def test_a_method_that_remembers_nothing_says_so(pytester: pytest.Pytester) -> None:
    carrying(pytester)
    night(pytester, 1)
    [line] = night(pytester, 2, "--garl-method=random")
    assert line.endswith(", which the method random does not use")
    hashed = result_hash(pytester)
    (pytester.path / "pytest.ini").write_text("[pytest]\ngarl_domain = field\n")
    assert night(pytester, 2, "--garl-method=random") == []
    assert result_hash(pytester) == hashed


def test_saved_cases_and_an_interrupted_search_write_no_archive(
    pytester: pytest.Pytester,
) -> None:
    archive = carrying(pytester, "paper")
    assert run(pytester).ret in (0, 5)
    result = run(pytester, *SEARCH, "-x", "-o", "garl_duplicates=fail")
    assert result.ret == 1
    assert not archive.exists()
