"""The pages in a browser: they are drawn without an error, and one cursor moves all views."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from pytest_garl.cases.corpus import Corpus
from pytest_garl.flight.flight import Crash
from pytest_garl.reports.html.report import write_html_report
from pytest_garl.reports.run_reading import read_run
from tests.reports.html.test_rendering import HOSTILE
from tests.reports.html.test_report import lost
from tests.support.chromium import PROGRAM, Browser, browser
from tests.support.report_ledgers import Flown, write_ledger
from tests.support.results import flight_result
from tests.support.videos import Video

pytestmark = [
    pytest.mark.sim,
    pytest.mark.skipif(not PROGRAM, reason="Chromium is not installed"),
]
VIEWS = """({
    film: document.getElementById('film') && document.getElementById('film').currentTime,
    still: document.getElementById('still') && document.getElementById('still').dataset.time,
    path: Number(document.getElementById('path').dataset.time),
    timeline: Number(document.getElementById('metres').dataset.time),
    slider: Number(document.getElementById('time').value),
    strips: document.querySelector('.strip-cursor').style.left,
})"""


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with browser() as found:
        yield found


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory, video: Video) -> Path:
    """Write the report of a run with a violation, a crash with hostile words, and a landing."""
    folder = tmp_path_factory.mktemp("run")
    crash = Crash(kind="raised", error="E", message=HOSTILE, where="step", traceback=HOSTILE)
    crashed = flight_result(
        f"V:{HOSTILE}@step",
        outcome="crashed",
        primary="crash",
        violation_type="V",
        story=f"The landing system raised: {HOSTILE}.",
        crash=crash,
    )
    results = [lost(), crashed, flight_result(completed=True), lost()]
    path = write_ledger(folder, [Flown(result=each, flight=video.flight) for each in results])
    run = read_run(path, Corpus(folder / "cases"))
    write_html_report(run, folder / "report", films=1, workers=1)
    return folder / "report"


def page(report: Path, words: str) -> Path:
    (found,) = (report / "kinds").glob(f"*{words}*.html")
    return found


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("dark", [False, True])
def test_pages_are_drawn_without_an_error(
    report: Path, chromium: Browser, width: int, dark: bool
) -> None:
    for file in (report / "index.html", *(report / "kinds").iterdir()):
        chromium.open(file, width=width, dark=dark)
        assert chromium.evaluate("document.documentElement.scrollWidth") == width, file.name
        assert chromium.evaluate("document.body.innerText.length") > 200
        assert chromium.evaluate(
            "window.alerted === undefined && !document.querySelector('[src=x]')"
        )
    assert chromium.problems == []


def test_one_cursor_moves_film_path_and_timeline(report: Path, chromium: Browser) -> None:
    chromium.open(page(report, "II-lost"))
    chromium.wait_for("document.getElementById('film').readyState >= 2")
    start_s = chromium.evaluate("garl.flight.film_start_s")
    for time_s in (0.5, 2.5, 1.5):
        chromium.evaluate(
            f"(s => {{ s.value = {time_s}; s.dispatchEvent(new Event('input')); }})"
            "(document.getElementById('time'))"
        )
        chromium.wait_for("!document.getElementById('film').seeking")
        chromium.wait_for(f"Number(document.getElementById('path').dataset.time) == {time_s}")
        views = chromium.evaluate(VIEWS)
        assert views["film"] == pytest.approx(time_s - start_s, abs=0.06)
        assert views["timeline"] == views["slider"] == time_s
        assert views["strips"].startswith("calc(")
    assert chromium.problems == []


def test_a_page_opens_at_the_moment_that_film_and_charts_both_show(
    report: Path, chromium: Browser
) -> None:
    chromium.open(page(report, "II-lost"))
    opens_s = chromium.evaluate("garl.flight.opens_s")
    assert opens_s > 0
    chromium.wait_for("document.getElementById('film').readyState >= 2")
    chromium.wait_for("!document.getElementById('film').seeking")
    views = chromium.evaluate(VIEWS)
    start_s = chromium.evaluate("garl.flight.film_start_s")
    assert views["film"] == pytest.approx(opens_s - start_s, abs=0.06)
    assert views["timeline"] == views["path"] == pytest.approx(opens_s, abs=0.06)


def test_the_film_plays_and_takes_the_cursor_along(report: Path, chromium: Browser) -> None:
    chromium.open(page(report, "II-lost"))
    chromium.wait_for("document.getElementById('film').readyState >= 2")
    chromium.evaluate("garl.setTime(0, 'slider')")
    chromium.evaluate("document.getElementById('play').click()")
    chromium.wait_for("document.getElementById('film').currentTime > 0.6")
    chromium.wait_for("Number(document.getElementById('path').dataset.time) > 0.5")
    assert chromium.evaluate(VIEWS)["timeline"] > 0.5
    chromium.evaluate("document.getElementById('play').click()")
    chromium.wait_for("document.getElementById('film').paused")


def test_without_a_film_a_still_and_the_clock_take_its_place(
    report: Path, chromium: Browser
) -> None:
    chromium.open(page(report, "-V-"))
    first = chromium.evaluate("Number(document.querySelector('[data-moment]').dataset.moment)")
    chromium.evaluate("document.querySelector('[data-moment]').click()")
    chromium.wait_for(f"Number(document.getElementById('path').dataset.time) == {first}")
    views = chromium.evaluate(VIEWS)
    assert views["film"] is None
    assert (float(views["still"]), views["timeline"]) == (first, first)
    chromium.evaluate("garl.setTime(0, 'slider')")
    chromium.evaluate("document.getElementById('play').click()")
    chromium.wait_for("garl.time > 0.3")


def test_keys_turn_the_path(report: Path, chromium: Browser) -> None:
    chromium.open(page(report, "II-lost"))
    picture = "document.getElementById('path').toDataURL()"
    before = chromium.evaluate(picture)
    chromium.evaluate(
        "document.getElementById('path').dispatchEvent(new KeyboardEvent('keydown', "
        "{key: 'ArrowLeft', cancelable: true}))"
    )
    chromium.wait_for(f"{picture} !== {before!r}")
    assert chromium.evaluate("document.getElementById('path').tabIndex") == 0


def test_no_hostile_text_is_run(report: Path, chromium: Browser) -> None:
    chromium.open(page(report, "-V-"))
    assert "<script>alert(1)</script>" in chromium.evaluate("document.body.innerText")
    assert chromium.evaluate("document.querySelectorAll('script').length") == 6
    assert chromium.problems == []
