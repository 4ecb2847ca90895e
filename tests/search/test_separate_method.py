"""What a method breeds in a process of its own is what it breeds in this one."""

from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.errors import GarlError, PoolError
from pytest_garl.search.method import FlownScenario
from pytest_garl.search.method_catalogue import make_method
from pytest_garl.search.separate_method import MethodProcess, SeparateMethod
from tests.search.searches import bred, plan, result


@pytest.mark.parametrize("name", ["garl", "ga", "random"])
def test_it_breeds_the_same(name: str) -> None:
    """Both processes of this test compute by the baseline."""
    here = make_method(name, plan())
    with MethodProcess() as process:
        there = SeparateMethod(process, "court", name, plan())
        assert (there.learns, there.overlaps) == (here.learns, here.overlaps)
        if not there.learns:
            assert there.ask() == here.ask()
            return
        assert bred(there, 3) == bred(here, 3)
        assert there.origins == list(getattr(here, "origins", ()))


def test_it_knows_the_flights_of_an_archive() -> None:
    known = tuple(
        FlownScenario(scenario=each, result=result(each))
        for made in bred(make_method("garl", plan(seed=1)), 3)
        for each in made
    )
    remembering = dataclasses.replace(plan(), known=known)
    here = bred(make_method("garl", remembering), 4)
    with MethodProcess() as process:
        there = SeparateMethod(process, "court", "garl", remembering)
        assert bred(there, 4) == here
        assert any("archived-" in name for each in there.origins for name in each.parents)
    assert here != bred(make_method("garl", plan()), 4)


def test_searches_share_the_process() -> None:
    alone = make_method("garl", plan(seed=1)).ask()
    with MethodProcess() as process:
        searches = [SeparateMethod(process, str(seed), "garl", plan(seed)) for seed in (0, 1)]
        first = searches[0].ask()
        assert searches[1].ask() == alone != first


def test_its_mistakes_are_told_here() -> None:
    with MethodProcess() as process, pytest.raises(GarlError, match="cannot be loaded"):
        SeparateMethod(process, "court", "nowhere:method", plan())


def test_what_was_told_is_lost_with_the_process() -> None:
    with MethodProcess() as process:
        search = SeparateMethod(process, "court", "garl", plan())
        process.close()
        with pytest.raises(PoolError, match="that breeds scenarios ended"):
            search.ask()
