from __future__ import annotations

import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def test_the_workflow_for_github_is_one() -> None:
    schema = ("--builtin-schema", "vendor.github-workflows")
    command = [sys.executable, "-m", "check_jsonschema", *schema, str(DOCS / "github-actions.yml")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_every_command_of_the_cases_page_exists() -> None:
    from pytest_garl.cli.cases import cases

    lines = (DOCS / "cases.md").read_text().splitlines()
    named = {line.split()[2] for line in lines if line.startswith("    garl cases ")}
    assert named == set(cases.commands)
