"""Schemas of files: what is read is valid, what is refused for one value is not."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from click.testing import CliRunner

from pytest_garl.cases.case_file import parse_case
from pytest_garl.cli import main
from pytest_garl.cli.file_schemas import DRAFT, SCHEMAS
from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.files import loads
from pytest_garl.scenarios.maps.loading import load_map

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "pytest_garl" / "scenarios"
FILES = {
    "case": [*ROOT.glob("**/scenarios/regressions/**/*.toml")],
    "domain": [*(PACKAGE / "domains").glob("*.toml")],
    "map": [*(PACKAGE / "maps").glob("*.toml")],
    "scenario": [*ROOT.glob("lab/*/scenarios/*.toml")],
}
VALIDATORS = {name: jsonschema.Draft7Validator(make()) for name, make in SCHEMAS.items()}
DOMAIN = 'extends = "field"\nnpc_behaviour = "curious"\nburst = false\n[wind]\nmean_mps = [0, 4]\n'
CASE, SCENARIO = FILES["case"][0].read_text(), FILES["scenario"][0].read_text()
MAP = (PACKAGE / "maps" / "lawn.toml").read_text()


def problems(name: str, text: str) -> list[str]:
    found = VALIDATORS[name].iter_errors(tomllib.loads(text))
    return [f"{each.json_path}: {each.message}" for each in found]


@pytest.mark.parametrize("name", SCHEMAS)
def test_each_is_a_schema_of_the_draft_that_editors_know(name: str) -> None:
    schema = SCHEMAS[name]()
    jsonschema.Draft7Validator.check_schema(schema)
    assert schema["$schema"] == DRAFT


@pytest.mark.parametrize("name", SCHEMAS)
def test_every_file_of_the_repository_is_valid(name: str) -> None:
    files = [file for file in FILES[name] if ".venv" not in str(file)]
    assert files
    found = {str(file): problems(name, file.read_text()) for file in files}
    assert {file: each for file, each in found.items() if each} == {}


def read_map(text: str, folder: Path) -> object:
    (folder / "mine.toml").write_text(text)
    return load_map("mine", (folder,))


def read_domain(text: str, folder: Path) -> object:
    (folder / "mine.toml").write_text(text)
    return domain_named("mine.toml", folder)


def read_scenario(text: str, folder: Path) -> object:
    return loads(text, load_map(tomllib.loads(text)["map"]))


def read_case(text: str, folder: Path) -> object:
    return parse_case(text, load_map)


READERS: dict[str, Callable[[str, Path], object]] = {
    "case": read_case,
    "domain": read_domain,
    "map": read_map,
    "scenario": read_scenario,
}
TEXTS = {"case": CASE, "domain": DOMAIN, "map": MAP, "scenario": SCENARIO}
BROKEN = [
    ("domain", "mean_mps = [0, 4]", "mean_mps = [0, 400]"),
    ("domain", "mean_mps = [0, 4]", "mean_mps = [0]"),
    ("domain", "mean_mps = [0, 4]", "mean_mps = true"),
    ("domain", "mean_mps", "mean"),
    ("domain", "[wind]", "[winds]"),
    ("domain", "burst = false", "burst = true"),
    ("map", 'texture = "grass"', 'texture = "moss"'),
    ("map", "seed = 2029", ""),
    ("map", "person = 2", "persons = 2"),
    ("map", 'kind = "tree"', 'kind = "oak"'),
    ("map", "crown_m = 4.0", "crown_m = 0"),
    ("map", "colour = [96, 122, 58]", "colour = [96, 122, 580]"),
    ("map", "size_m = 7.0", "size = 7.0"),
    ("case", 'status = "', 'status = "nearly '),
    ("case", "[violation]", "[violations]"),
    ("case", "margin = ", 'margin = "0" #'),
    ("case", "[limits]", "[limits]\nspeed = 1"),
    ("case", "schema = 2", "schema = 1"),
    ("case", "[scenario.marker]", "[scenario.marker]\nz_m = 0"),
    ("case", "[evidence]", "[evidence]\nwitness = 1"),
    ("scenario", "seed = ", "seed = -1 #"),
    ("scenario", "[scenario.marker]", "[scenario.wind]\nmean_mps = 1e3\n[scenario.marker]"),
    ("scenario", "[scenario.marker]", "[scenario.cat-1]\nspeed_mps = 1\n[scenario.marker]"),
]


@pytest.mark.parametrize(("name", "old", "new"), BROKEN)
def test_a_broken_file_is_invalid_and_refused(
    name: str, old: str, new: str, tmp_path: Path
) -> None:
    text = TEXTS[name]
    assert problems(name, text) == []
    READERS[name](text, tmp_path)
    assert old in text
    broken = text.replace(old, new, 1)
    assert problems(name, broken) != []
    with pytest.raises(ScenarioError):
        READERS[name](broken, tmp_path)


TABLES = [
    ("domain", "", ()),
    ("domain", "[wind]", ("wind",)),
    ("map", "", ()),
    ("map", "[ground]", ("ground",)),
    ("map", "[[layers]]", ("layers", "items")),
    ("map", "[objects]", ("objects",)),
    ("case", "", ()),
    ("case", "[violation]", ("violation",)),
    ("case", "[limits]", ("limits",)),
    ("case", "[policy]", ("policy",)),
    ("case", "[evidence]", ("evidence",)),
    ("case", "[scenario.marker]", ("scenario", "marker")),
    ("scenario", "", ()),
]


@pytest.mark.parametrize(("name", "head", "path"), TABLES)
def test_a_schema_names_the_keys_that_are_read(
    name: str, head: str, path: tuple[str, ...], tmp_path: Path
) -> None:
    text = TEXTS[name]
    strange = text.replace(head, f"{head}\nunheard_of = 1\n", 1)
    with pytest.raises(ScenarioError, match="unknown key") as error:
        READERS[name](strange, tmp_path)
    told = str(error.value).partition("expected one of ")[2]
    node: Any = SCHEMAS[name]()
    for step in path:
        node = node[step] if step == "items" else node["properties"][step]
        node = next((each for each in node.get("anyOf", ()) if "properties" in each), node)
    named = sorted(node["properties"])
    # A message is cut where it would fill a screen.
    known = [each for each in told.split(", ") if re.fullmatch(r"[\w-]+", each)]
    assert known == named[: len(known)]
    assert len(known) == len(named) or "…" in told or "..." in told


def test_the_command_writes_them_and_writes_them_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        done = CliRunner().invoke(main, ["schema"])
        assert done.exit_code == 0, done.output
        for name, make in SCHEMAS.items():
            file = Path("schemas") / f"{name}.schema.json"
            assert f"wrote {file}" in done.output
            assert json.loads(file.read_text()) == make()


def test_every_condition_says_what_it_means_in_its_unit() -> None:
    wind = SCHEMAS["domain"]()["properties"]["wind"]["anyOf"][1]["properties"]["mean_mps"]
    assert re.match(
        r"\[lowest, highest\] or false: mean speed.*, m/s; nominal 0 ", wind["description"]
    )
    sky = SCHEMAS["case"]()["properties"]["scenario"]["properties"]["weather"]["properties"]
    assert sky["fog_visibility_m"]["minimum"] == 10
    assert sky["fog_visibility_m"]["maximum"] == 1e6


def test_the_page_names_the_files_and_its_example_is_valid() -> None:
    page = (ROOT / "docs" / "editors.md").read_text()
    assert all(f"`{name}.schema.json`" in page for name in SCHEMAS)
    first, rules = re.findall(r"```toml\n(.*?)```", page, re.S)
    assert problems("domain", first) == []
    for rule in tomllib.loads(rules)["rule"]:
        assert Path(rule["schema"]["path"]).name in {f"{name}.schema.json" for name in SCHEMAS}
