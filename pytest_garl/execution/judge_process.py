"""A process that judges flights which were flown in this one, where the landing system's code ran.

Flights without workers, `garl check` and a case that is flown without pytest fly in the process
that asks for them.  The landing system may have replaced what judges there, such as `math.hypot`.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

from pytest_garl import cpu_dispatch
from pytest_garl.errors import GarlError, PoolError
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.fly_and_judge import FlownJob, judge_record, judged, measured
from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.processes import end_with_parent, ignore_ctrl_c
from pytest_garl.execution.result import FlightResult
from pytest_garl.files.json_values import dataclass_from
from pytest_garl.flight.flight import Flight
from pytest_garl.flight.flight_file import load, save
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.verdicts.verdict import Limits


class JudgeProcess:
    """Judges flights in a process of its own, which starts with the first ``start`` or flight."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._questions: IO[bytes] | None = None
        self._answers: IO[bytes] | None = None

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def start(self) -> None:
        """Start the process, best before the first flight: it starts while that is flown."""
        if self._process is not None:
            return
        # Not its standard files: whatever runs at the start of Python may write there.
        read_questions, write_questions = os.pipe()
        read_answers, write_answers = os.pipe()
        files = [read_questions, write_answers]
        process = subprocess.Popen(
            [sys.executable, "-m", __name__, str(os.getpid()), *map(str, files)],
            env={**os.environ, **cpu_dispatch.environment()},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            pass_fds=files,
            start_new_session=True,
        )
        for each in files:
            os.close(each)
        self._questions = os.fdopen(write_questions, "wb")
        self._answers = os.fdopen(read_answers, "rb")
        self._process = process

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
        """Return the result of a flight of which nobody keeps the record, without its severity.

        The built-in simulator has flown it.
        Raises NotFiniteError if the flight holds a NaN or an infinity.
        """
        with tempfile.TemporaryDirectory(prefix="garl-") as folder:
            record = Path(folder) / "flight.npz"
            save(flight, record)
            answer = self._ask({"record": str(record), "limits": dataclasses.asdict(limits)})
        return FlightResult.from_json(answer["result"])

    def close(self) -> None:
        """End the process."""
        if self._process is None:
            return
        self._process.kill()
        self._process.wait()
        self._process = None
        for file in (self._questions, self._answers):
            assert file is not None
            # Of a question that was not sent whole nothing can be sent any more.
            with contextlib.suppress(OSError):
                file.close()

    def _ask(self, question: dict[str, Any]) -> dict[str, Any]:
        self.start()
        assert self._process is not None
        assert self._questions is not None
        assert self._answers is not None
        text = b""
        try:
            self._questions.write(json.dumps(question).encode() + b"\n")
            self._questions.flush()
            text = self._answers.readline()
            if not text:
                status = self._process.wait()
                raise PoolError(f"the process that judges flights ended with status {status}")
        except OSError as error:
            raise PoolError(f"the process that judges flights cannot be asked: {error}") from error
        finally:
            if not text:
                # A signal may have interrupted it: the answer to this question would be taken for
                # that to the next.
                self.close()
        answer: dict[str, Any] = json.loads(text)
        if "error" in answer:
            raise GarlError(f"the flight cannot be judged: {answer['error']}")
        return answer


def main(parent: int, questions: int, answers: int) -> None:
    """Judge flight after flight until there are no more questions."""
    ignore_ctrl_c()
    end_with_parent(parent, signal.SIGKILL)
    with os.fdopen(questions, "rb") as reading, os.fdopen(answers, "wb") as writing:
        for text in reading:
            writing.write(json.dumps(_answer(json.loads(text))).encode() + b"\n")
            writing.flush()


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
    main(*(int(each) for each in sys.argv[1:]))
