"""``garl check``: fly a landing system before a search does, and name its faults."""

from __future__ import annotations

import faulthandler
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pytest_garl.errors import LandingSystemError
from pytest_garl.messages import python_that_lacks

if TYPE_CHECKING:
    from pytest_garl.program import AnySystem
    from pytest_garl.testing import CheckPlan

LIMIT_S = 1800.0
"""The command ends after this wall time in any case, with a traceback."""
DEFAULT_MAP = "lawn"


@click.command()
@click.argument("targets", metavar="TEST_FILE|MODULE:CLASS", nargs=-1, required=True)
@click.option(
    "--map",
    "maps",
    multiple=True,
    help="Map to fly on; may be given several times.  [default: the maps of the test, or lawn]",
)
@click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    help="End each flight after this simulated time.  [default: when it landed, or 120]",
)
@click.option(
    "--no-probes",
    is_flag=True,
    help="Do not fly the probes: no marker, others beside it, a marker that goes, and so on.",
)
@click.option(
    "--nondeterministic",
    is_flag=True,
    help="Only warn if equal flights differ (as deterministic=False in the marker).",
)
def check(
    targets: tuple[str, ...],
    maps: tuple[str, ...],
    seconds: float | None,
    no_probes: bool,
    nondeterministic: bool,
) -> None:
    """Fly clear air, then one cause at a time; name faults.

    Of a test file, such as test_my_landing.py, also with ::test_name, it takes landing system,
    marker, start, domain, limits and maps. A class, such as my_landing:MyLandingSystem, is flown
    from the ground to the marker of the map.

    It flies two scenarios, and the first one again. If it lands in clear air, it flies the probes
    on one map: scenarios with one cause each, such as no marker at all. Run it where you run
    pytest. The exit status is 1 if there is a fault that a search would meet in every flight, as if
    it does not land in clear air, or if a probe violates. Warnings name other problems of a search.
    """
    from pytest_garl.execution.exit_guard import refusing_end
    from pytest_garl.testing import check_as_planned

    # A module that ends this process when it is imported would end it as if all were well.
    with refusing_end(" ".join(targets)):
        planned = [each for target in targets for each in _planned(target, maps)]
    probed = [] if no_probes else _probed(planned)
    passed = True
    warned: dict[AnySystem, set[str]] = {}
    # Nothing else interrupts a call that hangs in C code and holds the interpreter.
    faulthandler.dump_traceback_later(LIMIT_S, exit=True, file=sys.__stderr__ or 2)
    try:
        for system, plan in planned:
            deterministic = plan.deterministic and not nondeterministic
            wanted = (system, plan) in probed
            flown = replace(plan, seconds=seconds, deterministic=deterministic, probes=wanted)
            result = check_as_planned(system, flown)
            # The same problem on another map is no other one.
            known = warned.setdefault(system, set())
            new = tuple(text for text in result.warnings if text not in known)
            known.update(new)
            click.echo(replace(result, warnings=new))
            passed &= result.passed
    finally:
        faulthandler.cancel_dump_traceback_later()
    if not passed:
        raise SystemExit(1)


def _probed(planned: list[tuple[AnySystem, CheckPlan]]) -> list[tuple[AnySystem, CheckPlan]]:
    """Return what flies the probes: each landing system with each task, on one of its maps."""
    from pytest_garl.search.probes import probed_map

    found = []
    for system, plan in planned:
        alike = [
            other
            for each, other in planned
            if each is system and replace(other, map=plan.map) == plan
        ]
        first = probed_map([each.map for each in alike])
        if plan.map == first:
            found.append((system, plan))
    return found


def _planned(target: str, maps: tuple[str, ...]) -> Iterator[tuple[AnySystem, CheckPlan]]:
    """Yield what is to be flown for a test file or a class."""
    file = Path(target.partition("::")[0])
    if file.exists() or file.suffix == ".py" or "::" in target:
        yield from _planned_for_tests(target, maps)
        return
    from pytest_garl.testing import plan_for

    system = imported_system(target)
    for name in maps or (DEFAULT_MAP,):
        yield system, plan_for(map=name)


def _planned_for_tests(target: str, maps: tuple[str, ...]) -> Iterator[tuple[AnySystem, CheckPlan]]:
    """Yield what the tests in a file fly; several tests of one landing system fly it once."""
    from pytest_garl.plugin.items.tests_of_file import targets_of
    from pytest_garl.scenarios.maps.loading import load_map
    from pytest_garl.testing import CheckPlan

    flown: list[tuple[AnySystem, CheckPlan]] = []
    for found, folders in targets_of(target):
        if maps and found.map not in maps:
            continue
        plan = CheckPlan(
            map=load_map(found.map, folders),
            task=found.task,
            domain=found.domain,
            limits=found.limits,
            deterministic=found.deterministic,
        )
        if (found.system, plan) not in flown:
            flown.append((found.system, plan))
    if not flown:
        raise LandingSystemError(
            f"{target}: its tests do not fly on {', '.join(maps)}; give a map that their markers "
            "name"
        )
    yield from flown


def imported_system(name: str) -> AnySystem:
    """Return a landing system, a class or a program, imported as from the current folder.

    Raises LandingSystemError if there is none of this name.
    """
    if str(Path.cwd()) not in sys.path:
        sys.path.insert(0, str(Path.cwd()))
    from pytest_garl.execution.reference import system_named

    try:
        system: AnySystem = system_named(name)
    except LandingSystemError as error:
        python = python_that_lacks(str(error))
        raise LandingSystemError(
            f"{name!r}: cannot be imported as a landing system ({error}){python}; "
            "expected MODULE:CLASS, as my_landing:MyLandingSystem, found from the current folder, "
            "or a test file"
        ) from error
    return system
