"""The local pool and the Ray pool: flights per second, and the time that Ray adds per flight.

``python -m lab.benchmarks.pools`` flies the same scenarios with both in turns, so that other load
of the machine affects both alike.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.local_pool import local_pool
from pytest_garl.execution.on_demand import fly_all
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.ray.ray_pool import check_ray, ray_pool
from pytest_garl.execution.reference import BUILT_IN, reference_to
from pytest_garl.gate.record import BaselineSpec
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from tests.execution.flying import Good, job_of

ROOT = Path(__file__).parents[2]


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredPool:
    """A pool with its ledger."""

    name: str
    ledger: Ledger
    pool: Pool


@contextmanager
def both(workers: int) -> Iterator[Sequence[MeasuredPool]]:
    """Yield both pools, each with its own ledger; no worker has started yet."""
    with ExitStack() as stack:
        found = []
        for name in ("local", "ray"):
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="garl-"))
            ledger = Ledger.create(Path(folder) / "ledger.sqlite", {})
            pool = (
                ray_pool(ledger.queue, workers, ROOT)
                if name == "ray"
                else local_pool(ledger.queue, workers)
            )
            stack.callback(pool.close)
            found.append(MeasuredPool(name=name, ledger=ledger, pool=pool))
        yield found


def flown_s(
    each: MeasuredPool, job: FlightJob, scenarios: Sequence[Scenario]
) -> tuple[float, list[str]]:
    """Return the wall time of these flights, and the hashes of their trajectories."""
    job = dataclasses.replace(job, flights=str(each.ledger.path.parent / "flights"))
    began = time.perf_counter()
    flights = fly_all(each.ledger, each.pool, job, scenarios)
    hashes = [done.sha256 for done in flights]
    return time.perf_counter() - began, hashes


def in_turns(
    pools: Sequence[MeasuredPool], job: FlightJob, rounds: int, flights: int
) -> Mapping[str, float]:
    """Return each pool's wall time over all rounds of so many flights, and check their results."""
    scenarios = BaselineSpec(count=rounds * flights).scenarios(load_map(job.map))
    spent = dict.fromkeys((each.name for each in pools), 0.0)
    hashes: dict[str, list[str]] = {name: [] for name in spent}
    for number in range(rounds):
        part = scenarios[number * flights : (number + 1) * flights]
        for each in pools if number % 2 else reversed(pools):
            seconds, found = flown_s(each, job, part)
            spent[each.name] += seconds
            hashes[each.name] += found
    if hashes["local"] != hashes["ray"]:
        raise SystemExit("the pools returned different flights")
    return spent


def print_rates(what: str, spent: Mapping[str, float], flights: int, workers: int) -> None:
    """Print flights per second of both pools, their ratio, and the difference per flight."""
    local, ray = spent["local"], spent["ray"]
    beside = 1000 * workers * (ray - local) / flights
    print(
        f"{what}: {flights} flights on {workers} workers: local {flights / local:.2f}/s, "
        f"Ray {flights / ray:.2f}/s ({local / ray:.2f} times); Ray costs {beside:.0f} ms more per "
        "flight and worker",
        flush=True,
    )


def main() -> None:
    """Print the time to the first flight of each pool, then the rates of short and real flights."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--short", type=int, default=100, help="flights of a stand-in per round")
    parser.add_argument("--real", type=int, default=6, help="flights of OpenCV-MLS per round")
    arguments = parser.parse_args()
    check_ray(os.environ.get("RAY_ADDRESS", ""))
    workers, rounds = arguments.workers, arguments.rounds
    court = load_map("court")
    short = job_of(Good, ROOT)
    real = dataclasses.replace(
        short,
        system=reference_to(OpenCvLandingSystem),
        simulator=BUILT_IN,
        map=court.name,
        map_sha256=court.sha256,
        npcs=policy_spec("waypoint"),
        timeout_s=60.0,
    )
    with both(workers) as pools:
        for each in pools:
            seconds, _ = flown_s(
                each, short, BaselineSpec(count=1, seed=1).scenarios(load_map("lawn"))
            )
            print(f"{each.name}: first flight after {seconds:.1f} s", flush=True)
        for what, job, flights in (
            ("stand-in", short, arguments.short),
            ("OpenCV-MLS on court", real, arguments.real),
        ):
            # All workers have started, and imported what they fly.
            in_turns(pools, job, 1, 2 * workers)
            spent = in_turns(pools, job, rounds, flights)
            print_rates(what, spent, rounds * flights, workers)


if __name__ == "__main__":
    main()
