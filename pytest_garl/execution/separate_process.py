"""Ask something of a landing system in a fresh process, which flies as all flying processes do."""

from __future__ import annotations

import importlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from pytest_garl import cpu_dispatch
from pytest_garl.errors import GarlError, LandingSystemError
from pytest_garl.execution.processes import end_with_parent, ignore_ctrl_c
from pytest_garl.execution.reference import Reference, reference_to


def ask_apart(function: str, system: type, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return what "module:function" answers about a class, both of them JSON's kinds of values.

    Raises LandingSystemError with the text of whatever error of ours it raised there.
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
        question, answer = Path(folder) / "question.json", Path(folder) / "answer.json"
        asked = {"function": function, "system": asdict(where), "options": dict(options)}
        question.write_text(json.dumps({**asked, "path": [entry for entry in sys.path if entry]}))
        done = subprocess.run(
            [sys.executable, "-m", __name__, str(os.getpid()), str(question), str(answer)],
            env={**os.environ, **cpu_dispatch.environment()},
            check=False,
        )
        if not answer.is_file():
            raise LandingSystemError(
                f"{system.__name__}: the process in which it was flown ended with status "
                f"{done.returncode}"
            )
        told: dict[str, Any] = json.loads(answer.read_text())
    if "error" in told:
        raise LandingSystemError(told["error"])
    return told


def main(parent: str, question: str, answer: str) -> None:
    """Answer a question that stands in one file, in another, while the parent lives."""
    ignore_ctrl_c()
    end_with_parent(int(parent), signal.SIGKILL)
    asked = json.loads(Path(question).read_text())
    sys.path.extend(entry for entry in asked["path"] if entry not in sys.path)
    module, _, name = asked["function"].partition(":")
    function = getattr(importlib.import_module(module), name)
    try:
        told = function(Reference(**asked["system"]).load(), **asked["options"])
    except GarlError as error:
        told = {"error": str(error)}
    Path(answer).write_text(json.dumps(told))


if __name__ == "__main__":
    main(*sys.argv[1:])
