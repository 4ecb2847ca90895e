from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from pytest_garl.errors import GarlError
from pytest_garl.scenarios.chromosome import encode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import problems
from pytest_garl.search.catalogue import METHODS, make_method
from pytest_garl.search.method import Flown, Method, Plan
from pytest_garl.search.operators import property_mutation

MAP = load_map("court")
GENOME = genome_for(MAP)


def plan(seed: int = 0, population: int = 8) -> Plan:
    return Plan(map=MAP, genome=GENOME, seed=seed, population=population)


def result(scenario: Scenario) -> dict[str, Any]:
    """Fog keeps it from the marker; a fast dog hits it."""
    fog, hit = scenario["environment.fog"], scenario["dog-1.velocity"] > 0.9
    far = 10 * fog
    primary = "collision" if hit else "distance" if far > 1.5 else None
    margins = [
        {"property": "distance", "value": 1.5 - far, "unit": "m", "decided": not hit, "reason": ""},
        {"property": "collision", "value": 0.0 if hit else 2.0, "unit": "m", "decided": True},
    ]
    signature = {"collision": "IV:dog", "distance": "off"}.get(primary or "", "")
    verdict = {"primary": primary, "signature": signature, "margins": margins}
    return {
        "outcome": "collision" if hit else "landed",
        "final_distance_m": far,
        "elapsed_s": 30.0,
        "closest_call": "",
        "closest_body": "",
        "verdict": verdict,
    }


def bred(method: Method, generations: int) -> list[list[Scenario]]:
    made = []
    for _ in range(generations):
        made.append(list(method.ask()))
        method.tell([Flown(scenario=each, result=result(each)) for each in made[-1]])
    return made


@pytest.mark.parametrize("name", METHODS)
def test_a_method_depends_on_its_plan_and_results_alone(name: str) -> None:
    first, again = (bred(make_method(name, plan()), 6) for _ in range(2))
    assert first == again
    assert bred(make_method(name, plan(seed=1)), 1) != first[:1]


@pytest.mark.parametrize("name", METHODS)
def test_every_scenario_is_valid_and_new(name: str) -> None:
    scenarios = [each for made in bred(make_method(name, plan()), 12) for each in made]
    assert not [found for each in scenarios for found in problems(each, MAP)]
    assert len({each.genes for each in scenarios}) == len(scenarios) == 96


@pytest.mark.parametrize("name", ["garl", "garl-paper", "ga"])
@pytest.mark.parametrize("population", [1, 2, 3, 20])
def test_any_population_breeds_its_like(name: str, population: int) -> None:
    made = bred(make_method(name, plan(population=population)), 4)
    assert [len(generation) for generation in made] == [population] * 4


def test_selection_finds_more_of_what_it_wants() -> None:
    def share(made: Sequence[Sequence[Scenario]]) -> float:
        return float(np.mean([result(s)["final_distance_m"] > 1.0 for made in made for s in made]))

    runs = [bred(make_method("garl-paper", plan(seed, population=20)), 15) for seed in range(4)]
    early = float(np.mean([share(generations[:2]) for generations in runs]))
    late = float(np.mean([share(generations[-5:]) for generations in runs]))
    assert late > early + 0.1


def test_a_scenarios_seed_is_inherited_with_its_objects() -> None:
    first, second = bred(make_method("garl-paper", plan()), 2)
    assert {each.seed for each in second} <= {each.seed for each in first}


def test_objectives_of_the_paper_are_distance_time_and_diversity() -> None:
    method = make_method("garl-paper", plan())
    scenarios = method.ask()
    values = method.tell([Flown(scenario=each, result=result(each)) for each in scenarios])
    rows = GENOME.normalise(np.array([encode(each, GENOME) for each in scenarios]))
    for scenario, row, (distance, elapsed, spread) in zip(scenarios, rows, values, strict=True):
        assert distance == result(scenario)["final_distance_m"]
        assert elapsed == 30.0
        assert spread == pytest.approx(np.linalg.norm(rows - row, axis=1).sum() / len(rows))


def test_survivors_are_measured_against_parents_and_offspring_together() -> None:
    from pytest_garl.search.methods.nsga2 import Nsga2

    widths = []

    def objectives(chromosomes: Any, flown: Any) -> Any:
        widths.append(len(chromosomes))
        return np.column_stack([chromosomes[:, 0], chromosomes[:, 1]])

    method = Nsga2("test", plan(), objectives, 2, property_mutation)
    bred(method, 2)
    # The first generation, alone twice; then the offspring alone, then the union.
    assert widths == [8, 8, 8, 16]


def test_a_search_of_ones_own_is_named_by_its_module() -> None:
    own = make_method("pytest_garl.search.methods.garl_paper:method", plan())
    assert bred(own, 2) == bred(make_method("garl-paper", plan()), 2)
    with pytest.raises(GarlError, match=r"'nowhere:method'.*cannot be loaded"):
        make_method("nowhere:method", plan())
