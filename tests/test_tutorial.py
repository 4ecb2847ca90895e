from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
SEARCH = "--garl-budget"


def transcript() -> list[tuple[str, list[str]]]:
    """Every command of the tutorial with the lines that it says are printed."""
    found: list[tuple[str, list[str]]] = []
    for line in (DOCS / "tutorial.md").read_text().splitlines():
        if line.startswith("    $ "):
            found.append((line.removeprefix("    $ "), []))
        elif line.startswith("    ") and found:
            found[-1][1].append(line.strip())
    return [(command, told) for command, told in found if SEARCH not in command]


def flat(text: str) -> str:
    """One line, without times and the padding of tables."""
    return re.sub(r"\s+", " ", re.sub(r" in \d+\.\d+s.*", "", text))


@pytest.mark.sim
@pytest.mark.long
def test_every_command_of_the_tutorial_prints_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stack = tmp_path / "my-stack"
    shutil.copytree(DOCS / "tutorial", stack, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("AUTHOR", "COMMITTER"):
        monkeypatch.setenv(f"GIT_{name}_NAME", "Anna")
        monkeypatch.setenv(f"GIT_{name}_EMAIL", "anna@example.org")
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.delenv("PYTEST_ADDOPTS", raising=False)
    for command in ("git init -q", "git add *.py *.patch", "git commit -qm stack"):
        subprocess.run(command, shell=True, cwd=stack, check=True)
    commands = transcript()
    assert len(commands) == 13
    for command, told in commands:
        done = subprocess.run(
            command, shell=True, cwd=stack, capture_output=True, text=True, check=False
        )
        printed = flat(done.stdout + done.stderr)
        for line in told:
            if line != "...":
                assert flat(line) in printed, f"{command}\n{done.stdout}\n{done.stderr}"
        failed = any(line.startswith(("FAILED", "Error")) for line in told)
        assert (done.returncode != 0) == failed, f"{command}\n{done.stdout}\n{done.stderr}"
