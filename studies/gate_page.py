"""The tables of ``docs/gate.md``, which ``python -m studies.gate rates`` writes."""

from __future__ import annotations

import numpy as np

from studies.gate_rates import DOCS, alarm_table, power_table
from studies.gate_sizes import size_table

PAGE = DOCS / "gate.md"
BEGIN, END = "<!-- Written by `python -m studies.gate rates`: -->\n", "<!-- To here. -->\n"


def write(draws: int) -> None:
    """Write the tables into the page, between its two marks."""
    rng = np.random.default_rng(0)
    tables = [
        f"False alarms in {draws} draws each:",
        "\n".join(alarm_table(draws, rng)),
        f"Failures of a worse landing system, MM-MLS in random scenarios, {draws // 4} draws each:",
        "\n".join(power_table(draws // 4, rng)),
        f"Failures of a less accurate or slower OpenCV-MLS, {draws // 4} draws each:",
        "\n".join(size_table(draws // 4, rng)),
    ]
    text = PAGE.read_text()
    before, _, rest = text.partition(BEGIN)
    after = rest.partition(END)[2]
    PAGE.write_text(before + BEGIN + "\n" + "\n\n".join(tables) + "\n\n" + END + after)
