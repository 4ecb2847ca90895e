"""Why violations are more or fewer than the paper's: its world, one difference at a time.

    python -m lab.paper_differences

flies the paper's search on the map ``lawn`` in each world of :data:`WORLDS`, 100 flights, three
seeds, three landing systems, and writes a row per search into
``docs/results/experiments/paper-differences.csv``; rows that are there are not flown again.

`npcs`
    NPCs as in the paper's code: all go at 3 m/s, and turn, start and stop at once.
`decoy`
    A marker of another id lies somewhere within 7.5 m of the coordinate: the paper's type I.
`weather`
    No rain, snow, dust or leaves fall, as in the paper's code; fog and what lies on the ground
    stay.
`all`
    The three together.

The domain `paper` as it ships, `ours`, is not among them: its rows are those of the paper's
experiment (``lab/experiment``), whose searches of the same method have the same flights.

The paper's end rule changes no flight, but what is counted, so each world has a column for it,
`code` (``lab/experiment/paper_code.py``).
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import hashlib
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from lab.arms import Arm
from lab.experiment.paper_code import violates_in_its_code
from lab.experiment.spec import PAPER_TYPES
from lab.one_search import Flown, flights_of
from lab.table import Key, ResultTable
from pytest_garl.execution.fly_and_judge import judged
from pytest_garl.execution.reference import system_named
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.groups import DECOY_KINDS
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.object_types import OBJECT_TYPES
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.method import SearchPlan
from pytest_garl.search.method_catalogue import default_policy, make_method
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS

FILE = Path(__file__).parents[1] / "docs" / "results" / "experiments" / "paper-differences.csv"
MAP, FLIGHTS, POPULATION, SEEDS = load_map("lawn"), 100, 20, (0, 1, 2)
METHOD = "garl-paper"
SYSTEMS = MappingProxyType(
    {
        "MM-MLS": "landing_systems.mm_mls:MultiModuleLandingSystem",
        "OpenCV-MLS": "landing_systems.opencv_mls:OpenCvLandingSystem",
        "TPHYolo-MLS": "landing_systems.tphyolo_mls:TphYoloLandingSystem",
    }
)
WORLDS = MappingProxyType(
    {
        "npcs": ("npcs",),
        "decoy": ("decoy",),
        "weather": ("weather",),
        "all": ("npcs", "decoy", "weather"),
    }
)
"""What each world has of the paper's."""
OURS = "ours"
"""The world that the others are compared with."""
KEY = ("system", "world", "seed")
NO_LANDING = ("blocked", "excused", "needless")
"""Why a UAV did not land: the marker was never free for long enough, never readable for long
enough, or neither."""
COUNTS = ("paper", "ours", "code", *PAPER_TYPES, "others", *NO_LANDING)
TABLE = ResultTable(file=FILE, columns=(*KEY, "flights", *COUNTS, "sha256"), key=KEY)

FALLING = tuple(f"environment.{name}" for name in ("dust", "rain", "snow", "maple_leaf"))
NPC_MPS, AT_ONCE = 3.0, 1e4


@contextlib.contextmanager
def without_limits() -> Iterator[None]:
    """Let NPCs move inside as in the paper's code.

    A bird keeps a least speed of 0.1 m/s, because it does not fly without one.
    """
    before = [
        (kind, {name: getattr(kind, name) for name in _limits_of(kind.flies)})
        for kind in OBJECT_TYPES.values()
    ]
    try:
        for kind in OBJECT_TYPES.values():
            _set(kind, _limits_of(kind.flies))
        yield
    finally:
        for kind, values in before:
            _set(kind, values)


def _limits_of(flies: bool) -> Mapping[str, float]:
    at_once = ("acceleration_mps2", "braking_mps2", "lateral_mps2", "turn_rate_radps")
    return {
        "top_speed_mps": NPC_MPS,
        "least_speed_mps": 0.1 if flies else 0.0,
        "sustained_speed_mps": math.inf,
        "burst_m": 0.0,
        "leap_m": 0.0,
        **dict.fromkeys(at_once, AT_ONCE),
    }


def _set(kind: object, values: Mapping[str, float]) -> None:
    for name, value in values.items():
        object.__setattr__(kind, name, value)


def with_decoy(scenario: Scenario) -> Scenario:
    """Return the scenario with a marker of another id, at a place that its seed draws."""
    rng = np.random.default_rng(scenario.seed)
    distance_m, towards = 7.5 * math.sqrt(rng.random()), 2 * math.pi * rng.random()
    place = distance_m * math.cos(towards), distance_m * math.sin(towards)
    kind = float(DECOY_KINDS.index("other-id"))
    genes = {"decoy-1.kind": kind, "decoy-1.x_m": place[0], "decoy-1.y_m": place[1]}
    return repair(scenario.replace(genes), MAP)


def fly_one(
    system: str, world: str, npcs: PolicySpec, scenario: Scenario
) -> tuple[Flown, bool, str]:
    """Fly a landing system in a world.

    Returns the flight, whether the paper's code counts it, and its hash.
    """
    import cv2

    cv2.setNumThreads(1)
    name, changed = SYSTEMS[system], WORLDS[world]
    if "weather" in changed:
        scenario = scenario.replace(dict.fromkeys(FALLING, 0.0))
    if "decoy" in changed:
        scenario = with_decoy(scenario)
    if "npcs" in changed:
        at_top = {f"{name}.velocity": 1.0 for name, _ in MAP.all_objects}
        scenario = scenario.replace(at_top)
    with without_limits() if "npcs" in changed else contextlib.nullcontext():
        flight = fly(scenario, system_named(name), npcs, map=MAP)
        result = judged(flight, DEFAULT_LIMITS)
    return Flown(result=result), violates_in_its_code(flight, name.partition(":")[2]), flight.sha256


def row_of(key: Key, pool: Executor) -> Mapping[str, Any]:
    """Fly the search of a key, and return its row."""
    system, world, seed = key
    domain = domain_named("paper")
    arm = Arm(
        name=METHOD,
        make=functools.partial(make_method, METHOD),
        npcs=policy_spec(default_policy(METHOD)),
        learns=False,
    )
    plan = SearchPlan(
        map=MAP,
        genome=genome_of(domain, MAP),
        seed=int(seed),
        flights=FLIGHTS,
        population=POPULATION,
    )
    counted, hashes = 0, hashlib.sha256()

    def fly_all(npcs: PolicySpec, scenarios: Sequence[Scenario]) -> Iterator[Flown]:
        nonlocal counted
        fly_in_world = functools.partial(fly_one, system, world, npcs)
        for flown, counts, sha256 in pool.map(fly_in_world, scenarios):
            counted += counts
            hashes.update(sha256.encode())
            yield flown

    results = [each.result for each in flights_of(arm, plan, FLIGHTS, fly_all)]
    verdicts = [each.verdict for each in results]
    types = Counter[str](each.violation_type or "" for each in verdicts if each.violation)
    causes = Counter[str](each.no_landing or "" for each in verdicts)
    return {
        **dict(zip(KEY, key, strict=True)),
        "flights": FLIGHTS,
        "paper": sum(each.paper_violation for each in verdicts),
        "ours": types.total(),
        "code": counted,
        **{name: types[name] for name in PAPER_TYPES},
        "others": types.total() - sum(types[name] for name in PAPER_TYPES),
        **{name: causes[name] for name in NO_LANDING},
        "sha256": hashes.hexdigest()[:12],
    }


def keys(systems: Iterable[str] = SYSTEMS) -> Iterator[Key]:
    """Yield the keys of all searches, first seeds first."""
    for seed in SEEDS:
        for system in systems:
            for world in WORLDS:
                yield system, world, str(seed)


def main() -> None:
    """Fly what the table lacks."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--systems", nargs="+", choices=SYSTEMS, default=list(SYSTEMS))
    parser.add_argument("--jobs", type=int, help="flying processes (default: one per core)")
    chosen = parser.parse_args()
    TABLE.fly_missing(keys(chosen.systems), row_of, chosen.jobs)


if __name__ == "__main__":
    main()
