"""``garl domain``: what it lists and shows."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from lab.domain_table import PAGE, with_table
from pytest_garl.cli import main
from pytest_garl.cli.domain_command import MEANINGS, ranges_of, text_of
from pytest_garl.scenarios.domains.domain import CONDITIONS
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.names import BUILT_IN, DEFAULT_DOMAIN


def garl(*words: str) -> Result:
    return CliRunner().invoke(main, ["domain", *words])


def test_list_names_the_built_in_domains_and_marks_the_default() -> None:
    lines = garl("list").output.splitlines()
    assert [line.partition(":")[0] for line in lines] == [*BUILT_IN]
    assert [line for line in lines if "(default)" in line] == [
        f"{DEFAULT_DOMAIN}: {MEANINGS[DEFAULT_DOMAIN]} (default)"
    ]


@pytest.mark.parametrize("name", BUILT_IN)
def test_show_gives_each_range_with_its_meaning_and_source(name: str) -> None:
    lines = garl("show", name).output.splitlines()
    ranges = ranges_of(domain_named(name))
    assert len(ranges) > 5
    for key, _, _ in ranges:
        group, _, title = key.partition(".")
        place = next(index for index, line in enumerate(lines) if line.startswith(f"{group}: "))
        at = next(
            index for index in range(place, len(lines)) if lines[index].startswith(f"  {title}: ")
        )
        assert CONDITIONS[key].meaning in lines[at + 1]
        assert lines[at + 2] == f"    source: {CONDITIONS[key].source}"


def test_show_gives_the_paper_in_units() -> None:
    text = text_of(domain_named("paper"))
    assert "  rain_mmph: 0 to 15 mm/h\n" in text
    assert "  fog_visibility_m: 66.667 m and more\n" in text
    assert "  sun_elevation_deg: -6 to 60 degrees\n" in text


def test_show_reads_a_file_below_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(
        'extends = "calm"\nnpc_behaviour = "absent"\n[wind]\nmean_mps=[1,2]'
    )
    shown = garl("show", "mine.toml").output
    assert shown.startswith("domain mine: NPCs none\n")
    assert "  mean_mps: 1 to 2 m/s\n" in shown


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('extends = "calm"\n[wnid]\nmean_mps = [0, 1]', "mine.toml: "),
        ('extends = "calm"\n[wind]\nmean_mps = [0, 99]', "key 'wind.mean_mps': found [0, 99]"),
        ('extends = "mine.toml"', "key 'extends'"),
        ('npc_behaviour = "absent"', "nothing may vary"),
        ('extends = "calm"\nnpc_behaviour = "wild"', "key 'npc_behaviour': found 'wild'"),
    ],
)
def test_show_refuses_a_file_with_one_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(text)
    result = garl("show", "mine.toml")
    assert result.exit_code == 1
    assert words in result.output
    assert "mine.toml" in result.output
    assert "Traceback" not in result.output


def test_the_example_of_the_page_is_a_domain(tmp_path: Path) -> None:
    example = PAGE.read_text().partition("    # my_domain.toml\n")[2].partition("\nThe names")[0]
    file = tmp_path / "my_domain.toml"
    file.write_text(textwrap.dedent(example))
    domain = domain_named(str(file))
    assert domain.range_of("wind.mean_mps") == (0, 4)
    assert domain.range_of("timing.latency_ms") == (80, 120)
    assert "outage" not in domain.groups


def test_page_has_the_table_of_the_built_in_domains() -> None:
    page = PAGE.read_text()
    assert page == with_table(page), "run: python -m lab.domain_table"
