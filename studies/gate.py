"""The gate of saved cases: its time, and whether its results repeat.

``python -m studies.gate`` makes thirty cases from the committed ones and their neighbours, some of
them with the status fixed.  pytest flies them twenty times, and the study compares outcomes and
trajectories.  Then it flies one case three hundred times and counts the distinct hashes.
``python -m studies.gate rates`` simulates the gate against a baseline: see ``gate_rates``, and
``python -m studies.gate landings`` keeps the landings that it draws from: see ``gate_landings``.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from xml.etree import ElementTree

from pytest_garl import cpu_dispatch
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.case_file import dump_case, load_case
from pytest_garl.regressions.replay import replay
from pytest_garl.regressions.robustness import neighbours
from pytest_garl.scenarios.maps.loading import load_map

CASES = Path("scenarios/regressions")
COUNT = 30
OUTCOMES = ("skipped", "failure", "error")
ItemResult = tuple[str, str]
"""The outcome of an item and the hash of its flight, which may be empty."""


def mixed(found: list[Case]) -> Iterator[Case]:
    """Yield cases of all systems, each with a neighbour; every second neighbour is called fixed.

    A case called fixed fails here: failures must repeat as exactly as passes.
    """
    for index, case in enumerate(sorted(found, key=lambda each: each.id)):
        yield case
        beside = neighbours(case.scenario, load_map(case.scenario.map))[0]
        status = "fixed" if index % 2 else case.status
        yield dataclasses.replace(case, scenario=beside, status=status)


def gate(cases: Path, folder: Path) -> tuple[float, dict[str, ItemResult]]:
    """Fly all cases as pytest items; return the wall time, and each one's outcome and hash."""
    folder.mkdir()
    options = ("-q", "-p", "no:cacheprovider", "--tb=no", f"--junitxml={folder / 'junit.xml'}")
    ini = ("-o", f"garl_cases={cases}", "-o", f"garl_dir={folder / 'garl'}")
    began = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options, *ini, "landing_systems"],
        stdout=subprocess.DEVNULL,
        check=False,
    )
    took = time.perf_counter() - began
    if done.returncode not in (0, 1):
        sys.exit(f"pytest ended with {done.returncode}")
    items = ElementTree.parse(folder / "junit.xml").iter("testcase")
    flown = {f"{each.get('classname')}.{each.get('name')}": _item_result(each) for each in items}
    return took, {name: result for name, result in flown.items() if "[case-" in name}


def _item_result(item: ElementTree.Element) -> ItemResult:
    """Return the result of an item in the JUnit file."""
    outcome = next((each.get("type", each.tag) for each in item if each.tag in OUTCOMES), "passed")
    values = {each.get("name"): each.get("value", "") for each in item.iter("property")}
    return outcome, values.get("garl.trajectory_sha256", "")


def hash_of_flight(path: Path) -> str:
    """Fly a case once and return the trajectory's hash."""
    import cv2

    cv2.setNumThreads(1)
    flight = replay(dataclasses.replace(load_case(path), test=""), Path.cwd()).flight
    assert flight is not None
    return flight.sha256


def main() -> None:
    """Print times and the numbers of different results and flights; or write the rates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="?", choices=("cases", "rates", "landings"), default="cases")
    parser.add_argument("--draws", type=int, default=4000, help="Of each false alarm's rate.")
    parser.add_argument("--baseline", type=Path, help="The baseline whose landings are kept.")
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--replays", type=int, default=300)
    arguments = parser.parse_args()
    if arguments.what == "landings":
        from studies.gate_landings import write_landings
        from studies.gate_rates import LANDINGS

        if arguments.baseline is None:
            parser.error("landings: --baseline is missing; expected a file of garl baseline save")
        return write_landings(arguments.baseline, LANDINGS)
    if arguments.what == "rates":
        from studies.gate_page import write

        return write(arguments.draws)
    return _cases(arguments.runs, arguments.replays)


def _cases(runs: int, replays: int) -> None:
    paths = sorted(CASES.rglob("*.toml"))
    if not paths:
        sys.exit(f"found no cases in {CASES}, expected some; a search saves its violations there")
    with tempfile.TemporaryDirectory() as name:
        cases = Path(name, "cases")
        for case in itertools.islice(mixed([load_case(path) for path in paths]), COUNT):
            file = cases / case.system.partition(":")[0].rpartition(".")[2] / f"{case.id}.toml"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(dump_case(case))
        count = sum(1 for _ in cases.rglob("*.toml"))
        gates = [gate(cases, Path(name, f"run-{run}")) for run in range(runs)]
    times = [took for took, _ in gates]
    outcomes = Counter(outcome for outcome, _ in gates[0][1].values())
    hashes = {sha256 for _, sha256 in gates[0][1].values()} - {""}
    results = {tuple(sorted(items.items())) for _, items in gates}
    print(f"{count} cases, {runs} runs: {len(results)} result(s), {len(hashes)} flights")
    print(f"  {dict(outcomes)}; {statistics.median(times):.0f} s (most {max(times):.0f} s)")
    cpu_dispatch.pin()
    with ProcessPoolExecutor() as pool:
        again = Counter(pool.map(hash_of_flight, [paths[0]] * replays))
    print(f"{paths[0].name}: {replays} flights, {len(again)} hash(es)")


if __name__ == "__main__":
    main()
