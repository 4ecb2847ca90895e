"""The judges: what counts, what is flown once only, and the intervals of what they measure."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.arms import arm_named
from lab.faults.control import ControlSystem
from lab.judges import __main__ as command
from lab.judges import causes, faults, preventable, tasks
from lab.judges.causes import CausesTask, ConfirmedCause, Inventory, Violating, cause_in
from lab.judges.faults import FaultTask, twin_of
from lab.judges.flights import OwnFlights
from lab.judges.intervals import Estimate, mean_of, over_clusters, over_pairs, p_of_signs
from lab.judges.preventable import AT_DECISION, is_near_touchdown, scenario_of
from lab.one_search import Flown, plan_of
from lab.table import ResultTable
from pytest_garl import Land, Mission, Observation
from pytest_garl.execution.reference import reference_to
from pytest_garl.execution.result import FlightResult
from pytest_garl.flight.flight import Contact, Flight, Touchdown, Track
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from tests.support import tiny_simulator
from tests.support.results import flight_result
from tests.support.stories import scenario_with

LAWN = load_map("lawn")


class Lands:
    """A landing system for the tiny simulator."""

    def reset(self, mission: Mission) -> None:
        pass

    def step(self, observation: Observation) -> Land:
        return Land()


# Tasks


@dataclass(frozen=True)
class Counted:
    """A task that writes down that it was flown, and fails if it is told to."""

    name: str
    log: str
    fails: bool = False

    @property
    def group(self) -> str:
        return self.name

    def row(self) -> dict[str, Any]:
        with Path(self.log).open("a") as file:
            file.write(f"{self.name}\n")
        if self.fails:
            raise ValueError("no such map")
        return {"arm": self.name, "told": "done"}


def one_thread() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(1)


def test_a_task_is_flown_once_and_a_failure_ends_no_other(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, folder = str(tmp_path / "log"), tmp_path / "judge"
    wanted = [Counted("a", log), Counted("b", log, fails=True), Counted("c", log)]
    assert tasks.run(wanted, folder, one_thread) == 1
    assert "ValueError: no such map" in capsys.readouterr().out
    assert Path(log).read_text().split() == ["a", "b", "c"]
    wanted[1] = Counted("b", log)
    assert tasks.run(wanted, folder, one_thread) == 0
    assert Path(log).read_text().split() == ["a", "b", "c", "b"]
    out = capsys.readouterr().out
    assert "2 of 3 are flown" in out
    assert "[1/1] b: done; 0 min so far, about 0 min left" in out
    table = ResultTable(file=tmp_path / "it.csv", columns=("arm", "commit"), key=("arm",))
    for _ in range(2):
        tasks.collect(wanted, folder, table)
    assert [row["arm"] for row in table.rows()] == ["a", "b", "c"]
    assert all(row["commit"] for row in table.rows())


# Judge 1


def answering(monkeypatch: pytest.MonkeyPatch, fails: Callable[[Any, Scenario], bool]) -> None:
    """Let ``fails(system, scenario)`` say which flights violate a property."""

    def flown_by(system: Any, npcs: object, scenario: Scenario) -> Flown:
        bad = flight_result("off", primary="distance")
        return Flown(result=bad if fails(system, scenario) else OK)

    monkeypatch.setattr(faults, "flown_by", flown_by)
    faults.flown_once.cache_clear()
    faults.violates.cache_clear()


OK = flight_result()


def is_control(system: Any) -> bool:
    return system is ControlSystem or system.__name__ == "ControlSystemTwin"


def task(arm: str = "random", flights: int = 40) -> FaultTask:
    return FaultTask(arm=arm, fault="placebo", seed=200, flights=flights)


@pytest.mark.parametrize("arm", ["random", "garl"])
def test_a_search_ends_at_the_first_find_that_twins_confirm(
    arm: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(system: Any, scenario: Scenario) -> bool:
        if is_control(system):
            return scenario.seed % 5 == 1
        if system.__name__.endswith("Twin"):
            # An edge: two of four twins.
            slow = system.parameters.approach_mps < system.__base__.parameters.approach_mps
            return scenario.seed % 5 == 3 or (scenario.seed % 5 == 2 and slow)
        return scenario.seed % 5 in (1, 2, 3)

    answering(monkeypatch, fails)
    row = task(arm).row()
    assert row["found_at"] is not None
    assert (row["signature"], row["told"]) == ("off", f"found in flight {row['found_at']}")
    first = next(
        number for number, flight in enumerate(drawn(arm), start=1) if flight.seed % 5 == 3
    )
    before = [each.seed % 5 for each in drawn(arm)[: first - 1]]
    assert (row["found_at"], row["masked"], row["unconfirmed"]) == (
        first,
        before.count(1),
        before.count(2),
    )


def drawn(arm: str) -> list[Scenario]:
    """Return the first generation of a search, which is the same for both arms."""
    plan = plan_of("lawn", 200, 40)
    assert plan.population == 8
    return [*arm_named(arm).make(plan).ask()]


def test_arms_of_a_fault_fly_what_they_share_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown: list[tuple[Any, Scenario]] = []

    def fails(system: Any, scenario: Scenario) -> bool:
        flown.append((system, scenario))
        return scenario.seed % 5 == 1

    answering(monkeypatch, fails)
    wanted = [task(arm) for arm in ("random", "garl")]
    assert tasks.run(wanted, tmp_path, one_thread) == 0
    assert len(flown) == len({(str(system), scenario) for system, scenario in flown})
    assert sum(not is_control(system) for system, _ in flown) == 2 * 40 - len(drawn("garl"))


def test_what_the_control_fails_as_well_is_never_found(monkeypatch: pytest.MonkeyPatch) -> None:
    answering(monkeypatch, lambda system, scenario: scenario.seed % 2 == 0)
    row = task(flights=20).row()
    assert (row["found_at"], row["told"]) == (None, "not found")
    assert row["masked"] > 0 == row["unconfirmed"]


def test_a_twin_differs_in_its_approach_alone() -> None:
    twin = twin_of(ControlSystem, 1.02)
    expected = dataclasses.replace(ControlSystem.parameters, approach_mps=2.04)
    assert twin.parameters == expected
    assert issubclass(twin, ControlSystem)


def fault_rows(arm: str, found: dict[str, list[int | None]], flights: int = 100) -> list[Any]:
    return [
        {
            "arm": arm,
            "fault": fault,
            "seed": str(20 + place),
            "flights": str(flights),
            "control": "10",
            "found_at": str(at or ""),
            "commit": "0123456789",
        }
        for fault, seeds in found.items()
        for place, at in enumerate(seeds)
    ]


def test_the_report_compares_all_pairs_and_those_after_the_control() -> None:
    rows = [
        *fault_rows("random", {"gate": [5, 60], "mean": [100, None]}),
        *fault_rows("garl", {"gate": [5, 35], "mean": [55, 100], "placebo": [7, None]}),
    ]
    text = faults.report(rows)
    # 195 of 265 flights; after the control 25 + 45 + 90 of 50 + 90 + 90.
    assert "| random | 4 | 0.74 [" in text
    assert "| 17.5 [" in text
    assert "| 3 | 0.70 [" in text
    assert "| garl | 4 | 25 | 25 | 50 | 100 |" in text
    # Earlier in two pairs (35 to 60, 55 to 100), alike in the others.
    assert "| 2 : 0 : 2 | 0.5000 |" in text
    assert "Missed by random, with the number of seeds: mean (1)." in text
    assert "Missed by garl, with the number of seeds: none." in text
    assert "a find of the placebo, which has no fault, in 1 of 2." in text
    assert text.endswith("Flown at 0123456789.")
    assert faults.report([]) == "nothing is flown"


def test_what_not_all_arms_have_flown_does_not_count() -> None:
    rows = [
        *fault_rows("garl", {"gate": [25, 25], "mean": [None]}),
        *fault_rows("random", {"gate": [50]}),
    ]
    text = faults.report(rows)
    assert "| garl | 1 | " in text
    assert "| random | 1 | 0.50 [" in text
    assert "Left out, because not all arms have flown them: 2 searches." in text


def test_faults_of_a_seed_are_flown_in_a_random_order() -> None:
    first, second = (
        [each.fault for each in faults.tasks(["garl", "random"], "abcdefgh", [seed], 100)]
        for seed in (20, 21)
    )
    assert first[::2] == first[1::2]
    assert sorted(first[::2]) == sorted(second[::2]) == [*"abcdefgh"]
    assert first != second


def test_what_an_arm_missed_is_flown_for_longer() -> None:
    rows = [
        *fault_rows("garl", {"gate": [5, None, None, None]}),
        *fault_rows("random", {"gate": [None]}),
    ]
    longer = faults.missed(rows, faults.MORE_ARMS, range(20, 23))
    assert [(each.arm, each.seed, each.flights) for each in longer] == [
        ("garl", 21, 400),
        ("garl", 22, 400),
    ]
    rows += fault_rows("garl", {"gate": [None, 250]}, flights=400)
    assert "garl found 1 of the 2 faults that it had missed in 100 flights" in faults.report(rows)


# Judge 2


def nominal(**genes: float) -> Scenario:
    genome = genome_for(LAWN)
    scenario = decode(genome.nominal, genome, map="lawn", seed=1)
    return scenario.without(*(name for name, _ in LAWN.all_objects)).replace(
        {f"environment.{name}": value for name, value in genes.items()}
    )


def test_a_cause_names_groups_and_types_without_values_and_numbers() -> None:
    assert cause_in(nominal()) == frozenset()
    assert cause_in(nominal(fog=0.1)) == cause_in(nominal(fog=0.5)) == {"fog"}
    dog = scenario_with("dog-1", (-8.0, 0.0), 5.0, {"grade": 2.0})
    child = scenario_with("person-2", (-8.0, 0.0), 2.0, {"grade": 0.0, "body": 1.0})
    assert cause_in(dog) == {"dog"}
    assert cause_in(child) == {"child"}
    assert cause_in(nominal().replace({"decoy-2.kind": 1.0, "wind.mean_mps": 4.0})) == {
        "decoy",
        "wind",
    }


class TinyFlights(OwnFlights):
    """Flights of the tiny simulator, of whose twins some violate alike."""

    def __init__(self, folder: Path) -> None:
        super().__init__(Lands, LAWN, folder)
        self.job = dataclasses.replace(
            self.job, npcs=policy_spec("stationary"), simulator=reference_to(tiny_simulator.fly)
        )
        self.violating = 4

    def twins(self, scenario: Scenario) -> Iterator[FlightResult]:
        yield from [flight_result("I:nothing", violation_type="I")] * self.violating
        yield from [OK] * (4 - self.violating)


def add(inventory: Inventory, scenario: Scenario, number: int = 30) -> None:
    flight = inventory.fly(inventory.fly.job, scenario)
    assert flight.result.verdict.violation, scenario
    inventory.add(Violating(number=number, how="bred", scenario=scenario, flight=flight))


def test_a_violation_is_shrunk_to_its_cause_which_explains_others(tmp_path: Path) -> None:
    inventory = Inventory(fly=TinyFlights(tmp_path))
    add(inventory, nominal(fog=0.4, rain=0.5, snow=0.2))
    (found,) = inventory.found
    assert found.cause == {"fog"}
    assert (found.kind, found.number, found.twins) == ("I:nothing", 30, 4)
    beside = inventory.beside
    assert 4 < beside <= causes.SHRINK_FLIGHTS + 4
    add(inventory, nominal(fog=0.3, dust=0.5), number=31)
    assert inventory.beside == beside
    assert inventory.causes == {frozenset({"fog"})}
    assert found.to_json()["cause"] == ["fog"]


@pytest.mark.parametrize(("violating", "confirmed"), [(2, True), (1, False)])
def test_two_of_four_twins_confirm_a_cause(violating: int, confirmed: bool, tmp_path: Path) -> None:
    fly = TinyFlights(tmp_path)
    fly.violating, inventory = violating, Inventory(fly=fly)
    for _ in range(causes.MOST_ASKED + 2):
        add(inventory, nominal(fog=0.4))
    assert len(inventory.causes) == confirmed
    # A signature whose violations nothing confirms is not asked about for ever.
    assert inventory.unconfirmed == (0 if confirmed else causes.MOST_ASKED)


def test_arms_share_the_flights_of_their_group(tmp_path: Path) -> None:
    fly = TinyFlights(tmp_path)
    first = fly(fly.job, nominal(fog=0.4))
    assert fly(fly.job, nominal(fog=0.4)) is first
    other = fly(dataclasses.replace(fly.job, npcs=policy_spec("waypoint")), nominal(fog=0.4))
    assert first.record != other.record
    assert {each.name for each in tmp_path.iterdir()} == {first.record.name, other.record.name}
    tasks = causes.tasks(["garl", "exploring+"], ["opencv", "mm"], [23], 400)
    assert [each.group for each in tasks] == ["opencv-23-400"] * 2 + ["mm-23-400"] * 2
    group = causes.flights_of_group("ordinary", "lawn", "a")
    assert causes.flights_of_group("ordinary", "lawn", "a") is group
    assert causes.flights_of_group("ordinary", "lawn", "b") is not group


@pytest.mark.parametrize("arm", ["garl", "random"])
def test_a_search_of_the_stand_in_has_causes_beyond_its_control(arm: str) -> None:
    task = CausesTask(arm=arm, system="ordinary", seed=204, flights=60)
    row = task.row()
    assert row == task.row()
    assert (row["map"], row["control"]) == ("court", 8)
    assert 0 < row["count"] <= len(row["causes"]) <= row["asked"] <= row["violations"]
    assert all(8 < each["number"] <= 60 and each["twins"] >= 2 for each in row["causes"])
    assert row["told"] == f"{row['count']} causes in {row['violations']} violations"


def cause_rows(arm: str, counts: dict[tuple[str, str], int]) -> list[Any]:
    found = [
        ConfirmedCause(
            cause=frozenset({f"fog {number}"}),
            kind="I",
            signature="I",
            number=number,
            how="bred",
            twins=4,
        )
        for number in range(208, 217)
    ]
    return [
        {
            "arm": arm,
            "system": system,
            "seed": seed,
            "control": "20",
            "flights": "400",
            "violations": "40",
            "signatures": "9",
            "causes": json.dumps([each.to_json() for each in found[:count]]),
            "commit": "0123456789",
        }
        for (seed, system), count in counts.items()
    ]


def test_the_report_pairs_arms_by_seed_and_system() -> None:
    keys = [(str(seed), system) for seed in range(20, 25) for system in ("opencv", "mm")]
    garl = cause_rows("garl", dict.fromkeys(keys, 9))
    rival = cause_rows("exploring+", {key: 6 + int(key[0]) % 2 for key in keys})
    frozen = cause_rows("exploring", dict.fromkeys(keys[:4], 6))
    text = causes.report([*garl, *rival, *frozen])
    assert "| exploring+ | 10 | 6.4 [" in text
    assert "| 2.6 [" in text
    assert "| 1.41 [" in text
    assert "| 0.002 |" in text
    assert "| exploring | 4 | 6.0 [6.0, 6.0] | 40.0 | 9.0 | 3.0 [3.0, 3.0] | 1.50 [" in text
    assert "garl 30, 60, 60; exploring+ 30, 34, 34" in text


def test_the_report_counts_apart_the_causes_that_contain_no_other() -> None:
    sets: list[list[str]] = [["fog"], ["dust", "light"], [], ["fog"], ["fog", "rain"]]
    (row,) = cause_rows("garl", {("20", "opencv"): len(sets)})
    found = json.loads(row["causes"])
    for each, cause in zip(found, sets, strict=True):
        each["cause"] = cause
    text = causes.report([{**row, "causes": json.dumps(found)}])
    assert "| garl | 1 | 4.0 | 40.0 | 9.0 | – | – | – | 3.0 | – | – | – |" in text
    assert "garl 3, 1, 0." in text


# Judge 3


def test_arms_fly_the_same_scenarios_but_for_the_begin() -> None:
    for number in range(6):
        decided, gene = (
            scenario_of("lawn", 200, number, as_gene=as_gene) for as_gene in (False, True)
        )
        (name,) = {key.partition(".")[0] for key, _ in decided.genes if key.endswith(".velocity")}
        differing = {key for key, value in decided.genes if gene[key] != value}
        assert differing == {f"{name}.phase"}
        assert decided[f"{name}.phase"] == AT_DECISION > gene[f"{name}.phase"] >= 0
        assert decided[f"{name}.grade"] == 2.0
        assert cause_in(decided) - {"child"} <= {name.partition("-")[0]}


def collision(height_m: float, sinks_mps: float, touchdown_s: float | None = None) -> Flight:
    contact = Contact(
        time_s=20.0,
        body="dog-1",
        kind="dog",
        body_class="dynamic",
        position_m=(0.0, 0.0, height_m),
        speed_mps=1.0,
        tilt_rad=0.0,
    )
    touchdown = None
    if touchdown_s is not None:
        touchdown = Touchdown(
            time_s=touchdown_s,
            position_m=(0.0, 0.0, 0.0),
            distance_m=0.0,
            speed_mps=0.5,
            tilt_rad=0.0,
            on="marker",
        )
    return Flight(
        outcome="collision",
        final_distance_m=0.0,
        elapsed_s=20.0,
        marker_position_m=(0.0, 0.0),
        uav=Track(
            time_s=np.array([0.0, 20.0]),
            position_m=np.array([[0.0, 0.0, 9.0], [0.0, 0.0, height_m]]),
            attitude=np.zeros((2, 4)),
            velocity_mps=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -sinks_mps]]),
        ),
        objects=(),
        contacts=(contact,),
        separations=(),
        events=(),
        steps=(),
        touchdown=touchdown,
    )


@pytest.mark.parametrize(
    ("flight", "expected"),
    [
        (collision(1.5, 0.5), False),
        (collision(0.6, 0.5), True),
        (collision(0.6, -1.0), False),
        (collision(0.24, 0.0, touchdown_s=19.5), True),
        (collision(0.24, 0.0, touchdown_s=17.0), False),
    ],
)
def test_a_contact_near_the_touchdown_is_told(flight: Flight, expected: bool) -> None:
    assert is_near_touchdown(flight) is expected


def preventable_row(arm: str, hits: str) -> dict[str, str]:
    counts = dict.fromkeys(preventable.TABLE.columns[4:12], "0")
    told = {"arm": arm, "system": "mm", "map": "lawn", "seed": "20", "hits": hits, "commit": "01"}
    return counts | told | {"flights": str(len(hits)), "counted": str(hits.count("1"))}


def test_the_report_pairs_arms_by_scenario() -> None:
    text = preventable.report(
        [preventable_row("gene", "1000" * 10), preventable_row("garl", "1100" * 10)]
    )
    assert "| gene | 40 | 25.0 % [" in text
    assert "| 2.00 [" in text
    assert "| mm | 10 | 20 | 25.0 [" in text


# Figures


def test_intervals_hold_what_they_are_of() -> None:
    assert mean_of([3.0, 3.0, 3.0]) == Estimate(value=3.0, low=3.0, high=3.0)
    assert mean_of([1.0, 2.0, 3.0]).text() == "2.00 [-0.48, 4.48]"
    own, rival = np.array([[1.0, 2.0], [4.0, np.nan]]), np.array([[2.0, 4.0], [8.0, 16.0]])
    assert over_clusters(own, rival, ["a", "b"]) == Estimate(value=0.5, low=0.5, high=0.5)
    fewer = over_clusters(own, rival, ["a", "b"], difference=True)
    assert fewer.value == pytest.approx(7 / 3)
    assert fewer.low <= fewer.value <= fewer.high
    assert over_pairs([2, 4], [1, 2], difference=False) == Estimate(value=2.0, low=2.0, high=2.0)
    assert over_pairs([2, 4], [1, 2], difference=True).value == 1.5


def test_an_interval_over_clusters_is_wider_than_one_over_independent_faults() -> None:
    rng = np.random.default_rng(1)
    own, rival = rng.integers(1, 100, (2, 12, 5)).astype(float)
    alone = over_clusters(own, rival, [str(number) for number in range(12)])
    grouped = over_clusters(
        np.repeat(own[:4], 3, axis=0), np.repeat(rival[:4], 3, axis=0), list("aaabbbcccddd")
    )
    assert grouped.high - grouped.low > alone.high - alone.low


def test_signs_are_flipped_exactly() -> None:
    assert p_of_signs([1.0, 2.0, 3.0, 4.0, 5.0]) == 2 / 32
    assert p_of_signs([1.0, -1.0, 0.5, -0.5]) == 1.0


def test_the_command_prints_what_a_folder_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for judge in command.JUDGES:
        words = ["judges", judge, "--report", f"--folder={tmp_path}", f"--table={tmp_path}/it.csv"]
        monkeypatch.setattr("sys.argv", words)
        command.main()
        assert capsys.readouterr().out == "nothing is flown\n"
