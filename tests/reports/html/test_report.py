from __future__ import annotations

import base64
import dataclasses
import html
import json
import re
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import cv2
import pytest

from pytest_garl.cases.case import Case
from pytest_garl.cases.corpus import Corpus
from pytest_garl.errors import LedgerError
from pytest_garl.execution.reference import Reference
from pytest_garl.execution.severity import Severity
from pytest_garl.flight.flight import Crash
from pytest_garl.reports.html.index_markdown import index_parts
from pytest_garl.reports.html.moments import moments_of, telling_moment
from pytest_garl.reports.html.report import WrittenReport, write_html_report
from pytest_garl.reports.run_reading import read_run
from pytest_garl.reports.run_record import SavedCase
from pytest_garl.verdicts.evidence import Evidence
from tests.cases.samples import case
from tests.reports.html.test_rendering import HOSTILE, Elements
from tests.support.ffmpeg import hide_encoders
from tests.support.report_ledgers import SYSTEM, Flown, write_ledger
from tests.support.results import flight_result
from tests.support.videos import Video

SIGNATURE = "II:lost:descent"


def lost(**fields: Any) -> Any:
    return flight_result(
        fields.pop("signature", SIGNATURE),
        outcome="not_landed",
        primary="time",
        violation_type="II",
        story=fields.pop("story", "Not landed; the marker was last readable at 1.0 s."),
        **fields,
    )


def write(folder: Path, ledger: Path | None = None, **more: Any) -> WrittenReport:
    corpus = Corpus(folder / "scenarios" / "regressions")
    path = ledger or folder / ".garl" / "ledger.sqlite"
    run = read_run(path, corpus, checked=True)
    return write_html_report(run, folder / "report", **({"films": 0} | more))


def pages(folder: Path) -> dict[str, str]:
    files = sorted((folder / "report").rglob("*.html"))
    return {each.relative_to(folder / "report").as_posix(): each.read_text() for each in files}


def files(folder: Path) -> dict[str, bytes]:
    found = (each for each in sorted((folder / "report").rglob("*")) if each.is_file())
    return {each.relative_to(folder / "report").as_posix(): each.read_bytes() for each in found}


def kind_page(folder: Path) -> str:
    (page,) = (text for name, text in pages(folder).items() if name != "index.html")
    return page


def data_of(page: str) -> dict[str, Any]:
    (text,) = (text for kind, text in Elements(page).scripts if kind == "application/json")
    found: dict[str, Any] = json.loads(text)
    return found


@pytest.fixture
def run(tmp_path: Path, video: Video) -> Path:
    landed = Flown(result=flight_result(completed=True), flight=video.flight)
    write_ledger(tmp_path, [landed, Flown(result=lost(), flight=video.flight), landed])
    return tmp_path


def test_a_report_has_an_index_and_a_page_for_each_kind(run: Path) -> None:
    written = write(run)
    assert (written.pages, written.films, written.notes) == (1, 0, ())
    found = pages(run)
    (kind,) = [name for name in found if name != "index.html"]
    assert f'href="{kind}"' in found["index.html"]
    assert 'href="../index.html"' in found[kind]
    assert "1 of 3 flights violate something, in one way" in found["index.html"]
    assert SIGNATURE in found["index.html"]
    assert found[kind].count('class="moment"') == len(data_of(found[kind])["moments"])
    assert "Not landed; the marker was last readable at 1.0 s." in found[kind]
    assert "--garl-repeat=lawn-g00-s01" in found[kind]
    assert data_of(found[kind])["scene"]["ground"].startswith("data:image/jpeg")


def write_with_case(folder: Path, saved: Case) -> None:
    """Write the pages of a run whose violation has a saved case."""
    found = read_run(folder / ".garl" / "ledger.sqlite", Corpus(folder / "none"), checked=True)
    file = SavedCase(path=Path("a.toml"), case=saved, known=False)
    searches = tuple(each.with_cases([file]) for each in found.searches)
    told = dataclasses.replace(found, searches=searches, cases=(file,))
    write_html_report(told, folder / "report", films=0)


def test_what_shrinking_removed_agrees_with_what_the_page_says_it_took(run: Path) -> None:
    sample = case(SIGNATURE)
    shrunk = dataclasses.replace(
        sample,
        system=SYSTEM,
        scenario=sample.scenario.replace({"marker.x": 0.5}),
        severity=Severity(about="conditions"),
        evidence=dataclasses.replace(sample.evidence, removed="1 of 2 conditions"),
    )
    write_with_case(run, shrunk)
    page = html.unescape(kind_page(run))
    assert "nothing unusual" in page
    assert "1 of 2 conditions, not the marker's place" in page
    # The page shows the first flight.
    assert "Shrinking removed (saved case)" in page
    assert '<span class="tag">saved case, shrunk' in pages(run)["index.html"]


def test_the_index_tells_a_case_that_was_not_shrunk(run: Path) -> None:
    fog = Severity(about="conditions", conditions=("fog",), values=("",), untried=("fog",))
    write_with_case(run, dataclasses.replace(case(SIGNATURE), system=SYSTEM, severity=fog))
    assert '<span class="tag">saved case, not shrunk' in pages(run)["index.html"]


def test_the_same_ledger_gives_the_same_bytes(run: Path) -> None:
    write(run)
    first = files(run)
    write(run, workers=2)
    assert files(run) == first


def test_each_kind_has_a_picture_for_the_summary_of_a_build(run: Path) -> None:
    written = write(run)
    (kind,) = written.page.kinds
    picture = cv2.imread(str(written.index.parent / kind.still))
    assert picture is not None
    assert picture.shape == (300, 400, 3)
    url = "https://example.org/report"
    shown = "\n".join(index_parts(written.page, written.index.parent, url))
    assert f'<a href="{url}/{kind.page.address}"><img src="{url}/{kind.still}"' in shown
    assert "data:" not in shown
    unpublished = "\n".join(index_parts(written.page, written.index.parent, ""))
    assert "<img" not in unpublished
    assert "`report/index.html`" in unpublished


def test_hostile_text_gives_the_summary_of_a_build_no_element(tmp_path: Path, video: Video) -> None:
    hurt = lost(signature=f"own:{HOSTILE}", story=HOSTILE)
    write_ledger(tmp_path, [Flown(result=hurt, flight=video.flight)])
    written = write(tmp_path)
    for url in ("", "https://example.org"):
        text = "\n".join(index_parts(written.page, written.index.parent, url))
        names = re.findall(r"(?<!\\)<(\w+)", text)
        assert set(names) <= {"a", "img", "br", "details", "summary"}
        assert "\x1b" not in text


def test_pages_stay_small(run: Path) -> None:
    write(run)
    sizes = {name: len(text.encode()) for name, text in pages(run).items()}
    assert sizes.pop("index.html") < 300_000
    assert all(size < 1_000_000 for size in sizes.values())


def test_a_run_without_violations_has_an_index_only(tmp_path: Path, video: Video) -> None:
    write_ledger(tmp_path, [Flown(result=flight_result(completed=True), flight=video.flight)])
    assert write(tmp_path).pages == 0
    assert "no violation in 1 flights" in pages(tmp_path)["index.html"]
    assert "Nothing was found. That is no proof" in pages(tmp_path)["index.html"]


def test_a_run_that_was_killed_is_reported_as_far_as_it_went(run: Path) -> None:
    with closing(sqlite3.connect(run / ".garl" / "ledger.sqlite")) as ledger, ledger:
        ledger.execute("DELETE FROM run WHERE key = 'ended'")
        ledger.execute(
            "UPDATE slot SET state = 'claimed', result = NULL, sha256 = NULL WHERE slot = 2"
        )
    write(run)
    assert "This run is not finished: 2 of 3 flights." in pages(run)["index.html"]


def test_a_run_before_its_first_flight_has_a_report(tmp_path: Path) -> None:
    write_ledger(tmp_path, [])
    assert write(tmp_path).pages == 0
    assert "No flights yet" in pages(tmp_path)["index.html"]


def test_hostile_names_and_texts_change_no_element(tmp_path: Path, video: Video) -> None:
    def tags(folder: Path, text: str, system: str) -> list[list[str]]:
        crash = Crash(kind="raised", error=text, message=text, where="step", traceback=text)
        result = flight_result(
            f"V:{text}@step",
            outcome="crashed",
            primary="crash",
            violation_type="V",
            story=f"The landing system raised: {text}.",
            crash=crash,
        )
        write_ledger(folder, [Flown(result=result, flight=video.flight)], system=system)
        write(folder)
        return [Elements(page).tags for page in pages(folder).values()]

    plain = tags(tmp_path / "plain", "plain", "my_stack:Hovers")
    assert tags(tmp_path / "hostile", HOSTILE, f"{HOSTILE}:{HOSTILE}") == plain
    files = [each.name for each in (tmp_path / "hostile" / "report" / "kinds").iterdir()]
    assert all(re.fullmatch(r"[\w-]+\.html", name) for name in files)
    assert not any(
        "\x1b" in page or "\x00" in page for page in pages(tmp_path / "hostile").values()
    )


def test_a_megabyte_of_text_fills_no_page(tmp_path: Path, video: Video) -> None:
    text = "x" * 1_000_000
    crash = Crash(kind="raised", error="E", message=text, where="step", traceback=text)
    result = flight_result(
        "V:E@step", outcome="crashed", violation_type="V", story=f"Raised: {text}.", crash=crash
    )
    write_ledger(tmp_path, [Flown(result=result, flight=video.flight)])
    write(tmp_path)
    found = pages(tmp_path)
    assert len(found["index.html"]) < 100_000
    assert max(map(len, found.values())) < 1_000_000
    assert "more characters" in kind_page(tmp_path)


def test_a_process_that_left_no_record_has_a_page_of_text(tmp_path: Path) -> None:
    crash = Crash(kind="died", error="exit status 3", message="gone", where="")
    result = flight_result("V:died:3", outcome="crashed", violation_type="V", crash=crash)
    write_ledger(tmp_path, [Flown(result=result)])
    assert write(tmp_path).notes == ()
    assert "ended before its record was written" in kind_page(tmp_path)
    assert "<script" not in kind_page(tmp_path)


def test_missing_records_are_named_once(run: Path) -> None:
    shutil.rmtree(run / ".garl" / "flights")
    (note,) = write(run).notes
    assert note.startswith("1 of 1 flights have no record")
    assert "expected 01234567-lawn-g00-s01.npz in " in note
    assert "Copy the folder flights beside the ledger" in note
    assert "1 of 1 flights have no record" in pages(run)["index.html"]


def test_a_ledger_that_was_copied_finds_its_records_beside_it(run: Path, tmp_path: Path) -> None:
    there = tmp_path / "there" / ".garl"
    shutil.move(run / ".garl", there)
    written = write(tmp_path / "there")
    assert written.notes == ()
    assert "data-moment=" in kind_page(tmp_path / "there")


def test_a_damaged_record_is_told_on_its_page(run: Path) -> None:
    (record,) = (run / ".garl" / "flights").glob("*s01.npz")
    record.write_bytes(b"PK not a record")
    write(run)
    assert "The record of this flight cannot be read" in kind_page(run)


def test_a_ledger_without_a_camera_has_a_path_and_no_pictures(tmp_path: Path, video: Video) -> None:
    write_ledger(tmp_path, [Flown(result=lost(), flight=video.flight)], camera=None)
    write(tmp_path)
    assert "The ledger does not name the camera" in kind_page(tmp_path)
    assert "data-moment=" not in kind_page(tmp_path)
    assert data_of(kind_page(tmp_path))["scene"]


def test_another_simulator_has_a_path_and_no_pictures(tmp_path: Path, video: Video) -> None:
    other = Reference(module="my_simulator", file="", qualname="fly")
    write_ledger(tmp_path, [Flown(result=lost(), flight=video.flight)], simulator=other)
    write(tmp_path)
    assert "Flown by my_simulator:fly" in kind_page(tmp_path)
    assert data_of(kind_page(tmp_path))["scene"] is None


def broken_ledgers(run: Path) -> Iterator[tuple[Path, str]]:
    path = run / ".garl" / "ledger.sqlite"
    yield run / "nowhere.sqlite", "there is no ledger at .*run a search first"
    text = run / "text.sqlite"
    text.write_text("no ledger")
    yield text, "file is not a database"
    old = run / "old.sqlite"
    shutil.copy(path, old)
    with closing(sqlite3.connect(old)) as ledger, ledger:
        ledger.execute("UPDATE run SET value = '3' WHERE key = 'ledger'")
    yield old, "found a ledger of version 3, expected"
    damaged = run / "damaged.sqlite"
    shutil.copy(path, damaged)
    with closing(sqlite3.connect(damaged)) as ledger, ledger:
        ledger.execute("UPDATE slot SET result = '{' WHERE slot = 1")
    yield damaged, "is damaged or no ledger of this version"


def test_the_picture_of_a_build_is_the_one_that_shows_the_cause(
    tmp_path: Path, video: Video
) -> None:
    uav = video.flight.uav
    sinks = uav.position_m.copy()
    sinks[uav.time_s > 2.5, 2] = 0.2
    flight = dataclasses.replace(video.flight, uav=dataclasses.replace(uav, position_m=sinks))
    write_ledger(tmp_path, [Flown(result=lost(), flight=flight)])
    (kind,) = write(tmp_path).page.kinds
    evidence = Evidence(flight)
    moments = moments_of(evidence)
    shows = telling_moment(evidence, moments)
    assert shows is not None
    assert shows != moments[-1]
    page = kind_page(tmp_path)
    shown = re.findall(r'class="moment".*?src="data:image/jpeg;base64,([^"]+)"', page, re.DOTALL)
    expected = base64.b64decode(shown[moments.index(shows)])
    assert (tmp_path / "report" / kind.still).read_bytes() == expected


def test_a_ledger_that_cannot_be_read_is_one_message_and_no_report(run: Path) -> None:
    for path, words in broken_ledgers(run):
        with pytest.raises(LedgerError, match=words):
            write(run, path)
        assert not (run / "report").exists()


def test_without_an_encoder_there_are_stills_and_a_note(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hide_encoders(monkeypatch)
    (note,) = write(run, films=1).notes
    assert note.startswith("There are no films: a video needs an ffmpeg with the encoder libx264")
    assert "<video" not in kind_page(run)
    assert "data-moment=" in kind_page(run)


def test_a_film_stands_in_the_page(run: Path) -> None:
    assert write(run, films=1).films == 1
    page = kind_page(run)
    assert 'src="data:video/mp4;base64,' in page
    assert len(page) < 2_000_000
