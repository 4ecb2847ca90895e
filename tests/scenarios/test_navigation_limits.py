"""Navigation errors that are drawn for airframes with RTK, GNSS and ideal navigation."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.names import BUILT_IN
from pytest_garl.scenarios.domains.own_navigation import RTK_LIMITS, within
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.search.methods.random import random_scenarios

FIELD = domain_named("field")


def domain_with(folder: Path, text: str) -> str:
    file = folder / "mine.toml"
    file.write_text(f'extends = "field"\n{text}\n')
    return str(file)


@pytest.mark.parametrize("name", BUILT_IN)
def test_gnss_leaves_a_domain_as_it_is(name: str) -> None:
    assert within(domain_named(name), "gnss") == domain_named(name)


def test_rtk_bounds_position_height_and_jump_but_not_heading_and_tilt() -> None:
    domain = within(FIELD, "rtk")
    for key, most in RTK_LIMITS.items():
        limits = domain.range_of(key)
        assert limits is not None
        assert limits[1] == most
    for key in ("navigation.yaw_deg", "navigation.tilt_deg", "navigation.correlation_s"):
        assert domain.range_of(key) == FIELD.range_of(key)
    assert domain.groups == FIELD.groups
    assert domain.range_of("wind.mean_mps") == FIELD.range_of("wind.mean_mps")


def test_rtk_leaves_a_range_that_is_smaller(tmp_path: Path) -> None:
    domain = domain_named(domain_with(tmp_path, "[navigation]\nposition_m = [0, 0.01]"))
    assert within(domain, "rtk").range_of("navigation.position_m") == (0.0, 0.01)


def test_ideal_navigation_has_no_errors_and_no_jump() -> None:
    domain = within(FIELD, "ideal")
    assert set(FIELD.groups) - set(domain.groups) == {"navigation", "jump"}


def test_scenarios_are_drawn_within_the_limits() -> None:
    court = load_map("court")
    genome = genome_of(within(FIELD, "rtk"), court)
    drawn = list(random_scenarios(court, genome, 3, 0, 150))
    assert 0 < max(each["navigation.position_m"] for each in drawn) <= 0.02
    assert 0 < max(each["jump.distance_m"] for each in drawn) <= 1.0
    assert max(each["navigation.tilt_deg"] for each in drawn) > 1.0


@pytest.mark.parametrize(
    ("navigation", "text", "words"),
    [
        ("rtk", "[navigation]\nposition_m = [1, 2]", ("navigation.position_m", "1", "0.02")),
        ("ideal", "[jump]\ndistance_m = [2, 3]", ("jump.distance_m", "2", "'ideal'")),
    ],
)
def test_a_domain_with_larger_errors_only_contradicts_the_airframe(
    tmp_path: Path, navigation: str, text: str, words: tuple[str, ...]
) -> None:
    domain = domain_named(domain_with(tmp_path, text))
    with pytest.raises(ScenarioError) as raised:
        within(domain, navigation)  # type: ignore[arg-type]
    for word in ("mine", *words):
        assert word in str(raised.value)
