"""The benchmarks watch functions by their names, which others rename."""

from __future__ import annotations

import pytest

from lab.benchmarks import field, speed


@pytest.mark.parametrize("parts", [field.PARTS, speed.PARTS], ids=["field", "speed"])
def test_the_parts_that_a_benchmark_watches_exist(parts: speed.Parts) -> None:
    missing = [
        f"{part}: {name}"
        for part, owner, names in parts
        for name in names
        if not callable(getattr(owner, name, None))
    ]
    assert not missing


def test_the_time_of_a_part_is_its_own() -> None:
    class Part:
        def slow(self) -> int:
            return sum(range(300_000))

    spent = speed.Shares((("slow", Part, ("slow",)),))
    assert spent.measure(lambda: Part().slow()) == sum(range(300_000))
    assert spent.seconds["slow"] > spent.seconds[speed.REST]
