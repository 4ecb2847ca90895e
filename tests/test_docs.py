from __future__ import annotations

import dataclasses
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


FORMS = sorted((DOCS.parent / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))


@pytest.mark.parametrize(
    ("schema", "file"),
    [
        ("vendor.github-actions", DOCS.parent / "action.yml"),
        ("vendor.github-workflows", DOCS / "github-actions.yml"),
        ("vendor.github-workflows", DOCS.parent / ".github" / "workflows" / "release.yml"),
        *(
            (f"vendor.github-issue-{'config' if form.stem == 'config' else 'forms'}", form)
            for form in FORMS
        ),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_files_for_github_follow_their_schema(schema: str, file: Path) -> None:
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", schema, str(file)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_lines_of_the_readme_are_wrapped() -> None:
    lines = (DOCS.parent / "README.md").read_text().splitlines()
    assert [line for line in lines if len(line) > 130 and not line.startswith("|")] == []


def test_every_command_of_the_cases_page_exists() -> None:
    from pytest_garl.cli.cases_command import cases

    lines = (DOCS / "cases.md").read_text().splitlines()
    named = {line.split()[2] for line in lines if line.startswith("    garl cases ")}
    assert named == set(cases.commands)


def test_the_page_of_experiments_tells_every_column_and_every_key() -> None:
    from lab.experiment.results import ResultRow
    from lab.experiment.spec import TOP_KEYS

    text = (DOCS / "results" / "experiments" / "README.md").read_text()
    types = {f"type_{kind}" for kind in ("ii", "iii", "iv")}
    columns = {field.name for field in dataclasses.fields(ResultRow)} - types
    assert [name for name in columns if f"`{name}`" not in text] == []
    told = {name.strip("[]") for name in re.findall(r"`([a-z_\[\]]+)`", text)}
    assert told >= TOP_KEYS


@pytest.mark.long
def test_site_of_the_pages_has_no_warning(tmp_path: Path) -> None:
    pytest.importorskip("sphinx")
    site = tmp_path / "site"
    command = ["sphinx", "--quiet", "--fail-on-warning", "--keep-going", "-c", "docs/site"]
    done = subprocess.run(
        [sys.executable, "-m", *command, "-d", str(tmp_path / "read"), ".", str(site)],
        cwd=DOCS.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    index = (site / "docs" / "index.html").read_text()
    for page in DOCS.glob("*.md"):
        assert page.stem == "index" or f'href="{page.stem}.html"' in index
    assert (site / "README.html").is_file()
    text = (site / "searchindex.js").read_text()
    found = json.loads(text.removeprefix("Search.setIndex(").removesuffix(")"))
    pages = [found["docnames"][place] for place in found["terms"]["garl_budget"]]
    assert {"docs/ci", "docs/options"} <= {*pages}
