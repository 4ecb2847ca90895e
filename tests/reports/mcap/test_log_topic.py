from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.flight.flight import Crash, Event
from pytest_garl.landing_system import Diagnostics
from pytest_garl.reports.mcap.export import Export
from tests.support.mcap_files import needs_extra, read_mcap
from tests.support.recorded_flights import recorded, seen

needs_extra()
WORDS = "FileNotFoundError: no /home/ada/my stack/weights/net.onnx"
DEBUG, INFO, WARNING, ERROR = 1, 2, 3, 4


def told(export: Export, folder: Path) -> list[tuple[float, int, str, str]]:
    from pytest_garl.reports.mcap.writer import write_mcap

    path = folder / "flight.mcap"
    write_mcap(export, path)
    logs = read_mcap(path).topics["/events"]
    return [(time / 1e9, each.level, each.name, each.message) for time, each in logs]


def crashed() -> Export:
    said = {
        0: Diagnostics(phase="take-off"),
        20: Diagnostics(phase="search", note="nothing seen"),
        21: Diagnostics(phase="search", note="nothing seen"),
        40: Diagnostics(phase="approach"),
    }
    steps = tuple(
        dataclasses.replace(step, diagnostics=said.get(index))
        for index, step in enumerate(seen((), count=50))
    )
    crash = Crash(kind="raised", error="FileNotFoundError", message=WORDS, where="net.load")
    flight = recorded(steps=steps, outcome="crashed", crash=crash, end_s=5.0)
    happened = (
        Event(time_s=0.5, name="took_off", text="left the ground"),
        Event(time_s=2.0, name="phase", text="search"),
        Event(time_s=5.0, name="crashed", text=WORDS),
    )
    flight = dataclasses.replace(flight, events=happened, versions=(("pytest-garl", "0.2.0"),))
    return Export(name="lawn-g00-s01", flight=flight)


def test_events_phases_and_notes_are_told_in_order(tmp_path: Path) -> None:
    logs = told(crashed(), tmp_path)
    assert logs[:-2] == [
        (0.0, INFO, "simulator", "flight lawn-g00-s01, flown with pytest-garl 0.2.0"),
        (0.0, INFO, "landing system", "phase take-off"),
        (0.5, INFO, "simulator", "took_off: left the ground"),
        (2.0, INFO, "landing system", "phase search"),
        (2.0, DEBUG, "landing system", "nothing seen"),
        (4.0, INFO, "landing system", "phase approach"),
    ]
    assert logs[-2][:3] == (5.0, ERROR, "simulator")
    assert logs[-1][:3] == (5.0, ERROR, "verdict")
    assert logs[-1][3].startswith("V:FileNotFoundError@net.load")


def test_no_text_names_a_folder(tmp_path: Path) -> None:
    logs = told(crashed(), tmp_path)
    assert not any("ada" in text for *_, text in logs)
    assert sum("net.onnx" in text for *_, text in logs) == 2


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("no /home/ada/net.onnx.", "no net.onnx."),
        ("'/home/ada/my_stack/a.py' and ~/x/b.txt", "'a.py' and b.txt"),
        (r"C:\Users\ada\net.onnx", "net.onnx"),
        ("2.4 m/s at 3/4 of the way, and/or 1 / 2", "2.4 m/s at 3/4 of the way, and/or 1 / 2"),
        ("see https://example.org/a/b", "see https://example.org/a/b"),
    ],
)
def test_folders_of_paths_are_left_out(text: str, shown: str) -> None:
    from pytest_garl.reports.mcap.log_topic import without_folders

    assert without_folders(text) == shown


def test_the_verdict_has_the_signature_of_the_run(tmp_path: Path) -> None:
    flight = recorded(steps=seen(range(50)), outcome="landed")
    export = Export(name="it", flight=flight, signature="own:test_own: too slow")
    *_, (_, level, name, text) = told(export, tmp_path)
    assert (level, name) == (ERROR, "verdict")
    assert text.startswith("own:test_own: too slow: ")
