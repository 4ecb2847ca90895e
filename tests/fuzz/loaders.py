"""The eleven kinds of files: good samples of each, and what the project does with one."""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import random
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lab.experiment import spec as plan
from pytest_garl.cases import case_file as files
from pytest_garl.cases import corpus
from pytest_garl.cases.description import describe_scenario
from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import FlightId
from pytest_garl.execution.fly_and_judge import fly_job
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.stored_ledger import check_stored
from pytest_garl.flight import flight_file
from pytest_garl.gate import baseline_file as baseline
from pytest_garl.gate import record
from pytest_garl.npcs import learned as network
from pytest_garl.npcs.weights import WEIGHTS
from pytest_garl.scenarios import files as scenarios
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps import loading as maps
from pytest_garl.scenarios.validity import problems
from pytest_garl.search import archive as archives
from pytest_garl.search.method import FlownScenario, SearchPlan
from pytest_garl.search.methods.garl import Garl
from pytest_garl.search.objectives import violation_proximity
from tests.cases import samples as case_samples
from tests.execution.flying import Good, job_of, scenario
from tests.fuzz import binary_mutations, mutations
from tests.gate import samples as baseline_samples
from tests.lab.experiment.test_spec import TEXT as PLAN
from tests.support.results import flight_result

Change = Callable[[random.Random], None]
_COURT = maps.load_map("court")
_CASES = Path(__file__).parents[2] / "scenarios" / "regressions"
_RUN = {"seed": 3, "version": "1"}


@dataclass(frozen=True, kw_only=True)
class Loader:
    """One kind of file: ``prepare`` writes a changed one into a folder, ``load`` uses it."""

    prepare: Callable[[Path, random.Random], Path]
    load: Callable[[Path, random.Random], None]


def _text_file(name: str, samples: Callable[[], list[str]]) -> Callable[..., Path]:
    kept: list[str] = []

    def prepare(folder: Path, rng: random.Random) -> Path:
        if not kept:
            kept.extend(samples())
        text = rng.choice(kept)
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if rng.random() < 0.3:
            path.write_bytes(mutations.bytes_changed(text.encode(), rng))
        else:
            changed = mutations.text_changed(text, rng)
            path.write_text(changed, encoding="utf-8", errors="surrogatepass")
        return path

    return prepare


def _cases() -> list[str]:
    own = [case_samples.case(), case_samples.case_with_changes()]
    shipped = sorted(_CASES.glob("*/*.toml"))[:4]
    return [*(files.dump_case(each) for each in own), *(file.read_text() for file in shipped)]


def _load_case(path: Path, rng: random.Random) -> None:
    (entry,) = corpus.Corpus(path.parent.parent).all_entries()
    if entry.problem:
        raise GarlError(entry.problem)
    case = entry.case
    assert case is not None
    assert files.parse_case(files.dump_case(case), maps.load_map) == case
    assert case.id
    list(describe_scenario(case.scenario, ()))


def _load_map(path: Path, rng: random.Random) -> None:
    maps._read.cache_clear()
    found = maps.load_map(path.stem, (path.parent,))
    genome = genome_for(found)
    problems(decode(genome.nominal, genome, map=found.name, seed=1), found)


def _load_baseline(path: Path, rng: random.Random) -> None:
    found = baseline.load_baseline(path)
    assert baseline.parse_baseline(baseline.dump_baseline(found), maps.load_map) == found


def _load_plan(path: Path, rng: random.Random) -> None:
    found = plan.read_experiment(path)
    assert all(run.folder and run.title for run in found.runs)


def _scenarios() -> list[str]:
    genome = genome_for(_COURT)
    whole = decode(genome.nominal, genome, map="court", seed=1)
    return [scenarios.dumps(whole, _COURT), scenarios.dumps(whole.without("person-1"), _COURT)]


def _load_scenario(path: Path, rng: random.Random) -> None:
    found = scenarios.load(path)
    map = maps.load_map(found.map)
    assert scenarios.loads(scenarios.dumps(found, map), map) == found


def _weights(folder: Path, *, stamp: bool = True) -> Path:
    path = folder / "mine.npz"
    for suffix in (".npz", ".json"):
        shutil.copy(WEIGHTS / f"dqn{suffix}", path.with_suffix(suffix))
    return path


def _prepare_weights(folder: Path, rng: random.Random) -> Path:
    path = _weights(folder)
    path.write_bytes(binary_mutations.archive_changed(path.read_bytes(), rng))
    manifest = json.loads(path.with_suffix(".json").read_text())
    manifest["sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
    path.with_suffix(".json").write_text(json.dumps(manifest))
    return path


def _prepare_manifest(folder: Path, rng: random.Random) -> Path:
    path = _weights(folder).with_suffix(".json")
    changed = mutations.json_text_changed(path.read_text(), rng)
    path.write_bytes(changed.encode("utf-8", "surrogatepass"))
    return path


def _load_weights(path: Path, rng: random.Random) -> None:
    network._load.cache_clear()
    spec = network.learned_spec(str(path.with_suffix(".npz")))
    spec.make()


def _prepare_record(folder: Path, rng: random.Random) -> Path:
    path = folder / "flight.npz"
    if not hasattr(_prepare_record, "sample"):
        job, flight = job_of(Good, folder), FlightId(search="flight", map="lawn")
        fly_job(job, scenario(0.05), flight, None)
        vars(_prepare_record)["sample"] = job.record(flight).read_bytes()
        job.record(flight).unlink()
    content: bytes = vars(_prepare_record)["sample"]
    if rng.random() < 0.5:
        path.write_bytes(binary_mutations.archive_changed(content, rng))
        return path
    with np.load(io.BytesIO(content)) as saved:
        arrays: dict[str, Any] = dict(saved)
    header = mutations.json_text_changed(arrays["header"].tobytes().decode(), rng)
    arrays["header"] = np.frombuffer(header.encode("utf-8", "surrogatepass"), dtype=np.uint8)
    np.savez_compressed(path, **arrays)
    return path


def _load_record(path: Path, rng: random.Random) -> None:
    flight_file.hash_of(flight_file.load(path))


def _prepare_ledger(folder: Path, rng: random.Random) -> Path:
    path = folder / "ledger.sqlite"
    for suffix in ("", "-wal", "-shm"):
        path.with_name(path.name + suffix).unlink(missing_ok=True)
    if not hasattr(_prepare_ledger, "sample"):
        _write_ledger(path)
        vars(_prepare_ledger)["sample"] = path.read_bytes()
    path.write_bytes(vars(_prepare_ledger)["sample"])
    binary_mutations.database_changed(path, rng)
    return path


def _write_ledger(path: Path) -> None:
    job = job_of(Good, path.parent)
    ledger = Ledger.create(path, _RUN)
    ledger.add_search("s", "tests.execution.flying:Good", "lawn", 8, baseline_samples.job().dumps())
    ledger.add_slots("s", 0, {slot: _dumped(slot) for slot in range(8)})
    for _ in range(6):
        claim = ledger.queue.claim()
        assert claim is not None
        ledger.queue.record(
            claim, *fly_job(job, parse_scenario(claim.scenario), claim.flight, None)
        )
    ledger.note_objectives("s", 0, [(0.5, 1.0)] * 8)
    ledger.database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    ledger.close()


def _dumped(slot: int) -> str:
    from pytest_garl.scenarios.files import dump_scenario

    return dump_scenario(scenario(0.02 * slot))


def _load_ledger(path: Path, rng: random.Random) -> None:
    kind = rng.randrange(3)
    if kind == 0:
        baseline.dump_baseline(record.baseline_from_ledger(path))
        return
    ledger = Ledger.resume(path, _RUN) if kind == 1 else Ledger(path)
    try:
        check_stored(ledger)
        _use(ledger)
    finally:
        ledger.close()


def _use(ledger: Ledger) -> None:
    """Do what a resumed search, a repeated slot and the summary do."""
    for search, job in ledger.searches():
        parse_job(job)
        for text, result in ledger.generation(search, 0):
            parse_scenario(text)
            if result is not None:
                violation_proximity(result)
        ledger.queries.flights(search)
    ledger.queries.flights()
    ledger.queries.progress()
    ledger.queries.violation_counts()
    ledger.queries.nearest()
    ledger.queries.violating()
    ledger.queries.result_hash()
    ledger.queries.meters()
    ledger.queries.seconds_per_flight()
    ledger.queries.scenarios(0, 1, "lawn")


def _prepare_archive(folder: Path, rng: random.Random) -> Path:
    path, genome = folder / "night.archive", genome_for(_COURT)
    whole = decode(genome.nominal, genome, map="court", seed=1)
    flight = archives.ArchivedFlight(scenario=dump_scenario(whole), result=flight_result("I:a"))
    search = archives.ArchivedSearch(
        search="a", system="m:C", map="court", flown_by="b", flights=(flight,)
    )
    content = archives.Archive(searches=(search,)).text
    if rng.random() < 0.3:
        path.write_bytes(mutations.bytes_changed(gzip.compress(content.encode()), rng))
    else:
        changed = mutations.text_changed(content, rng).encode(errors="surrogatepass")
        path.write_bytes(gzip.compress(changed))
    return path


def _load_archive(path: Path, rng: random.Random) -> None:
    found, genome = archives.read_archive(path), genome_for(_COURT)
    for name in ("a", "c"):
        own = found.knowledge(name, "b", genome, _COURT)
        plan = SearchPlan(
            map=_COURT,
            genome=genome,
            seed=0,
            flights=12,
            population=4,
            known=own.known,
            suspects=own.suspects,
        )
        method = Garl(plan)
        method.tell([FlownScenario(scenario=e, result=flight_result()) for e in method.ask()])
        method.ask()


LOADERS = {
    "case": Loader(prepare=_text_file("cases/flying/one.toml", _cases), load=_load_case),
    "map": Loader(
        prepare=_text_file(
            "mine.toml",
            lambda: [
                (Path(maps.__file__).parent / f"{name}.toml").read_text()
                for name in ("court", "lawn")
            ],
        ),
        load=_load_map,
    ),
    "baseline": Loader(
        prepare=_text_file(
            "base.toml", lambda: [baseline.dump_baseline(baseline_samples.baseline())]
        ),
        load=_load_baseline,
    ),
    "experiment": Loader(prepare=_text_file("plan.toml", lambda: [PLAN]), load=_load_plan),
    "scenario": Loader(prepare=_text_file("one.toml", _scenarios), load=_load_scenario),
    "weights": Loader(prepare=_prepare_weights, load=_load_weights),
    "manifest": Loader(prepare=_prepare_manifest, load=_load_weights),
    "record": Loader(prepare=_prepare_record, load=_load_record),
    "ledger": Loader(prepare=_prepare_ledger, load=_load_ledger),
    "archive": Loader(prepare=_prepare_archive, load=_load_archive),
}
