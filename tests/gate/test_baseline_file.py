from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.errors import BaselineError, ScenarioError
from pytest_garl.gate.baseline_file import (
    BaselineFlight,
    dump_baseline,
    load_baseline,
    parse_baseline,
    save_baseline,
)
from pytest_garl.gate.pairs import FlightSummary
from pytest_garl.messages import printable
from pytest_garl.scenarios.genes import genome_for, group_gene
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.groups import GROUPS
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.search.methods.random import random_scenarios
from tests.gate.samples import COURT, DOG, LANDED, LAWN, baseline, baseline_set, spec


def test_saving_and_loading_keeps_a_baseline_and_its_bytes(tmp_path: Path) -> None:
    court = dataclasses.replace(baseline_set(), map="court", map_sha256=COURT.sha256, flights=())
    scenarios = spec(2, seed=5).scenarios(COURT)
    court = dataclasses.replace(
        court, flights=tuple(BaselineFlight(scenario=each, summary=DOG) for each in scenarios)
    )
    both = baseline(dataclasses.replace(baseline_set(), method="garl"), court)
    save_baseline(tmp_path / "new" / "base.toml", both)
    assert load_baseline(tmp_path / "new" / "base.toml") == both
    assert dump_baseline(parse_baseline(dump_baseline(both), load_map)) == dump_baseline(both)


def test_the_file_has_one_line_per_flight_and_names_its_genes_once() -> None:
    text = dump_baseline(baseline(baseline_set(20)))
    assert text.count("environment.fog") == 1
    assert len(text) < 20 * 550 + 2500


@given(st.text(), st.text())
def test_any_signature_survives_the_file(signature: str, name: str) -> None:
    strange = FlightSummary(outcome="crashed", signature=signature)
    each = dataclasses.replace(baseline_set(1, strange), npcs=name)
    seen = dataclasses.replace(strange, signature=printable(signature))
    readable = dataclasses.replace(baseline_set(1, seen), npcs=printable(name))
    assert parse_baseline(dump_baseline(baseline(each)), load_map) == baseline(readable)


def test_the_file_keeps_every_outcome_and_why_a_flight_did_not_land() -> None:
    summaries = (
        dataclasses.replace(LANDED, distance_m=0.0412, time_s=38.21),
        FlightSummary(outcome="slid", signature="slid:motors-on", paper_violation=True),
        FlightSummary(outcome="gave_up", signature="", no_landing="blocked"),
        FlightSummary(outcome="not_landed", signature="", no_landing="excused"),
        FlightSummary(outcome="gave_up", signature="II:never-seen", no_landing="needless"),
    )
    flights = tuple(
        dataclasses.replace(flight, summary=summary)
        for flight, summary in zip(baseline_set(5).flights, summaries, strict=True)
    )
    saved = baseline(dataclasses.replace(baseline_set(), flights=flights))
    assert parse_baseline(dump_baseline(saved), load_map) == saved


def test_the_file_keeps_conditions() -> None:
    genome = genome_for(LAWN, extras=(group_gene(GROUPS["wind"]),))
    scenarios = random_scenarios(LAWN, genome, 0, 0, 2)
    samples = tuple(BaselineFlight(scenario=each, summary=LANDED) for each in scenarios)
    windy = baseline(dataclasses.replace(baseline_set(), flights=samples))
    assert parse_baseline(dump_baseline(windy), load_map) == windy


def test_the_file_keeps_destinations() -> None:
    scenarios = random_scenarios(LAWN, with_destinations(genome_for(LAWN)), 0, 0, 2)
    samples = tuple(BaselineFlight(scenario=each, summary=LANDED) for each in scenarios)
    bound = baseline(dataclasses.replace(baseline_set(), flights=samples))
    assert parse_baseline(dump_baseline(bound), load_map) == bound


@pytest.mark.parametrize("domain", ["field", "calm"])
@pytest.mark.parametrize("map", [LAWN, COURT], ids=["lawn", "court"])
def test_the_file_keeps_sparse_scenarios(tmp_path: Path, map: Map, domain: str) -> None:
    scenarios = spec(60, domain).scenarios(map)
    assert len({each.removed_objects for each in scenarios}) > 2
    flights = tuple(BaselineFlight(scenario=each, summary=LANDED) for each in scenarios)
    one = dataclasses.replace(baseline_set(), map=map.name, map_sha256=map.sha256, flights=flights)
    for each in (one, *(dataclasses.replace(one, flights=(flight,)) for flight in flights)):
        text = dump_baseline(baseline(each))
        assert parse_baseline(text, load_map) == baseline(each)
        assert dump_baseline(parse_baseline(text, load_map)) == text


def test_a_sparse_flight_is_one_short_line() -> None:
    text = dump_baseline(baseline(baseline_set(60, domain="field")))
    assert text.count("environment.fog") == 1
    assert len(text) < 60 * 550 + 2500


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("{}", '{"wind.heat" = 1.0}', "found the gene 'wind.heat', expected a condition, or a "),
        ("{}", '{"wind.mean_mps" = 900.0}', "wind.mean_mps: found 900.0, expected 0 to "),
        ("{}", '{"cat-1.velocity" = 1.0}', "found the gene 'cat-1.velocity'"),
        ("{}", '{"dog-1.velocity" = 1.0}', "dog-1: dog-1.start_x, dog-1.start_y missing"),
        ("{}", '{"wind.mean_mps" = nan}', "wind.mean_mps: found nan"),
        ("{}", "3", r"hash, \[genes\], {further genes}\]"),
        ("sparse = true", "sparse = 1", r"'set\[0\].sparse': found 1"),
        ("sparse = true", "sparse = false", r"hash, \[genes\]\]"),
        ('"environment.fog", ', "", r"'set\[0\].genes': found genes other .*\(environment.fog\)"),
    ],
)
def test_the_error_of_a_broken_sparse_flight_says_what_was_expected(
    old: str, new: str, words: str
) -> None:
    (only, *_) = (
        each
        for each in baseline_set(60, domain="calm").flights
        if not {name.partition(".")[0] for name, _ in each.scenario.genes}
        - {"environment", "marker", "told"}
    )
    text = dump_baseline(baseline(dataclasses.replace(baseline_set(), flights=(only,))))
    end = text.index("flights = [")
    text = text[:end] + re.sub(r"{.*}", "{}", text[end:])
    at = text.rindex(old)
    with pytest.raises(ScenarioError, match=words) as caught:
        parse_baseline(text[:at] + text[at:].replace(old, new, 1), load_map, source="base.toml")
    assert "base.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("schema = 2", "schema = 1", "'schema': found 1, expected 2"),
        ('method = ""', "", r"'set\[0\].method': missing"),
        ("[0.1, 30.0]", "[]", r"found \[\] beside the outcome landed, expected \[distance, time\]"),
        (
            '"landed", "", false, ""',
            '"landed", "", false, "blocked"',
            "found 'blocked' why the ou",
        ),
        ('"landed", "", false, ""', '"gave_up", "", false, ""', "found 'no reason' why the outc"),
        ("[versions]", "[version]", "'version': unknown key"),
        ('map = "lawn"', 'map = "moon"', r"'set\[0\].map': unknown map 'moon'"),
        ('"stack.landing:Lander"', '"Lander"', r"'set\[0\].system': found 'Lander', expected 'mod"),
        ('"environment.fog", ', "", r"'set\[0\].genes': found genes other .*\(environment.fog\)"),
        ("distance_m = 0.75", "distance_m = -1.0", r"'set\[0\].limits.distance_m'"),
        ('"landed", ""', '"floated", ""', r"'set\[0\].flights\[0\]': found 'floated', expected "),
        ('"landed", "", false', '"landed", "", 0', r"'set\[0\].flights\[0\]': found \[\d+, 'l"),
        ('ab", [0.', 'ab", [9.', r"'set\[0\].flights\[0\]': environment.dust: found 9"),
        (
            'ab", [0.',
            'ab", [nan, 0.',
            r"'set\[0\].flights\[0\]': found \d+ values of genes, expected ",
        ),
        ("flights = [", "flights = 3 # [", "not valid TOML"),
    ],
)
def test_the_error_of_a_broken_file_names_source_and_key(old: str, new: str, words: str) -> None:
    text = dump_baseline(baseline())
    assert old in text
    with pytest.raises(ScenarioError, match=words) as caught:
        parse_baseline(text.replace(old, new, 1), load_map, source="base.toml")
    assert "base.toml" in str(caught.value)


def test_the_error_of_a_missing_file_names_the_command_that_writes_one(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"expected a file that `garl baseline save` wrote"):
        load_baseline(tmp_path / "no.toml")


def test_save_refuses_sets_that_no_file_can_hold(tmp_path: Path) -> None:
    each = baseline_set()
    hover = dataclasses.replace(each.flights[0].scenario, task=Task(start=Start(mode="hover")))
    other = dataclasses.replace(each.flights[0], scenario=hover)
    mixed = dataclasses.replace(each, flights=(*each.flights[1:], other))
    for wrong, words in (
        ((each, each), "twice"),
        ((dataclasses.replace(each, flights=()),), "found no flights"),
        ((mixed,), "different markers, or from different starts"),
    ):
        with pytest.raises(BaselineError, match=words):
            save_baseline(tmp_path / "base.toml", baseline(*wrong))
    assert not (tmp_path / "base.toml").exists()
