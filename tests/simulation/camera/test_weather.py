from __future__ import annotations

import re
from pathlib import Path

import pytest

from pytest_garl.scenarios.genes import ENVIRONMENT
from pytest_garl.simulation.camera.weather import in_units


@pytest.mark.parametrize("key", ENVIRONMENT)
def test_every_environment_gene_has_a_meaning_in_units(key: str) -> None:
    assert re.search(r"\d", in_units(key, 0.15))


def test_the_page_on_weather_has_a_row_for_each_gene() -> None:
    page = (Path(__file__).parents[3] / "docs" / "weather.md").read_text()
    rows = re.findall(r"^\| ([a-z_]+) \| .+ \|$", page, re.MULTILINE)
    assert sorted(row for row in rows if row != "gene") == sorted(
        key.partition(".")[2] for key in ENVIRONMENT
    )
