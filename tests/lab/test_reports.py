"""Reports of studies from rows."""

from __future__ import annotations

import json
from collections.abc import Sequence

from lab import ablations, kinds, preventability
from lab.table import Row


def test_ablations_are_compared_seed_by_seed() -> None:
    def row(variant: str, seed: int, kinds: int) -> dict[str, str]:
        counts = {f"IV:{number}": 10 for number in range(kinds)}
        facts = {"map": "court", "budget": "400", "landing": "sturdy"}
        early = {"early": "2", "middle": str(kinds - 1), "first": "9"}
        return {
            "variant": variant,
            "seed": str(seed),
            **facts,
            **early,
            "kinds": json.dumps(counts),
        }

    seeds = (1, 2, 3)
    rows: list[Row] = [row("garl", seed, 4 + seed) for seed in seeds]
    rows += [row("random", seed, 2 + seed) for seed in seeds]
    last = ablations.report(rows).splitlines()[-1]
    cells = [cell.strip() for cell in last.strip("|").split("|")]
    assert cells[:6] == ["random", "3", "4.0", "-2.0 ± 0.0", "3.0", "-2.0 ± 0.0"]


def test_kinds_of_two_methods_are_compared_at_equal_flights_and_violations() -> None:
    def row(method: str, seed: int, counts: Sequence[int]) -> Row:
        flights = {f"IV:{number}": list(range(count)) for number, count in enumerate(counts)}
        facts = {"map": "court", "flights": "400", "landed": "300", "excused": "0"}
        quiet = {"quiet": "200", "quiet_decided": "190"}
        key = {"method": method, "system": "mm", "seed": str(seed)}
        return {**key, **facts, **quiet, "kinds": json.dumps(flights)}

    rows = [row("garl", seed, [5] * 8) for seed in range(5)]
    rows += [row("random", seed, [5] * 4) for seed in range(5)]
    lines = kinds.report(rows).splitlines()
    titles, ours, theirs = ([cell.strip() for cell in lines[n].split("|")] for n in (0, 2, 3))
    found = dict(zip(titles, ours, strict=True))
    assert found["effective kinds"] == "8.0 (8.0 to 8.0)"
    assert found["times random's"] == "2.00"
    assert float(found["p (Holm)"]) < 0.05
    assert found["decided without interference, %"] == "95.0"
    assert dict(zip(titles, theirs, strict=True))["kinds at equal violations"] == "4.0 of 20"
    assert 7 < float(found["kinds at equal violations"].split()[0]) < 8
    assert lines[-2] == (
        "mm: 8 kinds in all searches of garl, 4 in those of random, 0 in those of random alone."
    )
    alone = kinds.report(rows[:5]).splitlines()[2].split("|")
    assert alone[titles.index("times random's")].strip() == "nan"


def test_kinds_are_compared_by_type_and_cause_alone_too() -> None:
    def row(method: str, seed: int, kinds: Sequence[str]) -> Row:
        facts = {"map": "court", "flights": "400", "landed": "300", "quiet": "9"}
        key = {"method": method, "system": "mm", "seed": str(seed), "quiet_decided": "9"}
        return {**key, **facts, "kinds": json.dumps({kind: [1, 2] for kind in kinds})}

    dogs = ["IV:dog:descent:seen", "IV:dog:descent:unseen", "IV:dog:last-metre:seen", "off:seen"]
    rows = [row("garl", seed, dogs) for seed in range(5)]
    rows += [row("random", seed, ["off:seen"]) for seed in range(5)]
    last = kinds.report(rows).splitlines()[-1]
    # A dog in six flights and a landing beside the marker in two: not 4 kinds, but 1.75.
    assert "1.8 effective ones of garl, 1.0 of random, 1.75 times" in last


def collision(
    answer: str, hold: str = "", blind: str = "", inevitable_s: str = ""
) -> dict[str, str]:
    return {
        **dict.fromkeys(preventability.TABLE.columns, ""),
        "system": "MM-MLS",
        "answer": answer,
        "inevitable_s": inevitable_s,
        "observed_s": "2.0" if hold else "",
        "hold": hold,
        "hold_touches_nothing": hold,
        "blind": blind,
        "blind_touches_nothing": "1" if blind else "",
        "reference_pilot": "1",
        "hold_late": "0",
        "blind_late": "0",
    }


def test_the_table_of_escapes_shows_the_placebos_of_those_that_were_observable() -> None:
    rows = [
        collision("preventable", "0", "0", "0.5"),
        collision("preventable", "0", "1", "1.5"),
        collision("sensor-limited", inevitable_s="1.0"),
        collision("unpreventable", "0", "0", "5.0"),
    ]
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in _table(rows)]
    assert lines[0][:6] == ["MM-MLS", "4", "2", "1", "1", "0"]
    assert lines[0][6] == "1.2 (0.9 to 2.4)"
    escapes = {name: (asked, found.partition(" ")[0]) for name, asked, found in lines[-9:]}
    assert escapes["planned escape, confirmed"] == ("4", "75.0")
    assert escapes["planned escape, 0.3 s after first observation"] == ("3", "66.7")
    assert escapes["placebo: last command held, from the state of the escape"] == ("4", "0.0")
    assert escapes["placebo: last command held, 0.3 s after first observation"] == ("3", "0.0")
    assert escapes["placebo: blind descent, 0.3 s after first observation"] == ("3", "33.3")


def _table(rows: Sequence[Row]) -> list[str]:
    return preventability.report([*rows]).splitlines()[2:]
