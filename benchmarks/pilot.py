"""How often the reference pilot lands in random scenarios with stationary objects."""

from __future__ import annotations

import sys

from pytest_garl.adversary.policies import policy_spec
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps import load_map
from pytest_garl.search.random_search import propose
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.reference_pilot import ReferencePilot


def main(count: int = 100) -> None:
    """Print the share of landings within 1.5 m per map, and what went wrong elsewhere."""
    for name in ("court", "lawn"):
        map = load_map(name)
        landed = 0
        for scenario in propose(map, genome_for(map, weather="full"), 1, 0, count):
            flight = fly(scenario, ReferencePilot, policy_spec("stationary"), map=map)
            good = flight.outcome == "landed" and flight.final_distance_m < 1.5
            landed += good
            if not good:
                touched = [contact.body for contact in flight.contacts]
                print(f"  {name} seed {scenario.seed}: {flight.outcome} {touched}")
        print(f"{name}: landed {landed} of {count}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
