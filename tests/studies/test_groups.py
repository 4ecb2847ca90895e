"""The study that flies each group alone."""

from __future__ import annotations

import pytest

from pytest_garl.scenarios.domains.domain import CONDITIONS
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.units import sections_of
from studies import groups


def values_of(group: str, number: int) -> dict[str, float]:
    scenario = groups.scenario_of(group, number)
    sections = sections_of(scenario, load_map(scenario.map))
    return {
        f"{head}.{name}": value
        for head, values in sections.items()
        for name, value in values.items()
        if f"{head}.{name}" in CONDITIONS
        and value != pytest.approx(CONDITIONS[f"{head}.{name}"].nominal)
    }


@pytest.mark.parametrize("group", groups.group_names())
def test_only_the_named_group_acts_at_its_end(group: str) -> None:
    always = set(values_of(groups.NONE, 3))
    acting = set(values_of(group, 3)) - always
    assert bool(acting) == (group != groups.NONE)
    assert len({key.partition(".")[0] for key in acting}) <= 1


def test_wind_is_strongest_and_place_stays() -> None:
    wind, calm = groups.scenario_of("wind", 5), groups.scenario_of(groups.NONE, 5)
    assert values_of("wind", 5)["wind.mean_mps"] == 6
    assert (wind.seed, wind["marker.x"], wind["marker.y"]) == (
        calm.seed,
        calm["marker.x"],
        calm["marker.y"],
    )
    assert wind.removed_objects == calm.removed_objects != ()


def test_report_counts_landings_violations_and_causes() -> None:
    row = {"group": "wind", "system": "mm", "outcome": "landed", "no_landing": "", "kind": ""}
    rows = [
        row,
        {**row, "kind": "off"},
        {**row, "outcome": "aborted", "no_landing": "excused"},
        {**row, "outcome": "aborted", "no_landing": "needless", "kind": "II:gave-up-in-sight"},
    ]
    line = groups.report(rows).splitlines()[-1]
    assert line == (
        "| wind | – | – | – | 50 % landed; 1 II:gave-up-in-sight; 1 gave up, excused; 1 off |"
    )


def test_table_is_written_between_its_marks() -> None:
    page = f"before\n{groups.BEGIN}old\n{groups.END}after\n"
    assert groups.with_table(page, "new") == f"before\n{groups.BEGIN}\nnew\n\n{groups.END}after\n"
    with pytest.raises(SystemExit):
        groups.with_table("no marks", "new")
