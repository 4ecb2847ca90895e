from __future__ import annotations

import html
import json
import re
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from pytest_garl.cases.corpus import Corpus
from pytest_garl.reports.run_json import SCHEMA
from pytest_garl.reports.run_reading import read_run
from pytest_garl.reports.run_text import run_text
from tests.support.landing_project import result_hash, write_project
from tests.support.report_ledgers import Flown, write_ledger
from tests.support.results import flight_result

VALIDATOR = Draft202012Validator(json.loads(SCHEMA.read_text()))


def garl(folder: Path, *args: str) -> str:
    code = "import sys; from pytest_garl.cli import main; main()"
    command = [sys.executable, "-c", code, *args]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def report(folder: Path, *args: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(garl(folder, "report", "--json", *args))
    VALIDATOR.validate(found)
    return found


def search(folder: Path, *args: str) -> None:
    command = [sys.executable, "-m", "pytest", "-q", "--garl-budget=8", "--garl-workers=1", *args]
    subprocess.run(command, cwd=folder, capture_output=True, check=False)


@pytest.fixture(scope="module")
def searched(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("searched")
    write_project(folder)
    tests = folder / "test_it.py"
    own = "\ndef test_own(landing):\n    assert landing.elapsed_s < 14.0, 'too slow'\n"
    tests.write_text(tests.read_text() + own)
    search(folder)
    return folder


@pytest.fixture(scope="module")
def searched_again(searched: Path) -> Path:
    """Return a folder with a second ledger, of a run without the own property."""
    shutil.copytree(searched / ".garl", searched / "first")
    tests = searched / "test_it.py"
    text = tests.read_text()
    tests.write_text(text.replace("< 14.0", "< 15.0"))
    search(searched, "-o", "garl_dir=later", "--garl-seed=3")
    tests.write_text(text)
    return searched


def test_two_runs_are_shown_side_by_side(searched_again: Path) -> None:
    told = garl(searched_again, "report", "first/ledger.sqlite", "later/ledger.sqlite")
    assert "before: first/ledger.sqlite" in told
    assert "not alike: seed 0 -> 3" in told
    assert re.search(r"Good on lawn\n +before +after\n +flights +8 +8\n", told)
    before, after = (
        {
            kind["signature"]: kind["count"]
            for kind in report(searched_again, each)["searches"][0]["signatures"]
        }
        for each in ("first/ledger.sqlite", "later/ledger.sqlite")
    )
    found = json.loads(
        garl(searched_again, "report", "first/ledger.sqlite", "later/ledger.sqlite", "--json")
    )
    (one,) = found["searches"]
    assert {each["signature"] for each in one["gained"]} == set(after) - set(before)
    assert {each["signature"] for each in one["lost"]} == set(before) - set(after)
    assert {each["signature"]: (each["before"], each["after"]) for each in one["kept"]} == {
        name: (before[name], after[name]) for name in set(before) & set(after)
    }
    assert one["lost"], "nothing to look at"
    for each in one["lost"]:
        assert each["by_chance"] == pytest.approx((1 - each["before"] / 8) ** 8)
        assert f"{each['signature']}: {each['before']} of 8 -> 0 of 8, by chance with" in told


def test_a_run_is_like_itself(searched: Path) -> None:
    ledger = ".garl/ledger.sqlite"
    found = json.loads(garl(searched, "report", ledger, ledger, "--json"))
    (one,) = found["searches"]
    assert (found["unlike"], one["gained"], one["lost"]) == ([], [], [])
    assert all(side["before"] == side["after"] for side in one["sides"])


def test_two_runs_have_a_page(searched_again: Path) -> None:
    told = garl(
        searched_again, "report", "first/ledger.sqlite", "later/ledger.sqlite", "--out=compared"
    )
    assert told == "compared/index.html\n"
    page = html.unescape((searched_again / "compared" / "index.html").read_text())
    assert "default-src 'none'" in page
    assert "The runs are not alike: seed was 0, and is 3." in page


def test_the_schema_is_valid() -> None:
    Draft202012Validator.check_schema(VALIDATOR.schema)


def test_a_report_holds_the_violations_of_the_search(searched: Path) -> None:
    found = report(searched)
    assert found["complete"]
    assert (found["version"], found["run"]["seed"], found["run"]["budget"]) == (1, 0, 8)
    assert found["flights"]["wanted"] == found["flights"]["flown"] == 8
    assert found["time"]["began"] <= found["time"]["ended"]
    (one,) = found["searches"]
    assert (one["system"], one["map"], one["flown"]) == ("systems:Good", "lawn", 8)
    assert one["outcomes"] == {"collision": 2, "landed": 6}
    assert one["decided"] == {"distance": 6, "time": 6}
    nobody = {"needless": 0, "excused": 0, "blocked": 0}
    assert (one["landed"], one["completed"], one["inconclusive"]) == (6, 5, 0)
    assert (one["gave_up"], one["not_landed"], one["crashes"]) == (nobody, nobody, {})
    assert one["landing_distance_m"] == {"median": 0.1, "worst": 3.0}
    assert one["landing_time_s"] == {"median": 14.2, "worst": 14.2}
    assert one["limits"] == [{"distance_m": 0.75, "time_s": 120.0, "abort": "needless"}]
    assert one["findings"] == []
    kinds = {kind["signature"]: kind for kind in one["signatures"]}
    dog = kinds["IV:dog:last-metre:unseen"]
    assert (dog["type"], dog["count"], dog["first"]["slot"]) == ("IV", 2, "lawn-g00-s02")
    assert dog["headline"] == "collided with dog-1 at 1.0 m/s, 0.0 m up, 3.0 m east of the marker"
    assert dog["severity"]["grade"] == "hostile"
    assert dog["severity"]["text"].startswith("a hostile dog at ")
    assert dog["repeat"] == "pytest test_it.py --garl-repeat=lawn-g00-s02"
    (own,) = [kind for kind in one["signatures"] if kind["type"] == "own"]
    assert (own["story"], own["severity"]) == ("too slow", None)
    assert one["violating"] == 8
    # The whole budget is one generation, and so random.
    assert one["control"]["random"] == {"flights": 8, "kinds": 2}
    assert one["control"]["later"] == {"flights": 0, "kinds": 0}
    assert one["control"]["at_equal_flights"] is None
    assert {kind["in_control"] for kind in kinds.values()} == {None}
    assert 1 < one["effective_kinds"] < len(kinds)
    assert {case["signature"] for case in found["cases"]} <= set(kinds)
    files = [file for kind in kinds.values() for file in kind["cases"]]
    assert {*files} == {case["file"] for case in found["cases"]}
    assert files
    assert all((searched / file).is_file() for file in files)
    assert not any(case["known"] for case in found["cases"])


def test_a_report_of_a_killed_run_holds_its_finished_flights(
    searched: Path, tmp_path: Path
) -> None:
    (tmp_path / "elsewhere").mkdir()
    path = tmp_path / "elsewhere" / "ledger.sqlite"
    with (
        closing(sqlite3.connect(searched / ".garl" / "ledger.sqlite")) as before,
        closing(sqlite3.connect(path)) as after,
        after,
    ):
        before.backup(after)
        # A kill leaves slots that are in flight, and no fact about the end.
        after.execute("DELETE FROM run WHERE key IN ('ended', 'own failures')")
        after.execute(
            "UPDATE slot SET state = 'claimed', result = NULL, sha256 = NULL WHERE slot > 3"
        )
    found = report(tmp_path, str(path))
    assert not found["complete"]
    assert found["flights"]["flown"] == 4
    assert found["searches"][0]["signatures"][0]["repeat"].endswith("-o garl_dir=elsewhere")
    assert found["cases"] == []


def test_a_report_compares_random_flights_with_as_many_later_ones(tmp_path: Path) -> None:
    write_project(tmp_path)
    search(tmp_path, "--garl-budget=44", "--garl-population=20", "--garl-shrink=0")
    (one,) = report(tmp_path)["searches"]
    control = one["control"]
    assert (control["random"]["flights"], control["later"]["flights"]) == (20, 24)
    found = control["at_equal_flights"]
    assert found["flights"] == 20
    kinds = control["random"]["kinds"]
    assert found["random"] == {"mean": kinds, "range_95": [kinds, kinds]}
    low, high = found["later"]["range_95"]
    assert low <= high <= control["later"]["kinds"]
    # Nearly all picks show as many kinds, and a few one less.
    assert low - 0.1 <= found["later"]["mean"] <= high + 0.1
    assert all(kind["in_control"] <= kind["count"] for kind in one["signatures"])
    made = {each["how"]: each["flights"] for each in one["origins"]}
    assert made == {"control": 20, "stratified": 12, "bred": 12}
    assert sum(each["first"] for each in one["origins"]) == len(one["signatures"])
    assert one["model"]["flights"] == 12
    words = garl(tmp_path, "report")
    assert f"  {control['text']}\n" in words
    assert "  new kinds: " in words
    assert "random flights\n        pytest test_it.py --garl-repeat=" in words


def test_a_report_is_written_to_a_file_or_printed_as_text(searched: Path) -> None:
    assert garl(searched, "report", "--json", "--out", "report.json") == ""
    VALIDATOR.validate(json.loads((searched / "report.json").read_text()))
    words = garl(searched, "report")
    assert "Good on lawn: 8 of 8 flown, 6 landed, 8 violate (3 by the paper's definition" in words
    assert "gave up: needless 0, excused 0, blocked 0" in words
    assert "IV:dog:last-metre:unseen: collided with dog-1" in words
    assert "\n        unusual in the mildest of them: a hostile dog at 0.0 m/s for 14.2 s" in words


def test_the_text_counts_flights_whose_time_ran_out(tmp_path: Path) -> None:
    late: dict[str, Any] = {"outcome": "not_landed", "paper_violation": True}
    results = (
        flight_result(completed=True),
        flight_result("late:not-landed", primary="time", violation_type="late", **late),
        flight_result(excuse="undetectable", **late),
    )
    path = write_ledger(tmp_path, [Flown(result=each) for each in results])
    told = run_text(read_run(path, Corpus(tmp_path)))
    assert "1 violate (2 by the paper's definition, which counts not landing)" in told
    assert "blocked 0; ran out of time: needless 1, excused 1, blocked 0\n" in told


def test_a_report_changes_no_result(pytester: pytest.Pytester, searched: Path) -> None:
    shutil.copytree(searched, pytester.path, dirs_exist_ok=True)
    before = result_hash(pytester)
    assert report(pytester.path)["results_sha256"] == before == result_hash(pytester)


def test_pages_are_written_into_a_folder(searched: Path) -> None:
    words = garl(searched, "report", "--out=pages", "--workers=1")
    assert words.startswith("pages/index.html: ")
    index = (searched / "pages" / "index.html").read_text()
    assert "8 of 8 flights violate something" in index
    names = {each.name for each in (searched / "pages" / "kinds").iterdir()}
    assert any("IV-dog-last-metre-unseen" in name for name in names)
    assert all(f'href="kinds/{name}"' in index for name in names if "as-found" not in name)
    garl(searched, "report", "--out=pages", "--workers=1")


def refused(folder: Path, *args: str) -> str:
    code = "import sys; from pytest_garl.cli import main; main()"
    command = [sys.executable, "-c", code, "report", *args]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    return done.stderr


def test_pages_take_the_place_of_nothing_else(searched: Path) -> None:
    (searched / "mine").mkdir(exist_ok=True)
    (searched / "mine" / "notes.txt").write_text("mine")
    error = refused(searched, "--out=mine")
    assert error.startswith(
        "Error: mine: found a folder with 'notes.txt', expected an empty folder"
    )
    assert (searched / "mine" / "notes.txt").read_text() == "mine"
    assert "expected a folder for the report" in refused(searched, "--out=systems.py")


def test_pages_without_a_ledger_are_one_message(tmp_path: Path) -> None:
    error = refused(tmp_path, "--out=pages")
    assert "there is no ledger at .garl/ledger.sqlite; run a search first" in error
    assert not (tmp_path / "pages").exists()
