"""A shipped method in a process of its own, for a process that computes otherwise than workers do.

Plugins of pytest load in no order that one could choose.  One that loads NumPy before pytest-garl
lets it choose its code by the CPU, and then what is bred from the same results would differ from
one make of CPU to the next.
"""

from __future__ import annotations

import base64
import dataclasses
import pickle
from collections.abc import Sequence
from typing import Any

from pytest_garl.errors import GarlError
from pytest_garl.execution.result import Origin, parse_result
from pytest_garl.execution.separate_process import AskedProcess, answer_questions
from pytest_garl.files.json_values import dataclass_from
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.method import FlownScenario, Method, SearchPlan, TellsOrigins
from pytest_garl.search.method_catalogue import make_method


class MethodProcess(AskedProcess):
    """Breeds for the searches of a run; close it at the end."""

    def __init__(self) -> None:
        super().__init__(__name__, "that breeds scenarios")


class SeparateMethod:
    """A search by a shipped method, of which only the texts of its scenarios are known here.

    Calls raise GarlError if the method does, and PoolError if its process has ended.
    """

    def __init__(self, process: MethodProcess, search: str, name: str, plan: SearchPlan) -> None:
        self._process, self._search = process, search
        about = {"method": name, "plan": base64.b85encode(pickle.dumps(plan)).decode()}
        facts = self._ask(about)
        self.learns: bool = facts["learns"]
        self.overlaps: bool = facts["overlaps"]
        self.origins: Sequence[Origin] = ()
        """How the scenarios of the latest generation were made; none if the method does not say."""

    def ask(self) -> Sequence[Scenario]:
        """Return the next generation."""
        answer = self._ask({"flown": None})
        self.origins = [dataclass_from(Origin, each) for each in answer["origins"]]
        return [parse_scenario(text) for text in answer["scenarios"]]

    def tell(self, flown: Sequence[FlownScenario]) -> Sequence[tuple[float, ...]]:
        """Let the method learn; return its objectives."""
        texts = [(dump_scenario(each.scenario), each.result.dumps()) for each in flown]
        return [tuple(each) for each in self._ask({"flown": texts})["objectives"]]

    def _ask(self, question: dict[str, Any]) -> dict[str, Any]:
        answer = self._process.ask({"search": self._search, **question})
        if "error" in answer:
            raise GarlError(answer["error"])
        return answer


class _Methods:
    """The methods of the searches, in the process that breeds."""

    def __init__(self) -> None:
        self._methods: dict[str, Method] = {}

    def answer(self, question: dict[str, Any]) -> dict[str, Any]:
        """Begin a search, tell flights to its method, or ask that for a generation."""
        try:
            return self._answer(question)
        except GarlError as error:
            return {"error": str(error)}

    def _answer(self, question: dict[str, Any]) -> dict[str, Any]:
        search = question["search"]
        if "plan" in question:
            plan = pickle.loads(base64.b85decode(question["plan"]))
            method = self._methods[search] = make_method(question["method"], plan)
            return {"learns": method.learns, "overlaps": method.overlaps}
        method = self._methods[search]
        if question["flown"] is not None:
            flown = [
                FlownScenario(scenario=parse_scenario(scenario), result=parse_result(result))
                for scenario, result in question["flown"]
            ]
            return {"objectives": method.tell(flown)}
        scenarios = [dump_scenario(each) for each in method.ask()]
        origins = method.origins if isinstance(method, TellsOrigins) else ()
        return {"scenarios": scenarios, "origins": [dataclasses.asdict(each) for each in origins]}


if __name__ == "__main__":
    answer_questions(_Methods().answer)
