"""Processes of their own, which compute as workers do, whatever was loaded first in this one.

One calls a function with a landing system; others answer one question after another.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

from pytest_garl import cpu_dispatch
from pytest_garl.errors import GarlError, LandingSystemError, PoolError
from pytest_garl.execution.processes import end_with_parent, ignore_ctrl_c
from pytest_garl.execution.reference import Reference, reference_to
from pytest_garl.program import AnySystem


def call_in_separate_process(
    function: str, system: AnySystem, options: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the JSON values that "module:function" returns for a class and JSON options.

    Raises LandingSystemError with the text of an error of pytest-garl that the function raises.
    """
    where = reference_to(system)
    if not where.file:
        raise LandingSystemError(
            f"{system.__name__} is defined in no file, and NumPy was loaded before pytest-garl, so "
            "that it must be flown in another process; put it into a module"
        )
    if where.module == "__main__":
        # The script is only imported there, not run once more.
        where = replace(where, module="__mp_main__")
    with tempfile.TemporaryDirectory(prefix="garl-") as folder:
        call_file, result_file = Path(folder) / "call.json", Path(folder) / "result.json"
        call = {"function": function, "system": asdict(where), "options": dict(options)}
        call_file.write_text(json.dumps({**call, "path": [entry for entry in sys.path if entry]}))
        done = subprocess.run(
            [sys.executable, "-m", __name__, str(os.getpid()), str(call_file), str(result_file)],
            env={**os.environ, **cpu_dispatch.environment()},
            check=False,
        )
        if not result_file.is_file():
            raise LandingSystemError(
                f"{system.__name__}: the process in which it was flown ended with status "
                f"{done.returncode}"
            )
        result: dict[str, Any] = json.loads(result_file.read_text())
    if "error" in result:
        raise LandingSystemError(result["error"])
    return result


class AskedProcess:
    """Runs a module that calls :func:`answer_questions`; starts with the first question.

    ``work`` says in errors what the process does: "that judges flights".
    """

    def __init__(self, module: str, work: str) -> None:
        self._module, self._work = module, work
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
        """Start the process, best before the first question: it starts while others work."""
        if self._process is not None:
            return
        # Not its standard files: whatever runs at the start of Python may write there.
        read_questions, write_questions = os.pipe()
        read_answers, write_answers = os.pipe()
        files = [read_questions, write_answers]
        process = subprocess.Popen(
            [sys.executable, "-m", self._module, str(os.getpid()), *map(str, files)],
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

    def ask(self, question: dict[str, Any]) -> dict[str, Any]:
        """Return the answer; raise PoolError if the process has ended."""
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
                raise PoolError(f"the process {self._work} ended with status {status}")
        except OSError as error:
            raise PoolError(f"the process {self._work} cannot be asked: {error}") from error
        finally:
            if not text:
                # A signal may have interrupted it: the answer to this question would be taken for
                # that to the next.
                self.close()
        answer: dict[str, Any] = json.loads(text)
        return answer


def answer_questions(answer: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
    """Answer until there are no more questions; the process ends with the one that asks."""
    parent, questions, answers = (int(each) for each in sys.argv[1:])
    ignore_ctrl_c()
    end_with_parent(parent, signal.SIGKILL)
    with os.fdopen(questions, "rb") as reading, os.fdopen(answers, "wb") as writing:
        for text in reading:
            writing.write(json.dumps(answer(json.loads(text))).encode() + b"\n")
            writing.flush()


def main(parent: str, call_file: str, result_file: str) -> None:
    """Read a call from one file and write its result to another; end if the parent ends."""
    ignore_ctrl_c()
    end_with_parent(int(parent), signal.SIGKILL)
    call = json.loads(Path(call_file).read_text())
    sys.path.extend(entry for entry in call["path"] if entry not in sys.path)
    module, _, name = call["function"].partition(":")
    function = getattr(importlib.import_module(module), name)
    try:
        result = function(Reference(**call["system"]).load(), **call["options"])
    except GarlError as error:
        result = {"error": str(error)}
    Path(result_file).write_text(json.dumps(result))


if __name__ == "__main__":
    main(*sys.argv[1:])
