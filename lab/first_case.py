"""From nothing to the first shrunk case, on every supported Python: seconds, megabytes, hash.

    python -m lab.first_case python3.11 python3.12 python3.13

makes with each interpreter an environment of its own, installs this checkout with its exact
versions and without a cache, and runs the commands of the README in an empty folder: ``garl init``,
``garl check``, and a search of 16 flights.  It prints a table.  A machine with other work is slow,
so that seconds of CPU stand beside those of the clock.  The status is 1 if the searches differ.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

ROOT = Path(__file__).parents[1]
SEARCH = "pytest --garl-budget=16 --garl-map=lawn test_my_landing.py"
STEPS = (
    ("install", f"pip install --quiet --no-cache-dir -c {ROOT / 'constraints.txt'} {ROOT}"),
    ("init", "garl init"),
    ("check", "garl check test_my_landing.py"),
    ("search", SEARCH),
)
RESULTS = re.compile(r"^ledger: .*  results ([0-9a-f]+)$", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstCase:
    """What one interpreter took: seconds (clock, CPU) of each step, and what came out."""

    python: str
    seconds: dict[str, tuple[float, float]]
    megabytes: float
    cases: int
    results: str

    def cells(self) -> list[str]:
        """Return the cells of its row."""
        times = [f"{clock:.0f} ({cpu:.0f})" for clock, cpu in self.seconds.values()]
        return [self.python, f"{self.megabytes:.0f}", *times, str(self.cases), self.results]


def first_case(python: str, folder: Path, steps: Sequence[tuple[str, str]] = STEPS) -> FirstCase:
    """Go the way with an interpreter, in an empty folder."""
    environment, project = folder / "environment", folder / "project"
    project.mkdir()
    _run([python, "-m", "venv", str(environment)], folder, {})
    binaries = environment / "bin"
    # Neither of these is part of a user's machine.
    unset = ("CI", "PYTEST_ADDOPTS", "PYTHONPATH", "PYTHONDONTWRITEBYTECODE")
    given = {name: value for name, value in os.environ.items() if name not in unset}
    given["PATH"] = f"{binaries}{os.pathsep}{given['PATH']}"
    seconds, output = dict[str, tuple[float, float]](), ""
    for name, command in steps:
        began, cpu = monotonic(), _cpu_s()
        output = _run(["bash", "-ec", command], project, given, may_find=name == "search")
        seconds[name] = monotonic() - began, _cpu_s() - cpu
    found = RESULTS.search(output)
    shown = _run([str(binaries / "python"), "--version"], project, given)
    return FirstCase(
        python=shown.split()[1],
        seconds=seconds,
        megabytes=sum(f.lstat().st_size for f in environment.rglob("*")) / 1e6,
        cases=len([*project.glob("scenarios/regressions/**/*.toml")]),
        results=found[1] if found else "",
    )


def _run(
    command: Sequence[str], folder: Path, environment: dict[str, str], *, may_find: bool = False
) -> str:
    done = subprocess.run(
        command, cwd=folder, env=environment or None, capture_output=True, text=True, check=False
    )
    # pytest's status 1: a search found violations.
    if done.returncode not in ((0, 1) if may_find else (0,)):
        raise SystemExit(
            f"{' '.join(command)}: status {done.returncode}\n{done.stdout}{done.stderr}"
        )
    return done.stdout


def _cpu_s() -> float:
    """Return the seconds of CPU of all processes that were waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def table(found: Sequence[FirstCase]) -> str:
    """Return the rows in Markdown."""
    steps = [f"{name}, s (of CPU)" for name in found[0].seconds]
    heads = ["Python", "megabytes", *steps, "cases", "results"]
    rows = [
        heads,
        ["---", *(["---:"] * (len(heads) - 2)), "---"],
        *(each.cells() for each in found),
    ]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def main() -> None:
    """Go the way with each interpreter; print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pythons", nargs="+", metavar="PYTHON")
    found = []
    for python in parser.parse_args().pythons:
        with tempfile.TemporaryDirectory() as folder:
            found.append(first_case(python, Path(folder)))
        print(" | ".join(found[-1].cells()), flush=True)
    print(table(found))
    if len({each.results for each in found}) > 1:
        sys.exit("the searches differ")


if __name__ == "__main__":
    main()
