"""The stand-in as the model of itself: what a better model would be worth to evolution.

A copy of ``lab/stand_in.py``, all of whose constants are off by up to a share, takes the place of
the model that is fitted to flights.  With a share of 0 it is the ceiling: a model that is right.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import types
from collections.abc import Callable
from typing import Any

import numpy as np

from lab import stand_in, stand_in_way
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair
from pytest_garl.search.columns import Columns
from pytest_garl.search.method import SearchPlan
from pytest_garl.search.model import MarginModel, Prediction, proximities
from pytest_garl.search.operators import Matrix

SPREAD = 0.1
"""Of a proximity that it predicts."""
StandIn = Callable[..., FlightResult]


class _Off(ast.NodeTransformer):
    """Multiplies each constant that is no whole number."""

    def __init__(self, by: float, rng: np.random.Generator) -> None:
        self._by, self._rng = by, rng

    def visit_Constant(self, node: ast.Constant) -> ast.Constant:
        if isinstance(node.value, float):
            factor = float(self._rng.uniform(1 - self._by, 1 + self._by))
            return ast.copy_location(ast.Constant(value=node.value * factor), node)
        return node


def perturbed(by: float, seed: int) -> StandIn:
    """Return the stand-in with all of its constants off by up to a share."""
    rng = np.random.default_rng(seed)
    names: dict[str, Any] = {}
    copy: Any = None
    for module in (stand_in_way, stand_in):
        tree = _Off(by, rng).visit(ast.parse(inspect.getsource(module)))
        copy = types.ModuleType(module.__name__)
        exec(compile(tree, str(module.__file__), "exec"), copy.__dict__)
        # What the second one imports of the first one is the original.
        copy.__dict__.update({name: each for name, each in names.items() if name in vars(copy)})
        names = {name: each for name, each in vars(copy).items() if not name.startswith("__")}
    found: StandIn = copy.stand_in
    return found


class StandInModel(MarginModel):
    """Predicts margins by a stand-in; what is known of which flights, by the fitted model."""

    def __init__(
        self,
        plan: SearchPlan,
        copy: StandIn,
        landing: stand_in_way.LandingModel,
        columns: Columns,
        rows: Matrix,
        proximity: Matrix,
        violates: Matrix,
        rarity: Matrix,
    ) -> None:
        super().__init__(columns, rows, proximity, violates, rarity)
        self._plan, self._copy, self._landing = plan, copy, landing
        self._rarity: dict[str, float] = {}
        for row, rare in zip(rows, rarity, strict=True):
            if rare:
                signature = self._result(row).signature
                self._rarity[signature] = min(rare, self._rarity.get(signature, 1.0))

    def predict(self, rows: Matrix) -> Prediction:
        """Return what the stand-in says of chromosomes (m, d)."""
        results = [self._result(row) for row in rows]
        near = np.array([proximities(result) for result in results])
        return dataclasses.replace(
            super().predict(rows),
            proximity=near,
            spread=np.full_like(near, SPREAD),
            fails=np.array([float(result.verdict.violation) for result in results]),
            rarity=np.array(
                [
                    self._rarity.get(each.signature, 1.0) if each.signature else 0.0
                    for each in results
                ]
            ),
        )

    def _rare(self, signature: str) -> float:
        """Return how rare a kind is among the flights: 1 for one that none showed."""
        return self._rarity.get(signature, 1.0) if signature else 0.0

    def _result(self, row: Matrix) -> FlightResult:
        plan = self._plan
        scenario: Scenario = decode(row, plan.genome, map=plan.map.name, seed=0)
        return self._copy(repair(scenario, plan.map), plan.map, self._landing)
