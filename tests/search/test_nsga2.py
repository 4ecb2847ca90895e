from __future__ import annotations

from typing import Any

import numpy as np

from pytest_garl.search.nsga2 import Nsga2
from pytest_garl.search.operators import property_mutation
from tests.search.searches import bred, plan


def test_survivors_are_measured_against_parents_and_offspring_together() -> None:
    widths = []

    def objectives(chromosomes: Any, flown: Any) -> Any:
        widths.append(len(chromosomes))
        return np.column_stack([chromosomes[:, 0], chromosomes[:, 1]])

    method = Nsga2("test", plan(), objectives, objective_count=2, mutation=property_mutation)
    bred(method, 2)
    # The first generation, alone twice; then the offspring alone, then the union.
    assert widths == [8, 8, 8, 16]
