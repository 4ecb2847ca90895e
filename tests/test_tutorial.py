from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pytest_garl.cases.case_file import load_case
from pytest_garl.cpu_dispatch import cpu_class_of_flights
from tests.support.other_plugins import WITHOUT_FOREIGN

DOCS = Path(__file__).parents[1] / "docs"
SEARCH = "--garl-budget"
CASES = Path("scenarios/regressions/my_landing")


def transcript() -> list[tuple[str, list[str]]]:
    """Every command of the tutorial with the lines that it says are printed."""
    found: list[tuple[str, list[str]]] = []
    for line in (DOCS / "tutorial.md").read_text().splitlines():
        if line.startswith("    $ "):
            found.append((line.removeprefix("    $ "), []))
        elif line.startswith("    ") and found:
            found[-1][1].append(line.strip())
    return found


def flat(text: str) -> str:
    """One line, without times and the padding of tables."""
    return re.sub(r"\s+", " ", re.sub(r" in \d+\.\d+s.*", "", text))


@pytest.mark.sim
@pytest.mark.long
def test_every_command_of_the_tutorial_prints_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stack, kept = tmp_path / "my-stack", DOCS / "tutorial" / CASES
    # What is found is the same to the byte on one class of CPUs; on others fly what is kept.
    searches = all(
        load_case(path).evidence.cpu == cpu_class_of_flights() for path in kept.iterdir()
    )
    left_out = ("__pycache__", "scenarios") if searches else ("__pycache__",)
    shutil.copytree(DOCS / "tutorial", stack, ignore=shutil.ignore_patterns(*left_out))
    for name in ("AUTHOR", "COMMITTER"):
        monkeypatch.setenv(f"GIT_{name}_NAME", "Anna")
        monkeypatch.setenv(f"GIT_{name}_EMAIL", "anna@example.org")
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTEST_ADDOPTS", WITHOUT_FOREIGN)
    for command in ("git init -q", "git add *.py *.patch", "git commit -qm stack"):
        subprocess.run(command, shell=True, cwd=stack, check=True)
    commands = transcript()
    assert len(commands) == 13
    for command, told in commands:
        if SEARCH in command and not searches:
            continue
        done = subprocess.run(
            command, shell=True, cwd=stack, capture_output=True, text=True, check=False
        )
        printed = flat(done.stdout + done.stderr)
        for line in told:
            if line != "...":
                assert flat(line) in printed, f"{command}\n{done.stdout}\n{done.stderr}"
        failed = any(line.startswith(("FAILED", "Error")) for line in told)
        assert (done.returncode != 0) == failed, f"{command}\n{done.stdout}\n{done.stderr}"
        if SEARCH in command:
            assert files(stack / CASES) == files(kept)


def files(folder: Path) -> dict[str, str]:
    """Return the content of a folder's files without hashes of sources and our version."""
    hashes = re.compile(r'^((system|simulator)_sha256|"pytest-garl") = .*\n', re.MULTILINE)
    return {path.name: hashes.sub("", path.read_text()) for path in folder.iterdir()}
