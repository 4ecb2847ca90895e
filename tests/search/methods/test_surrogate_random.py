from __future__ import annotations

from pytest_garl.search.catalogue import make_method
from tests.search.methods.test_nsga2 import plan


def test_the_scenarios_are_those_of_random_search() -> None:
    ours, random = (make_method(name, plan()) for name in ("surrogate-random", "random"))
    assert [ours.ask() for _ in range(3)] == [random.ask() for _ in range(3)]
