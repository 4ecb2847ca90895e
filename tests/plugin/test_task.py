"""``marker=`` and ``start=`` of a test reach every flight; what cannot be is refused."""

from __future__ import annotations

import pytest

from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.fiducial import MarkerSpec
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.verdicts.verdict import Limits
from tests.support.landing_project import project, run


def with_arguments(pytester: pytest.Pytester, arguments: str, maps: str = "['lawn']") -> None:
    project(pytester, maps=maps)
    tests = pytester.path / "test_it.py"
    text = tests.read_text().replace("maps=", f"{arguments}, maps=")
    tests.write_text(f"import pytest_garl\n{text}")


def tasks_flown(pytester: pytest.Pytester) -> set[Task]:
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    try:
        return {
            parse_scenario(row.scenario).task
            for search, _ in ledger.searches()
            for row in ledger.queries.flights(search)
        }
    finally:
        ledger.close()


@pytest.mark.parametrize("method", ["garl", "random"])
def test_marker_and_start_reach_every_flight(pytester: pytest.Pytester, method: str) -> None:
    with_arguments(
        pytester,
        'marker=pytest_garl.MarkerSpec(dictionary="DICT_APRILTAG_36h11", id=3, side_m=0.5), '
        'start={"mode": "hover", "height_m": 6.0}',
    )
    run(pytester, "--garl-budget=4", "--garl-population=2", f"--garl-method={method}")
    spec = MarkerSpec(dictionary="DICT_APRILTAG_36h11", id=3, side_m=0.5)
    assert tasks_flown(pytester) == {
        Task(marker=spec, start=Start(mode="hover", height_m=6.0, offset_m=(0.0, 0.0)))
    }


def test_a_start_is_named_by_its_mode(pytester: pytest.Pytester) -> None:
    with_arguments(pytester, 'start="hover"')
    run(pytester, "--garl-budget=2", "--garl-population=2")
    assert {task.start for task in tasks_flown(pytester)} == {Start(mode="hover")}


def test_a_saved_case_keeps_the_marker(pytester: pytest.Pytester) -> None:
    with_arguments(pytester, "marker={'id': 9, 'side_m': 2.0}", maps="['court']")
    tests = pytester.path / "test_it.py"
    tests.write_text(tests.read_text().replace("system=Good", "system=Raises"))
    run(pytester, "--garl-budget=2", "--garl-shrink=8")
    (case,) = (pytester.path / "scenarios" / "regressions").rglob("*.toml")
    assert 'dictionary = "DICT_5X5_50"\nid = 9\nside_m = 2.0\n' in case.read_text()
    assert "distance_m = 1.0\n" in case.read_text()
    run(pytester, "-k", "case")
    assert tasks_flown(pytester) == {Task(marker=MarkerSpec(id=9, side_m=2.0))}


@pytest.mark.parametrize(
    ("given", "distance_m"), [("time_s=100", 0.3), ("time_s=100, distance_m=0.75", 0.75)]
)
def test_limits_that_state_no_distance_follow_the_size_of_the_marker(
    pytester: pytest.Pytester, given: str, distance_m: float
) -> None:
    with_arguments(pytester, f"marker={{'side_m': 0.5}}, limits=pytest_garl.limits({given})")
    run(pytester, "--garl-budget=1", "--garl-workers=0")
    ledger = Ledger(pytester.path / ".garl" / "ledger.sqlite")
    [(_, job)] = ledger.searches()
    ledger.close()
    assert parse_job(job).limits == Limits(distance_m=distance_m, time_s=100)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("marker=3", "*mark.garl: marker=3: expected pytest_garl.MarkerSpec(...)*"),
        ("marker={'size_m': 1.0}", "*marker= has size_m; expected dictionary, id, side_m, nested*"),
        ("marker={'id': 77}", "*marker: found id = 77, expected a whole number from 0 to 49*"),
        ("start=7", "*start=7: expected pytest_garl.Start(...)*"),
        ("start='air'", "*start: found mode = 'air', expected 'ground', 'hover' or 'hold'*"),
        (
            "start={'mode': 'air'}",
            "*start: found mode = 'air', expected 'ground', 'hover' or 'hold'*",
        ),
    ],
)
def test_an_invalid_marker_or_start_is_refused(
    pytester: pytest.Pytester, arguments: str, words: str
) -> None:
    with_arguments(pytester, arguments)
    result = run(pytester, "--garl-budget=2")
    result.stdout.fnmatch_lines([words])
    result.assert_outcomes(errors=1)


def test_a_marker_that_the_maps_ground_has_too_is_refused(pytester: pytest.Pytester) -> None:
    from pytest_garl.scenarios.maps.loading import load_map

    layers = load_map("court").ground.layers
    number = next(each.marker_id for each in layers if each.kind == "marker")
    with_arguments(pytester, f"marker=dict(id={number})", maps="['court']")
    result = run(pytester, "--garl-budget=2")
    result.stdout.fnmatch_lines([f"*the map 'court' has another marker of the id {number}*"])
