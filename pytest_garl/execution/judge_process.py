"""A second process that judges the flights of this one, in which the landing system's code ran.

Without workers, in `garl check`, and for a case that is flown without pytest, a flight runs in the
process that asks for it.  There the landing system may have replaced what a verdict needs, such as
`math.hypot`.
"""

from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path
from typing import Any

from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.fly_and_judge import FlownJob, judge_record, judged, measured
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.result import FlightResult
from pytest_garl.execution.separate_process import AskedProcess, answer_questions
from pytest_garl.files.json_values import dataclass_from
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load, save
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.verdicts.verdict import Limits


class JudgeProcess(AskedProcess):
    """Judges flights in a process of its own, which starts with ``start`` or the first flight."""

    def __init__(self) -> None:
        super().__init__(__name__, "that judges flights")

    def judge(
        self, job: FlightJob, scenario: Scenario, flight: FlightId, flown: FlownJob
    ) -> tuple[FlightResult, str, float]:
        """Return the result of a flight, its trajectory's hash and its wall time.

        Raises GarlError if its record cannot be judged.
        """
        answer = self._ask(
            {
                "job": job.dumps(),
                "scenario": dump_scenario(scenario),
                "flight": dataclasses.asdict(flight),
                "flown": dataclasses.asdict(flown),
            }
        )
        return FlightResult.from_json(answer["result"]), answer["sha256"], answer["wall_s"]

    def judge_flight(self, flight: Flight, limits: Limits) -> FlightResult:
        """Return the result, without severity, of a flight whose record nobody keeps.

        The built-in simulator has flown it.
        Raises NotFiniteError if the flight holds a NaN or an infinity.
        """
        with tempfile.TemporaryDirectory(prefix="garl-") as folder:
            record = Path(folder) / "flight.npz"
            save(flight, record)
            answer = self._ask({"record": str(record), "limits": dataclasses.asdict(limits)})
        return FlightResult.from_json(answer["result"])

    def _ask(self, question: dict[str, Any]) -> dict[str, Any]:
        answer = self.ask(question)
        if "error" in answer:
            raise GarlError(f"the flight cannot be judged: {answer['error']}")
        return answer


def _answer(question: dict[str, Any]) -> dict[str, Any]:
    try:
        if "record" in question:
            limits = dataclass_from(Limits, question["limits"])
            flight = measured(load(Path(question["record"])))
            return {"result": judged(flight, limits).to_json()}
        result, sha256, wall_s = judge_record(
            parse_job(question["job"]),
            parse_scenario(question["scenario"]),
            dataclass_from(FlightId, question["flight"]),
            dataclass_from(FlownJob, question["flown"]),
        )
    except Exception as error:  # noqa: BLE001 (a record may hold anything)
        return {"error": f"{type(error).__name__}: {error}"}
    return {"result": result.to_json(), "sha256": sha256, "wall_s": wall_s}


if __name__ == "__main__":
    answer_questions(_answer)
