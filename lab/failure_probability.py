"""Check the failure probability and the failure regions where the truth is known.

    python -m lab.failure_probability stand-in

flies 200,000 draws of the example of a model of use with the stand-in of a landing; their failing
share is the truth.  Then it repeats searches of 400 flights, which draw from these flights, and
prints how often the interval holds the truth, and how wide it is.  The arms are

- **direct**: plain draws only, with the Clopper-Pearson interval;
- **use**: the method, whose region is predicted from its first 100 flights;
- **archive**: the method, whose region is predicted from a search of ``garl``, 400 flights;
- **placebo**: as ``use``, but the results of these 100 flights are exchanged among them.

    python -m lab.failure_probability fly FOLDER --flights=2000 --plain

flies OpenCV-MLS on the map ``lawn`` through draws of the model of use, in a project that it writes
into the folder; the same command goes on with an interrupted run.  ``--plain`` lets all be plain
draws.

    python -m lab.failure_probability compare TRUTH ESTIMATE

compares the estimate of one such folder with the plain draws of another, and judges the rules that
are learned from the first on the flights of the second.

    python -m lab.failure_probability resample TRUTH

repeats searches as the stand-in does, but they draw from the plain draws of such a folder.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lab.stand_in import stand_in
from lab.stand_in_way import ORDINARY, STURDY, LandingModel
from lab.table import ResultTable
from pytest_garl.cases.corpus import Corpus
from pytest_garl.execution.ledger import Ledger
from pytest_garl.files.run_files import RUN_FOLDER, SEARCH_LEDGER
from pytest_garl.reports.failure_probability import (
    FailureProbability,
    SamplePart,
    failure_probability,
)
from pytest_garl.reports.failure_regions import failure_region
from pytest_garl.reports.failure_rules import (
    LEAST_FAILING,
    ConditionTable,
    table_of_scenarios,
)
from pytest_garl.reports.risk_reading import ANY_FAILURE, read_risks
from pytest_garl.scenarios.chromosome import decode, encode
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.use_file import parse_use, use_of, use_text
from pytest_garl.scenarios.use_model import UseModel
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.methods.garl import Garl
from pytest_garl.search.methods.use import LEARNED_FROM, PredictedRegion
from pytest_garl.search.model import proximities
from pytest_garl.search.operators import Matrix
from pytest_garl.verdicts.statistics import share_interval

DOMAIN, MAP = domain_named("field"), load_map("lawn")
GENOME = genome_of(DOMAIN, MAP)
EXAMPLE = use_text(DOMAIN.name, [(GENOME, MAP)])
LANDINGS = {"ordinary": ORDINARY, "sturdy": STURDY}
ARMS = ("direct", "use", "archive", "placebo")
FLIGHTS, POPULATION = 400, 20
TAUGHT_SEARCHES = 6
"""Searches of `garl` from which the regions of ``archive`` are learned, in turns."""
CHUNK = 2_000
MEASURED = 1_500
"""Draws that find the region of a search: fewer than those of the method, to save time."""
TABLE = ResultTable(
    file=Path("docs/results/failure-probability.csv"),
    columns=(
        *("landing", "arm", "truth", "searches", "covered", "too_low", "too_high"),
        *("mean", "error", "width", "region_share", "recall"),
    ),
    key=("landing", "arm"),
)
FLOWN_TABLE = ResultTable(
    file=Path("docs/results/failure-probability-flown.csv"),
    columns=("folder", "what", "flights", "failing", "share", "low", "high", "words"),
    key=("folder", "what"),
)


def example_model() -> UseModel:
    """Return the example of a model of use, in `field` on the map."""
    return use_of(parse_use(EXAMPLE, "the example"), GENOME, MAP)


@dataclass(frozen=True, slots=True, kw_only=True)
class Flights:
    """Chromosomes (n, d), how near they came to violating each property (n, p), and who did (n,).

    Those of a landing in draws of the model of use are the pool from which searches draw.
    """

    rows: Matrix
    proximity: Matrix
    violates: Matrix

    def of(self, places: NDArray[np.intp]) -> Flights:
        """Return some of the flights."""
        return Flights(
            rows=self.rows[places], proximity=self.proximity[places], violates=self.violates[places]
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """What one search estimates; ``recall`` is the share of its failures inside of its region."""

    found: FailureProbability
    region_share: float = 0.0
    recall: float = 0.0


def fly_rows(seed: int, count: int) -> tuple[Matrix, Sequence[tuple[Matrix, Matrix]]]:
    """Draw chromosomes, (count, size), and fly them with each landing."""
    model, rng = example_model(), np.random.default_rng(seed)
    rows = model.rows(count, rng)
    # Scenarios are not repaired: no body moves the marker or a decoy away.
    scenarios = [
        decode(row, model.genome, map=MAP.name, seed=int(rng.integers(2**32))) for row in rows
    ]
    return rows, [_flown(scenarios, landing) for landing in LANDINGS.values()]


def _flown(scenarios: Sequence[Scenario], landing: LandingModel) -> tuple[Matrix, Matrix]:
    results = [stand_in(each, MAP, landing) for each in scenarios]
    violates = np.array([float(each.verdict.violation) for each in results])
    return np.array([proximities(each) for each in results]), violates


def pools(draws: int, executor: Executor) -> dict[str, Flights]:
    """Return the draws and their results by landing."""
    sizes = [min(CHUNK, draws - begin) for begin in range(0, draws, CHUNK)]
    chunks = list(executor.map(fly_rows, range(len(sizes)), sizes))
    rows = np.concatenate([each for each, _ in chunks])
    return {
        name: Flights(
            rows=rows,
            proximity=np.concatenate([flown[place][0] for _, flown in chunks]),
            violates=np.concatenate([flown[place][1] for _, flown in chunks]),
        )
        for place, name in enumerate(LANDINGS)
    }


def garl_flights(landing: str, seed: int) -> Flights:
    """Return the flights of a search of `garl`."""
    plan = SearchPlan(map=MAP, genome=GENOME, seed=seed, flights=FLIGHTS, population=POPULATION)
    method, scenarios = Garl(plan), list[Scenario]()
    while len(scenarios) < FLIGHTS:
        asked = method.ask()
        method.tell(
            [
                FlownScenario(scenario=each, result=stand_in(each, MAP, LANDINGS[landing]))
                for each in asked
            ]
        )
        scenarios += asked
    proximity, violates = _flown(scenarios, LANDINGS[landing])
    rows = np.array([encode(each, GENOME) for each in scenarios])
    return Flights(rows=rows, proximity=proximity, violates=violates)


def estimate(pool: Flights, arm: str, rng: np.random.Generator, known: Flights | None) -> Estimate:
    """Return what a search of an arm estimates; one of the archive knows earlier flights."""
    count = {"direct": FLIGHTS, "archive": POPULATION}.get(arm, LEARNED_FROM + POPULATION)
    plain = rng.integers(len(pool.rows), size=count)
    parts = [_part("use", 1.0, pool.violates[plain])]
    rest = FLIGHTS - count
    if rest == 0:
        return _estimate(parts)
    taught = known or pool.of(plain[:LEARNED_FROM])
    if arm == "placebo":
        order = rng.permutation(len(taught.rows))
        taught = Flights(
            rows=taught.rows,
            proximity=taught.proximity[order],
            violates=taught.violates[order],
        )
    region = PredictedRegion(
        GENOME,
        taught.rows,
        taught.proximity,
        taught.violates,
        pool.rows[rng.integers(len(pool.rows), size=MEASURED)],
    )
    found: dict[bool, list[float]] = {True: [], False: []}
    while min(map(len, found.values())) < rest // 2:
        places = rng.integers(len(pool.rows), size=rest)
        covered = region.covers(pool.rows[places])
        for side in found:
            found[side] += list(pool.violates[places[covered == side]])
    for how, share, side in (
        ("inside", region.share, True),
        ("outside", 1 - region.share, False),
    ):
        parts.append(_part(how, share, found[side][: rest // 2]))
    _, inside, outside = (part.share * part.failing / part.flights for part in parts)
    recall = inside / (inside + outside) if inside + outside else 0.0
    return _estimate(parts, region.share, recall)


def _part(how: str, share: float, violates: Sequence[float] | Matrix) -> SamplePart:
    return SamplePart(how=how, share=share, flights=len(violates), failing=int(np.sum(violates)))


def _estimate(parts: Sequence[SamplePart], share: float = 0.0, recall: float = 0.0) -> Estimate:
    found = failure_probability(parts)
    assert found is not None
    return Estimate(found=found, region_share=share, recall=recall)


def row_of(
    landing: str, arm: str, pool: Flights, searches: int, known: Sequence[Flights]
) -> Mapping[str, Any]:
    """Return the row of an arm: how often the interval of its searches holds the truth."""
    seeds = np.random.SeedSequence([ARMS.index(arm), *landing.encode()]).spawn(searches)
    found = []
    for number, seed in enumerate(seeds):
        own = known[number % len(known)] if arm == "archive" else None
        found.append(estimate(pool, arm, np.random.default_rng(seed), own))
    truth = float(np.mean(pool.violates))
    low, high = (np.array([getattr(each.found, end) for each in found]) for end in ("low", "high"))
    return {
        "landing": landing,
        "arm": arm,
        "truth": f"{truth:.4f}",
        "searches": searches,
        "covered": int(np.sum((low <= truth) & (truth <= high))),
        "too_low": int(np.sum(high < truth)),
        "too_high": int(np.sum(low > truth)),
        "mean": f"{np.mean([each.found.share for each in found]):.4f}",
        "error": f"{np.std([each.found.share for each in found]):.4f}",
        "width": f"{np.mean(high - low):.4f}",
        "region_share": f"{np.mean([each.region_share for each in found]):.4f}",
        "recall": f"{np.mean([each.recall for each in found]):.4f}",
    }


def simulate(draws: int, searches: int, workers: int) -> None:
    """Append the rows of all arms."""
    with ProcessPoolExecutor(workers) as executor:
        found = pools(draws, executor)
        known = {
            name: list(executor.map(garl_flights, [name] * TAUGHT_SEARCHES, range(TAUGHT_SEARCHES)))
            for name in LANDINGS
        }
        rows = [
            executor.submit(row_of, name, arm, found[name], searches, known[name])
            for name in LANDINGS
            for arm in ARMS
        ]
        TABLE.append(row.result() for row in rows)


TESTS = """\
import pytest

from landing_systems.opencv_mls import OpenCvLandingSystem

pytestmark = pytest.mark.garl(system=OpenCvLandingSystem, maps=["lawn"], domain="field")


def test_it_flies(landing):
    assert landing.elapsed_s > 0
"""


def fly(folder: Path, flights: int, seed: int, workers: int, *, plain: bool) -> int:
    """Fly OpenCV-MLS in a project in the folder, or go on; return pytest's exit status."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "test_opencv.py").write_text(TESTS)
    (folder / "use.toml").write_text(EXAMPLE)
    (folder / "pytest.ini").write_text("[pytest]\ngarl_use = use.toml\ngarl_unasserted = note\n")
    options = [
        f"--garl-budget={flights}",
        "--garl-method=use",
        f"--garl-seed={seed}",
        f"--garl-workers={workers}",
        "--garl-shrink=0",
        # The first generation is plain draws.
        *([f"--garl-population={flights}"] if plain else []),
        *(["--garl-resume"] if (folder / RUN_FOLDER / SEARCH_LEDGER).exists() else []),
    ]
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *options], cwd=folder, check=False
    ).returncode


def compare(truth: Path, estimated: Path) -> Iterator[Mapping[str, Any]]:
    """Yield the rows of the comparison of a folder's plain draws with the estimate of another."""
    table, shows, kinds = _flights_in(truth)
    total, failing = len(shows), sum(bool(each) for each in shows)
    low, high = share_interval(failing, total)
    yield _flown_row("truth", total, failing, failing / total, low, high)
    (risk,) = read_risks(_ledger(estimated), Corpus(estimated))
    for part in risk.parts:
        low, high = share_interval(part.failing, part.flights)
        yield _flown_row(
            f"estimate: {part.how}, {100 * part.share:.1f} % of use",
            part.flights,
            part.failing,
            part.failing / part.flights,
            low,
            high,
        )
    found, flights = risk.probability, sum(each.flights for each in risk.parts)
    if found is not None:
        ends = found.share, found.low, found.high
        yield _flown_row("estimate", flights, sum(e.failing for e in risk.parts), *ends)
    taught_table, taught_shows, _ = _flights_in(estimated)
    both = ConditionTable(
        features=table.features,
        values={
            key: np.concatenate([taught_table.values[key], each])
            for key, each in table.values.items()
        },
    )
    signatures = np.array([*taught_shows, *shows])
    taught = np.arange(len(signatures)) < len(taught_shows)
    for kind in (ANY_FAILURE, *kinds):
        is_kind = signatures != "" if kind == ANY_FAILURE else signatures == kind
        if np.sum(is_kind[taught]) < LEAST_FAILING:
            continue
        rule = failure_region(kind, both, is_kind, taught, ~taught)
        words = f"{rule.rule or 'no rule found'}; {rule.failing} show it, recall {rule.recall:.2f}"
        low, high = share_interval(rule.hits, rule.covered)
        yield _flown_row(f"rule: {kind}", rule.covered, rule.hits, rule.precision, low, high, words)


def resample(folder: Path, searches: int) -> Iterator[Mapping[str, Any]]:
    """Yield the rows of the arms whose searches draw from the flights of a folder."""
    with closing(Ledger(_ledger(folder))) as ledger:
        flights = [each for each in ledger.queries.flights() if not each.result.inconclusive]
    pool = Flights(
        rows=np.array([encode(parse_scenario(each.scenario), GENOME) for each in flights]),
        proximity=np.array([proximities(each.result) for each in flights]),
        violates=np.array([float(each.result.verdict.violation) for each in flights]),
    )
    for arm in ARMS:
        # An archive would need searches of its own.
        if arm != "archive":
            yield row_of("OpenCV-MLS", arm, pool, searches, ())


def _flown_row(
    what: str, flights: int, failing: int, share: float, low: float, high: float, words: str = ""
) -> Mapping[str, Any]:
    values = [f"{each:.4f}" for each in (share, low, high)]
    cells = (what, flights, failing, *values, words)
    return dict(zip(FLOWN_TABLE.columns[1:], cells, strict=True))


def _ledger(folder: Path) -> Path:
    return folder / RUN_FOLDER / SEARCH_LEDGER


def _flights_in(folder: Path) -> tuple[ConditionTable, list[str], list[str]]:
    """Return the decided flights of a folder, what each shows, and its kinds of violation."""
    with closing(Ledger(_ledger(folder))) as ledger:
        flights = [each for each in ledger.queries.flights() if not each.result.inconclusive]
    shows = [each.signature if each.result.verdict.violation else "" for each in flights]
    table = table_of_scenarios([parse_scenario(each.scenario) for each in flights], MAP)
    return table, shows, [kind for kind, _ in Counter(filter(None, shows)).most_common()]


def main() -> None:
    """Run the check that the command line names."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    simulated = commands.add_parser("stand-in")
    simulated.add_argument("--draws", type=int, default=200_000)
    simulated.add_argument("--searches", type=int, default=500)
    simulated.add_argument("--workers", type=int, default=2)
    flying = commands.add_parser("fly")
    flying.add_argument("folder", type=Path)
    flying.add_argument("--flights", type=int, default=FLIGHTS)
    flying.add_argument("--seed", type=int, default=0)
    flying.add_argument("--workers", type=int, default=2)
    flying.add_argument("--plain", action="store_true")
    comparing = commands.add_parser("compare")
    comparing.add_argument("truth", type=Path)
    comparing.add_argument("estimate", type=Path)
    again = commands.add_parser("resample")
    again.add_argument("truth", type=Path)
    again.add_argument("--searches", type=int, default=500)
    named = parser.parse_args()
    if named.command == "stand-in":
        simulate(named.draws, named.searches, named.workers)
    elif named.command == "fly":
        sys.exit(fly(named.folder, named.flights, named.seed, named.workers, plain=named.plain))
    elif named.command == "resample":
        TABLE.append(resample(named.truth, named.searches))
    else:
        rows = compare(named.truth, named.estimate)
        FLOWN_TABLE.append({"folder": named.estimate.name, **row} for row in rows)


if __name__ == "__main__":
    main()
