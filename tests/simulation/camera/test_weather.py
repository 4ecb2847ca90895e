from __future__ import annotations

import re
from pathlib import Path

from pytest_garl.scenarios.genes import ENVIRONMENT


def test_the_page_on_weather_has_a_row_for_each_gene() -> None:
    page = (Path(__file__).parents[3] / "docs" / "weather.md").read_text()
    genes = page.partition("## ")[0]
    rows = re.findall(r"^\| ([a-z_]+) \| .+ \|$", genes, re.MULTILINE)
    assert sorted(row for row in rows if row != "gene") == sorted(
        key.partition(".")[2] for key in ENVIRONMENT
    )
