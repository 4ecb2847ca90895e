"""Call a function with a landing system in a fresh process, which computes as a worker does."""

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
