"""README and docs: links and pages are found, tables and commands agree with the code."""

from __future__ import annotations

import dataclasses
import re
import tomllib
import typing
from pathlib import Path

import pytest

from pytest_garl import landing_system
from pytest_garl.verdicts.verdict import ViolationType

ROOT = Path(__file__).parents[1]
README, DOCS = ROOT / "README.md", ROOT / "docs"
PAGES = [*sorted(ROOT.glob("*.md")), *sorted(DOCS.rglob("*.md"))]
LINK = re.compile(r"\]\(([^)\s]+)\)")
SIGNATURE = re.compile(r"[IV]+:")
MOST_LINES = 15

TRY = "cp -r docs/tutorial /tmp/my-stack && cd /tmp/my-stack && rm -r scenarios"
RUN_BY = {
    "python3 -m venv .venv && . .venv/bin/activate": ("Makefile", "$(FLIES)"),
    "pip install -c constraints.txt .": ("Makefile", "$(INSTALL) -e ."),
    'pip install -c constraints.txt "pytest-garl @ git+https://HOST/PATH.git@COMMIT"': (
        "tests/test_workflow.py",
        "Requirement",
    ),
    "garl init my_landing:MyLandingSystem": ("tests/cli/test_init_command.py", "init"),
    "garl init --adapter my_stack:MyStack": ("tests/cli/test_init_command.py", "--adapter"),
    'garl init "python my_lander.py --connect udp:0.0.0.0:14550"': (
        "tests/cli/test_init_command.py",
        "python lander.py",
    ),
    "garl check test_my_landing.py": ("tests/cli/test_check_command.py", "check"),
    "pytest --garl-budget=40 test_my_landing.py": ("tests/test_pages.py", "--garl-budget"),
    TRY: ("tests/test_tutorial.py", "copytree"),
    "pytest --garl-budget=16 --garl-shrink=12 test_my_landing.py": (
        "tests/test_tutorial.py",
        "transcript",
    ),
    "make search": ("Makefile", "search:"),
    "make test": (".ci/run", "make test"),
}
"""Each command of the README, with the file that runs it and a word of that file."""


def prose(page: Path) -> str:
    """Return a page without its blocks of code."""
    return re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)


def links(page: Path) -> list[str]:
    return [link for link in LINK.findall(prose(page)) if "://" not in link]


def anchors(page: Path) -> set[str]:
    """Return the anchors that GitHub gives a page's headings."""
    headings = re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", each.lower()).replace(" ", "-") for each in headings}


def blocks(page: Path) -> dict[str, str]:
    """Return the files of a page's Python blocks, by the name in their first line."""
    found = re.findall(r"^```python\n# (\w+\.py)\n(.*?)^```$", page.read_text(), re.DOTALL | re.M)
    return dict(found)


def indented(page: Path) -> list[list[str]]:
    """Return the blocks of commands and output."""
    found = re.findall(r"(?:^    .*\n(?:^\n(?=^    ))?)+", prose(page), re.MULTILINE)
    return [[line[4:] for line in block.splitlines()] for block in found]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_page_has_no_dead_link(page: Path) -> None:
    for link in links(page):
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_page_names_no_missing_file(page: Path) -> None:
    if page.name == "CHANGELOG.md":
        return
    rooms = "pytest_garl|landing_systems|tests|docs|lab"
    named = re.findall(rf"`((?:{rooms})/[\w/.-]*)`", page.read_text())
    assert [name for name in named if not (ROOT / name).exists() and "/my_" not in name] == []
    # A page names the commit of a command that has gone since.
    modules = re.findall(rf"python -m ((?:{rooms})[\w.]*+)(?![^`]*` of commit)", page.read_text())
    paths = [ROOT / name.replace(".", "/") for name in modules]
    assert [each for each in paths if not (each.with_suffix(".py").exists() or each.is_dir())] == []


def test_architecture_shows_the_layers_that_are_checked() -> None:
    config = tomllib.loads((ROOT / "pyproject.toml").read_text())
    contracts = config["tool"]["importlinter"]["contracts"]
    (layers,) = (each["layers"] for each in contracts if each.get("containers") == ["pytest_garl"])
    table = (ROOT / "ARCHITECTURE.md").read_text().partition("| room | ")[2].partition("\n\n")[0]
    rows = [re.findall(r"`(\w+)`", line.split("|")[1]) for line in table.splitlines()[2:]]
    checked = [sorted(each.split(" | ")) for each in layers]
    assert [sorted(row) for row in rows] == checked


def test_index_leads_to_every_page() -> None:
    reached, waiting = set(), [DOCS / "index.md"]
    while waiting:
        page = waiting.pop()
        reached.add(page)
        targets = {(page.parent / link.partition("#")[0]).resolve() for link in links(page)}
        waiting += [each for each in targets - reached if each.suffix == ".md"]
    assert set(PAGES) - reached == set()


@pytest.mark.parametrize(
    "name",
    [
        "Mission",
        "Observation",
        "Camera",
        "PositionSetpoint",
        "VelocitySetpoint",
        "AttitudeSetpoint",
        "Land",
        "Abort",
    ],
)
def test_page_of_the_class_names_every_field(name: str) -> None:
    text = (DOCS / "landing-system.md").read_text()
    assert f"`{name}`" in text
    for field in dataclasses.fields(getattr(landing_system, name)):
        assert f"`{field.name}" in text or field.name == "diagnostics", field.name


def test_page_of_verdicts_explains_every_type_of_violation() -> None:
    rows = re.findall(r"^\| (\w+) \| ", (DOCS / "verdicts.md").read_text(), re.MULTILINE)
    assert set(typing.get_args(ViolationType)) <= set(rows)


def test_readme_shows_output_of_the_tutorial() -> None:
    (output,) = (block for block in indented(README) if SIGNATURE.match(block[0]))
    assert len(output) <= MOST_LINES
    tutorial = [line.split() for line in (DOCS / "tutorial.md").read_text().splitlines()]
    assert [line for line in output if line.split() not in [*tutorial, ["..."]]] == []


def test_picture_of_the_readme_loads_quickly() -> None:
    (picture,) = re.findall(r"!\[.*?\]\((.*?)\)", README.read_text())
    assert (ROOT / picture).stat().st_size < 1_000_000


def test_every_command_of_the_readme_is_run() -> None:
    shown = {
        line.partition("#")[0].strip()
        for block in indented(README)
        if not SIGNATURE.match(block[0])
        for line in block
    }
    assert shown == set(RUN_BY)
    for file, word in RUN_BY.values():
        assert word in (ROOT / file).read_text(), file


def test_code_of_the_readme_flies(pytester: pytest.Pytester) -> None:
    code = blocks(README)
    assert set(code) == {"my_landing.py", "test_my_landing.py"}
    other = blocks(DOCS / "extending.md")
    system = re.sub(
        r"^ +\.\.\.  # your code.*$", "        return Land()", code["my_landing.py"], flags=re.M
    )
    assert system != code["my_landing.py"]
    (pytester.path / "my_landing.py").write_text(system)
    (pytester.path / "test_my_landing.py").write_text(code["test_my_landing.py"])
    # Its UAV lands beside the marker in fog, and this test is about the page.
    simulator = other["my_simulator.py"].replace("> 0.1", "> 1.0")
    (pytester.path / "my_simulator.py").write_text(simulator)
    pytester.makeconftest(
        "import my_simulator\ndef pytest_garl_fly(config):\n    return my_simulator.fly"
    )
    result = pytester.runpytest_subprocess(
        "-p", "no:cacheprovider", "--garl-budget=3", "--garl-workers=1", "--garl-shrink=0"
    )
    result.assert_outcomes(passed=12 * 2)


def test_options_page_lists_every_option_with_its_default(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    # It says that the tests of this project fly no probes.
    monkeypatch.delenv("PYTEST_ADDOPTS")
    lines = (DOCS / "options.md").read_text().splitlines()
    rows = [re.split(r"(?<!\\)\|", line) for line in lines if line.startswith("| ")]
    options = {found[0]: row for row in rows if (found := re.findall(r"--garl-(\w+)", row[1]))}
    keys = {found[0]: row for row in rows if (found := re.findall(r"ini `([\w-]+)`", row[1]))}
    shown = pytester.runpytest_subprocess("--help").stdout.str()
    assert set(options) == set(re.findall(r"^  --garl-(\w+)", shown, re.MULTILINE))
    known = set(re.findall(r"^  (garl_[\w-]+) \(", shown, re.MULTILINE))
    assert set(keys) == known - {f"garl_{name}" for name in options}
    config = pytester.parseconfig()
    defaults = {name: config.getini(f"garl_{name}") for name in set(options) - {"resume"}}
    defaults |= {name: config.getini(name) for name in keys}
    for name, default in defaults.items():
        if default not in ("", None):
            assert (options | keys)[name][3].strip(" `") == str(default).lower()
