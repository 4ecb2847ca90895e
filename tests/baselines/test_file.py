from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.baselines.file import (
    Baseline,
    BaselineError,
    Sample,
    SampleSet,
    dumps,
    load,
    loads,
    save,
)
from pytest_garl.baselines.pairs import Answer
from pytest_garl.baselines.record import (
    Survey,
    compare_flights,
    compare_sets,
    from_ledger,
    moved_on,
    unlike,
)
from pytest_garl.cpu_dispatch import of_children
from pytest_garl.errors import ScenarioError
from pytest_garl.execution.job import Job, dump_scenario
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.on_demand import Done
from pytest_garl.execution.reference import BUILT_IN, Reference
from pytest_garl.messages import printable
from pytest_garl.regressions.robustness import neighbours
from pytest_garl.scenarios.genes import WIND, genome_for, with_destinations
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.search.methods.random import propose
from pytest_garl.verdicts.verdict import Limits
from tests.support.results import flight_result

LAWN, COURT = load_map("lawn"), load_map("court")
LANDED = Answer(outcome="landed", signature="", sha256="ab" * 32)
DOG = Answer(outcome="collision", signature="IV:dog:descent:seen", paper_violation=True)


def sample_set(count: int = 3, answer: Answer = LANDED) -> SampleSet:
    scenarios = Survey(count=count).scenarios(LAWN)
    return SampleSet(
        system="stack.landing:Lander",
        map="lawn",
        map_sha256=LAWN.sha256,
        simulator="pytest_garl.simulation.fly:fly",
        npcs="waypoint",
        npcs_sha256="",
        limits=Limits(),
        samples=tuple(Sample(scenario=each, answer=answer) for each in scenarios),
    )


def baseline(*sets: SampleSet) -> Baseline:
    versions = (("pytest-garl", "0.1.0"), ("numpy", "2.0.0"))
    return Baseline(cpu="x86_64-avx2", versions=versions, sets=sets or (sample_set(),))


def job(simulator: Reference = BUILT_IN) -> Job:
    return Job(
        system=Reference(module="stack.landing", file="", qualname="Lander"),
        system_sha256="",
        simulator=simulator,
        map="lawn",
        map_sha256=LAWN.sha256,
        map_folders=(),
        npcs=policy_spec("waypoint"),
        limits=Limits(),
        timeout_s=10.0,
        path=(),
        flights="flights",
    )


def test_a_baseline_survives_its_file_exactly_and_has_the_same_bytes_again(tmp_path: Path) -> None:
    court = dataclasses.replace(sample_set(), map="court", map_sha256=COURT.sha256, samples=())
    scenarios = Survey(count=2, seed=5).scenarios(COURT)
    court = dataclasses.replace(
        court, samples=tuple(Sample(scenario=each, answer=DOG) for each in scenarios)
    )
    both = baseline(dataclasses.replace(sample_set(), method="garl"), court)
    save(tmp_path / "new" / "base.toml", both)
    assert load(tmp_path / "new" / "base.toml") == both
    assert dumps(loads(dumps(both), load_map)) == dumps(both)


def test_the_file_is_a_line_for_each_flight_and_names_its_genes_once() -> None:
    text = dumps(baseline(sample_set(20)))
    assert text.count("environment.fog") == 1
    assert len(text) < 20 * 550 + 2500


@settings(deadline=None)
@given(st.text(), st.text())
def test_no_signature_breaks_the_file(signature: str, name: str) -> None:
    strange = Answer(outcome="crashed", signature=signature)
    each = dataclasses.replace(sample_set(1, strange), npcs=name)
    seen = dataclasses.replace(strange, signature=printable(signature))
    readable = dataclasses.replace(sample_set(1, seen), npcs=printable(name))
    assert loads(dumps(baseline(each)), load_map) == baseline(readable)


def test_extra_genes_are_kept() -> None:
    scenarios = propose(LAWN, genome_for(LAWN, extras=(WIND,)), 0, 0, 2)
    samples = tuple(Sample(scenario=each, answer=LANDED) for each in scenarios)
    windy = baseline(dataclasses.replace(sample_set(), samples=samples))
    assert loads(dumps(windy), load_map) == windy


def test_destinations_are_kept() -> None:
    scenarios = propose(LAWN, with_destinations(genome_for(LAWN)), 0, 0, 2)
    samples = tuple(Sample(scenario=each, answer=LANDED) for each in scenarios)
    bound = baseline(dataclasses.replace(sample_set(), samples=samples))
    assert loads(dumps(bound), load_map) == bound


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("schema = 1", "schema = 2", "'schema': found 2, expected 1"),
        ("[versions]", "[version]", "'version': unknown key"),
        ('map = "lawn"', 'map = "moon"', r"'set\[0\].map': unknown map 'moon'"),
        ('"stack.landing:Lander"', '"Lander"', r"'set\[0\].system': found 'Lander', expected 'mod"),
        ('"environment.fog", ', "", r"'set\[0\].genes': found others .*\(environment.fog\)"),
        ("distance_m = 1.5", "distance_m = -1.0", r"'set\[0\].limits.distance_m'"),
        ('"landed", ""', '"floated", ""', r"'set\[0\].flights\[0\]': found 'floated', expected "),
        ('"landed", "", false', '"landed", "", 0', r"'set\[0\].flights\[0\]': found \[\d+, 'l"),
        (", [0.", ", [9.", r"'set\[0\].flights\[0\]': environment.dust: found 9"),
        (", [0.", ", [nan, 0.", r"'set\[0\].flights\[0\]': found \d+ values of genes, expected "),
        ("flights = [", "flights = 3 # [", "not valid TOML"),
    ],
)
def test_a_broken_file_names_source_and_key(old: str, new: str, words: str) -> None:
    text = dumps(baseline())
    assert old in text
    with pytest.raises(ScenarioError, match=words) as caught:
        loads(text.replace(old, new, 1), load_map, source="base.toml")
    assert "base.toml" in str(caught.value)


def test_a_file_that_is_not_there_tells_what_writes_one(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"expected a file that `garl baseline save` wrote"):
        load(tmp_path / "no.toml")


def test_what_no_file_can_hold_is_not_saved(tmp_path: Path) -> None:
    each = sample_set()
    dog = next(name for name, kind in LAWN.object_names if kind == "dog")
    small = dataclasses.replace(each.samples[0], scenario=each.samples[0].scenario.without(dog))
    mixed = dataclasses.replace(each, samples=(*each.samples[1:], small))
    for wrong, words in (
        ((each, each), "twice"),
        ((dataclasses.replace(each, samples=()),), "found no flights"),
        ((mixed,), "different genes or without some"),
    ):
        with pytest.raises(BaselineError, match=words):
            save(tmp_path / "base.toml", baseline(*wrong))
    assert not (tmp_path / "base.toml").exists()


def test_equal_surveys_draw_equal_scenarios_and_a_longer_one_begins_alike() -> None:
    assert Survey(count=5).scenarios(LAWN) == Survey(count=9).scenarios(LAWN)[:5]
    assert Survey(count=5).scenarios(LAWN) != Survey(count=5, seed=1).scenarios(LAWN)
    worst = max(each["environment.fog"] for each in Survey(count=50).scenarios(LAWN))
    assert (
        worst
        <= 0.15
        < max(each["environment.fog"] for each in Survey(count=50, weather="full").scenarios(LAWN))
    )


def test_another_world_is_told_from_another_stack() -> None:
    each = sample_set()
    assert unlike(each, job()) == ()
    assert unlike(each, dataclasses.replace(job(), system_sha256="new")) == ()
    strict = dataclasses.replace(job(), limits=Limits(time_s=60.0))
    assert unlike(each, strict) == (
        "limits: saved with 1.5 m, 120 s, abort ok, found 1.5 m, 60 s, abort ok",
    )
    other = job(Reference(module="sitl", file="/a/sitl.py", qualname="fly"))
    assert unlike(each, other) == (
        "simulator: saved with pytest_garl.simulation.fly:fly, found sitl:fly",
    )
    assert unlike(dataclasses.replace(each, map_sha256="0" * 64), job())[0].startswith("map lawn: ")
    learned = dataclasses.replace(job(), npcs=policy_spec("dqn"))
    trained = dataclasses.replace(each, npcs="dqn", npcs_sha256="0" * 64)
    assert unlike(trained, learned)[0].startswith("weights of dqn: saved with 000")


def test_versions_that_moved_on_are_told() -> None:
    assert "numpy was 2.0.0, is " in " ".join(moved_on(baseline()))
    gone = Baseline(cpu="z80", versions=(("no-such-package", "1"),), sets=())
    assert moved_on(gone) == (
        f"the CPU was z80, is {of_children()}",
        "no-such-package was 1, is absent",
    )


def test_two_sets_are_compared_scenario_by_scenario_and_only_equal_ones() -> None:
    before, after = sample_set(), sample_set()
    broken = dataclasses.replace(after.samples[2], answer=DOG)
    after = dataclasses.replace(after, samples=(*after.samples[:2], broken))
    flown: list[Scenario] = []

    def fly(scenarios: Sequence[Scenario]) -> list[Done]:
        flown.extend(scenarios)
        violation = flight_result(DOG.signature)
        return [Done(result=violation, sha256="", record=Path())] * len(scenarios)

    found = compare_sets(before, after, LAWN, fly)
    assert [pair.words for pair in found.of("broke")] == ["lawn-2: landed -> IV:dog:descent:seen"]
    # The type is new: the neighbours of its scenario are flown, and say that it is real.
    assert flown == list(neighbours(after.samples[2].scenario, LAWN))
    assert [each.words for each in found.new_types] == ["IV in lawn-2, in 3 of 3 neighbours"]
    assert [each.alike for each in found.new_types] == [((3, 3),)]
    with pytest.raises(BaselineError, match="did not fly the same scenarios"):
        compare_sets(before, sample_set(2), LAWN, fly)


def test_flights_that_decide_nothing_fail_the_gate_by_name() -> None:
    unsure = flight_result(outcome="inconclusive")
    flights = [
        Done(result=each, sha256="", record=Path())
        for each in (flight_result(), unsure, flight_result())
    ]
    found = compare_flights(sample_set(), flights, LAWN, lambda _: [])
    assert found.reasons == ("inconclusive: lawn-1",)
    assert [pair.name for pair in found.pairs] == ["lawn-0", "lawn-2"]


def write_ledger(path: Path, of: Job, method: str = "") -> None:
    ledger = Ledger.create(path, {"method": method} if method else {})
    ledger.add_search("a", "stack.landing:Lander", "lawn", 2, of.dumps())
    texts = [dump_scenario(each) for each in Survey(count=2).scenarios(LAWN)]
    ledger.add_slots("a", 0, dict(enumerate(texts)))
    claim = ledger.queue.claim()
    assert claim is not None
    ledger.queue.record(claim, flight_result(), "ab" * 32, 0.1)
    ledger.close()


@pytest.mark.parametrize("method", ["garl", "random", ""])
def test_what_a_search_flew_becomes_a_baseline_that_says_who_chose_the_scenarios(
    tmp_path: Path, method: str
) -> None:
    write_ledger(tmp_path / "ledger.sqlite", job(), method)
    (found,) = from_ledger(tmp_path / "ledger.sqlite").sets
    assert found == dataclasses.replace(sample_set(1), method=method)
    assert bool(found.caution) is (method == "garl")


def test_a_ledger_whose_policy_cannot_be_had_again_is_refused(tmp_path: Path) -> None:
    own = dataclasses.replace(policy_spec("waypoint"), name="mine", factory="mine:Policy")
    write_ledger(tmp_path / "ledger.sqlite", dataclasses.replace(job(), npcs=own))
    with pytest.raises(BaselineError, match=r"moved by 'mine' \(mine:Policy\), which is neither"):
        from_ledger(tmp_path / "ledger.sqlite")
    with pytest.raises(BaselineError, match="there is no ledger"):
        from_ledger(tmp_path / "none.sqlite")
