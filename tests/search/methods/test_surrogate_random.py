from __future__ import annotations

from pytest_garl.search.method_catalogue import make_method
from tests.search.searches import bred, plan


def test_the_scenarios_are_those_of_random() -> None:
    assert bred(make_method("surrogate-random", plan()), 3) == bred(
        make_method("random", plan()), 3
    )
