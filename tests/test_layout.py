"""The layout: rooms stay within their lines and their reach, and what a file names exists."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("pytest_garl", "landing_systems", "lab")
MOST_LINES = 700
MOST_LINES_OF_A_CLASS = 400
BUDGETS = tomllib.loads(Path(__file__).with_name("line_budgets.toml").read_text())
REACH = {
    "pytest_garl.verdicts.judge": 28,
    "pytest_garl.scenarios.files": 22,
    "pytest_garl.cases.case_file": 37,
    "pytest_garl.plugin.options": 55,
}
"""Modules of the package that an import pulls in at most, those included that it imports late."""
MOST_FILES = 28
SHORT = 100
KEPT_APART = {
    "shrinking/escape_plan": "which escapes are tried; prevention decides when",
    "cli/adapter": "`garl init` writes the text",
    "cli/case_tables": "what the commands about cases show, apart from what they do",
    "cli/film_command": "a command has a file of its own",
    "cli/skeleton": "`garl init` copies the file",
    "external/axes": "formulae; the protocol says which values they turn",
    "external/frame_memory": "what two processes share beside the lines of the protocol",
    "npcs/training/rewards": "formulae, named by their module where they are used",
    "plugin/terminal/github_summary": "what only GitHub gets, outside of which it is not loaded",
    "plugin/hookspecs": "pluggy reads a module",
    "plugin/terminal/pages": "a run without pages does not load it",
    "reports/film/gif": "a format of files",
    "reports/film/labels": "letters for any picture",
    "reports/film/side_view": "a part of the picture has a file of its own",
    "reports/mcap/numbers": "the wire format of Protocol Buffers",
    "reports/mcap/path_topics": "topics have a file for each subject",
    "reports/mcap/state": "topics have a file for each subject",
    "reports/mcap/transforms": "topics have a file for each subject",
    "scenarios/use_model": "what is drawn; its file says what a user states",
    "search/methods/garl_paper": "a search method has a file of its own",
    "search/user_method": "every pytest run loads the catalogue, and few name such a method",
    "simulation/physics/leap": "one way to move; npc chooses among them",
    "simulation/physics/solids_ahead": "geometry of maps, which knows no NPC",
    "vehicle/attitude": "a loop of the cascade has a file of its own",
    "vehicle/guidance": "a mode has a file of its own",
    "vehicle/land_mode": "a mode has a file of its own",
    "vehicle/rate_control": "a loop of the cascade has a file of its own",
    "vehicle/sink_rate": "formulae of LAND, which know no state",
    "vehicle/spool": "a state machine of its own in ArduPilot too",
}
"""Short files with one importer, in the importer's room, and why they are no part of it."""


@pytest.fixture(scope="module")
def imports() -> grimp.ImportGraph:
    return grimp.build_graph("pytest_garl", cache_dir=None)


def sources(*folders: str) -> Iterator[Path]:
    for folder in folders:
        yield from sorted((ROOT / folder).rglob("*.py"))


def meant(name: str) -> tuple[str, ...]:
    """Return the words of a module's name, in the singular and in one order."""
    words = (re.sub("ies$", "y", word) for word in name.split("_"))
    return tuple(sorted(re.sub("(?<!s)s$", "", word) for word in words))


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


def test_rooms_stay_within_their_lines() -> None:
    lines: Counter[str] = Counter()
    for folder in FOLDERS:
        for path in sources(folder):
            inside = path.relative_to(ROOT).parts
            lines["/".join(inside[:2]) if len(inside) > 2 else folder] += path.read_text().count(
                "\n"
            )
    assert sorted(lines) == sorted(BUDGETS)
    over = {room: count for room, count in lines.items() if count > BUDGETS[room]}
    assert not over, "raise tests/line_budgets.toml in the same commit, and say why in its message"
    idle = {room: count for room, count in lines.items() if count <= BUDGETS[room] - 200}
    assert not idle, "lower tests/line_budgets.toml: these rooms shrank"


@pytest.mark.parametrize("module", REACH)
def test_a_module_reaches_few_others(module: str, imports: grimp.ImportGraph) -> None:
    assert len(imports.find_upstream_modules(module)) <= REACH[module]


def test_no_module_imports_itself_by_others(imports: grimp.ImportGraph) -> None:
    """Imports inside of functions and for type checkers count."""
    left = {each: set(imports.find_modules_directly_imported_by(each)) for each in imports.modules}
    while free := {each for each, wanted in left.items() if not wanted}:
        left = {each: wanted - free for each, wanted in left.items() if each not in free}
    # What is left is in a circle, or imports one.
    assert not left


def test_one_type_has_limits_and_a_nominal_value() -> None:
    types = []
    for path in sources(*FOLDERS):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef):
                fields = {
                    ast.unparse(each.target)
                    for each in node.body
                    if isinstance(each, ast.AnnAssign)
                }
                types += [node.name] * ({"low", "high", "nominal"} <= fields)
    assert types == ["Quantity"]


def test_no_two_modules_have_names_alike() -> None:
    """Neither the same, nor names that differ by a plural or by the order of their words."""
    modules: dict[tuple[str, ...], list[str]] = {}
    for path in sources("pytest_garl"):
        if path.stem not in ("__init__", "__main__"):
            modules.setdefault(meant(path.stem), []).append(path.relative_to(ROOT).as_posix())
    assert [paths for paths in modules.values() if len(paths) > 1] == []


@pytest.mark.parametrize(
    ("name", "other", "alike"),
    [
        ("case_request", "case_requests", True),
        ("story", "stories", True),
        ("map_names", "name_map", True),
        ("pass", "pas", False),
        ("case", "case_file", False),
    ],
)
def test_names_are_alike_by_their_words(name: str, other: str, *, alike: bool) -> None:
    assert (meant(name) == meant(other)) is alike


def test_rooms_have_few_files() -> None:
    files = Counter(path.parent.relative_to(ROOT).as_posix() for path in sources("pytest_garl"))
    assert not {room: count for room, count in files.items() if count > MOST_FILES}


def test_a_short_file_with_one_importer_is_part_of_it_or_has_a_reason(
    imports: grimp.ImportGraph,
) -> None:
    alone = []
    for path in sources("pytest_garl"):
        if path.stem in ("__init__", "__main__") or path.read_text().count("\n") >= SHORT:
            continue
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        importers = imports.find_modules_that_directly_import(module)
        rooms = [each.rpartition(".")[0] for each in importers]
        if rooms == [module.rpartition(".")[0]]:
            alone.append(path.relative_to(ROOT / "pytest_garl").with_suffix("").as_posix())
    assert alone == sorted(KEPT_APART)
