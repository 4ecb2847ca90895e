"""The layout that files name: a mentioned module exists, and no file or class grows too large."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("pytest_garl", "landing_systems", "lab")
MOST_LINES = 700
MOST_LINES_OF_A_CLASS = 400


def sources(*folders: str) -> Iterator[Path]:
    for folder in folders:
        yield from sorted((ROOT / folder).rglob("*.py"))


@pytest.mark.parametrize("folder", [*FOLDERS, "tests"])
def test_no_file_and_no_class_is_too_long(folder: str) -> None:
    long = []
    for path in sources(folder):
        text = path.read_text()
        name = path.relative_to(ROOT).as_posix()
        if (lines := text.count("\n")) > MOST_LINES:
            long.append(f"{name}: {lines} lines")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ClassDef) and node.end_lineno is not None:
                size = node.end_lineno - node.lineno + 1
                if size > MOST_LINES_OF_A_CLASS:
                    long.append(f"{name}: class {node.name} has {size} lines")
    assert not long


def test_modules_that_the_package_mentions_exist() -> None:
    known = {path.relative_to(ROOT).as_posix() for path in sources(*FOLDERS, "tests")}
    missing = []
    for path in sources("pytest_garl"):
        for mention in re.findall(r"``([a-z_]+(?:/[a-z_]+)*\.py)``", path.read_text()):
            if not any(each.endswith(f"/{mention}") for each in known):
                missing.append(f"{path.relative_to(ROOT)}: {mention}")
    assert not missing
