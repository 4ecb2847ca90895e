from __future__ import annotations

import pytest

from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.conditions import active_conditions
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map

LAWN = load_map("lawn")
GENOME = genome_for(LAWN)
NOMINAL = decode(GENOME.nominal, GENOME, map="lawn", seed=0)


def test_nominal_scenario_has_no_active_condition() -> None:
    assert active_conditions(NOMINAL) == ()
    assert active_conditions(NOMINAL.replace({"told.surveyed": 1.0})) == ()


@pytest.mark.parametrize(
    ("values", "cause", "share", "words"),
    [
        ({"environment.fog": 10 / 11}, "fog", 10 / 11, "visibility 11 m"),
        ({"environment.rain": 0.3}, "rain", 0.3, "30 mm/h"),
        ({"environment.road_snow": 0.4}, "snow", 0.4, "cover 40 %"),
        ({"environment.sun_position": 0.1}, "light", 0.8, "sun 14 degrees high"),
        ({"environment.sun_position": 0.0}, "light", 1.0, "sun 6 degrees below the horizon"),
        ({"told.surveyed": 1.0, "told.error_m": 5.0}, "told", 0.25, "error 5 m"),
        ({"decoy-1.kind": 7.0}, "decoy-1", 0.0, "qr-code"),
    ],
)
def test_condition_says_its_share_and_its_value(
    values: dict[str, float], cause: str, share: float, words: str
) -> None:
    (found,) = active_conditions(NOMINAL.replace(values))
    assert (found.cause, found.words) == (cause, words)
    assert found.share == pytest.approx(share, abs=1e-4)


def test_strongest_value_of_a_cause_counts() -> None:
    (rain,) = active_conditions(
        NOMINAL.replace({"environment.rain": 0.1, "environment.road_wetness": 0.8})
    )
    assert (rain.cause, rain.share, rain.words) == ("rain", 0.8, "wetness 80 %")


def test_direction_has_no_harsher_end() -> None:
    wind = {"wind.mean_mps": 3.0, "wind.towards_deg": 180.0}
    (found,) = active_conditions(NOMINAL.replace(wind))
    assert found.words == "mean 3 m/s"
    (turned,) = active_conditions(NOMINAL.replace({"light.turn_deg": 90.0}))
    assert (turned.cause, turned.share) == ("light", 0.0)


def test_condition_names_three_values_and_counts_more() -> None:
    camera = {"camera.dirt_percent": 30.0, "camera.exposure_ms": 10.0}
    camera |= {"camera.mounting_yaw_deg": 3.0}
    (three,) = active_conditions(NOMINAL.replace(camera))
    assert three.named == "mounting yaw 3 degrees, exposure 10 ms, dirt 30 %"
    (four,) = active_conditions(NOMINAL.replace(camera | {"camera.mounting_roll_deg": 3.0}))
    assert four.named == "4 values"


def test_a_pad_that_lies_turned_is_named_beside_its_wear() -> None:
    (pad,) = active_conditions(NOMINAL.replace({"pad.yaw_deg": -27.0, "pad.worn_percent": 18.0}))
    assert pad.named == "yaw -27 degrees, worn 18 %"
    assert pad.words == "worn 18 %"


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"wind.mean_mps": 3.0, "wind.towards_deg": 90.0}, "mean 3 m/s"),
        ({"decoy-1.kind": 7.0, "decoy-1.x_m": 4.0, "decoy-1.yaw_deg": 9.0}, "qr-code"),
        ({"light.turn_deg": 90.0}, "sun 60 degrees high"),
    ],
)
def test_place_or_direction_is_not_named_beside_anything_else(
    values: dict[str, float], named: str
) -> None:
    (found,) = active_conditions(NOMINAL.replace(values))
    assert found.named == named


def test_an_event_that_waits_for_a_moment_says_when_it_begins() -> None:
    cover = {"cover.lasts_s": 3.0, "cover.share_percent": 80.0, "cover.from_s": 1.0}
    (timed,) = active_conditions(NOMINAL.replace(cover))
    assert timed.named == "lasts 3 s, share 80 %"
    (tied,) = active_conditions(NOMINAL.replace(cover | {"cover.after": 5.0}))
    assert tied.named == "1.0 s after the marker can no longer be read, lasts 3 s, share 80 %"
    assert tied.values == timed.values
    (decided,) = active_conditions(NOMINAL.replace(cover | {"cover.after": 6.0}))
    assert decided.named == "when the director lets it go, lasts 3 s, share 80 %"
