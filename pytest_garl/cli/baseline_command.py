"""``garl baseline`` saves verdicts of a landing system; ``garl diff`` compares two checkouts."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.progress import track
from rich.table import Table
from rich.text import Text

from pytest_garl.errors import OptionError
from pytest_garl.messages import command
from pytest_garl.scenarios.domains.names import DEFAULT_DOMAIN
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS

if TYPE_CHECKING:
    from pytest_garl.execution.flight_id import CompletedFlight
    from pytest_garl.execution.reference import Reference
    from pytest_garl.gate.baseline_file import BaselineSet
    from pytest_garl.gate.comparison import Comparison
    from pytest_garl.gate.record import BaselineSpec

IN_PAPER = "waypoint"
"""The NPC policy of a baseline in the world of the paper: nobody pursues the UAV."""
FAILED = 1
"""Exit status of a comparison that fails; a usage error is 2."""
COLOURS = {"broke": "red", "fixed": "green", "changed": "yellow"}
_FOLDER = click.Path(path_type=Path, file_okay=False, exists=True)
_FILE = click.Path(path_type=Path, dir_okay=False)

_SPEC_OPTIONS = (
    click.option(
        "--system",
        "systems",
        metavar="MODULE:CLASS",
        multiple=True,
        help="The landing system; may be given several times.",
    ),
    click.option(
        "--maps",
        default="court,lawn",
        show_default=True,
        help="Maps to fly on, separated by commas.",
    ),
    click.option(
        "--count",
        type=click.IntRange(min=1),
        default=100,
        show_default=True,
        help="Scenarios per map. A worse rate fails only if at least five of them broke.",
    ),
    click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True),
    click.option(
        "--domain",
        metavar="NAME|FILE",
        show_default=DEFAULT_DOMAIN,
        help="Conditions that the scenarios are drawn from, as for --garl-domain.",
    ),
    click.option(
        "--npcs",
        default="",
        help="NPC policy, which moves people, dogs and birds, as for --garl-npcs.  [default: as "
        "the domain says; in the domain paper, waypoint]",
    ),
    click.option(
        "--distance-m",
        type=float,
        default=DEFAULT_LIMITS.distance_m,
        show_default=True,
        help="Largest allowed distance of a landing from the marker.",
    ),
    click.option(
        "--time-s",
        type=float,
        default=DEFAULT_LIMITS.time_s,
        show_default=True,
        help="Longest allowed time of a landing.",
    ),
    click.option(
        "--abort",
        type=click.Choice(["needless", "ok", "violation"]),
        default="needless",
        show_default=True,
        help="When a landing that is given up is a violation: unless nobody could have landed "
        "(needless), never (ok), always (violation).",
    ),
    click.option(
        "--simulator",
        metavar="MODULE:FUNCTION",
        default="",
        help="The function that your hook pytest_garl_fly returns (default: the built-in "
        "simulator).",
    ),
    click.option(
        "--workers",
        type=click.IntRange(min=1),
        default=lambda: os.cpu_count() or 1,
        show_default="one per CPU core",
        help="Number of worker processes.",
    ),
)


def _spec_options(command: Callable[..., Any]) -> Callable[..., Any]:
    for option in reversed(_SPEC_OPTIONS):
        command = option(command)
    return command


@click.group()
def baseline() -> None:
    """Save today's verdicts for the gate.

    pytest --garl-baseline=FILE flies the same scenarios later, and fails if the system is worse.
    """


@baseline.command()
@_spec_options
@click.option(
    "--from-ledger",
    "ledger",
    type=_FILE,
    help="Fly nothing: keep the scenarios of a finished search, such as .garl/ledger.sqlite.",
)
@click.option("--out", type=_FILE, required=True, help="The file to write; commit it.")
def save(
    ledger: Path | None, out: Path, workers: int, systems: tuple[str, ...], **chosen: Any
) -> None:
    """Fly random scenarios and save their verdicts.

    Run it where you run pytest. The same options choose the same scenarios for every system.
    """
    from pytest_garl.execution.checkout import Checkout
    from pytest_garl.gate.baseline_file import save_baseline
    from pytest_garl.gate.record import baseline_from_ledger, fly_baseline

    if ledger is not None:
        recorded = baseline_from_ledger(ledger)
    elif not systems:
        raise OptionError(
            "garl baseline save: found neither --system nor --from-ledger, expected one of them, "
            "such as --system landing_systems.mm_mls:MultiModuleLandingSystem"
        )
    else:
        checkout = Checkout(folder=Path.cwd())
        recorded = fly_baseline(_spec(**chosen), checkout, systems, workers, _progress)
    save_baseline(out, recorded)
    for each in recorded.sets:
        _show_set(each)
    click.echo(f"saved {out}; compare with it: {command('pytest', f'--garl-baseline={out}')}")


@baseline.command()
@click.argument("file", type=click.Path(path_type=Path, exists=True, dir_okay=False))
def show(file: Path) -> None:
    """Print how the flights of a baseline ended.

    Those that landed come first, then what went wrong.
    """
    from pytest_garl.gate.baseline_file import load_baseline

    for each in load_baseline(file, (_maps_folder(),)).sets:
        _show_set(each)


@baseline.command()
@click.argument("file", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.argument("name")
def scenario(file: Path, name: str) -> None:
    """Print one scenario of a baseline.

    The scenario, such as court-17, is a file for pytest --garl-repeat.
    """
    from pytest_garl.gate.baseline_file import load_baseline
    from pytest_garl.scenarios.files import dumps
    from pytest_garl.scenarios.maps.loading import load_map

    for each in load_baseline(file, (_maps_folder(),)).sets:
        for index, flight in enumerate(each.flights):
            if each.scenario_name(index) == name:
                click.echo(f"# {name} of {file}; the NPC policy was {each.npcs}")
                map = load_map(each.map, (_maps_folder(),))
                click.echo(dumps(flight.scenario, map), nl=False)
                return
    raise OptionError(f"{file}: found no scenario {name!r}, expected a name such as court-0")


@click.command()
@click.argument("base", type=_FOLDER)
@click.argument("head", type=_FOLDER)
@_spec_options
@click.option(
    "--level",
    type=click.FloatRange(min=0, max=1, min_open=True, max_open=True),
    default=0.05,
    show_default=True,
    help="False-alarm rate per map: how often HEAD may fail although it is no worse.",
)
def diff(
    base: Path,
    head: Path,
    level: float,
    workers: int,
    systems: tuple[str, ...],
    **chosen: Any,
) -> None:
    """Compare two checkouts in the same scenarios.

    BASE and HEAD are folders, such as two git worktrees. The exit status is 1 if HEAD has a new
    type of violation, significantly more violations or aborts, landings that are significantly
    less accurate or slower, or an inconclusive flight. Both
    use the simulator and the NPC policies of this installation, and the maps of this folder.
    """
    from pytest_garl.execution.checkout import Checkout
    from pytest_garl.gate.gate import compare_sets
    from pytest_garl.gate.record import fly_baseline, neighbour_flyer
    from pytest_garl.scenarios.maps.loading import load_map

    if not systems:
        raise OptionError(
            "garl diff: --system is missing; expected MODULE:CLASS of the landing system"
        )
    spec = _spec(**chosen)
    checkouts = [
        Checkout(folder=one, others=(other,)) for one, other in ((base, head), (head, base))
    ]
    before, after = (fly_baseline(spec, each, systems, workers, _progress) for each in checkouts)
    passed = True
    for old, new in zip(before.sets, after.sets, strict=True):
        map = load_map(old.map, spec.map_folders)
        fly = neighbour_flyer(spec, checkouts[1], new, workers, _progress)
        found = compare_sets(old, new, map, fly, level=level)
        passed = passed and found.passed
        _show(old.title, found)
    if not passed:
        raise SystemExit(FAILED)


def _spec(
    *,
    maps: str,
    distance_m: float,
    time_s: float,
    abort: Any,
    simulator: str,
    domain: str | None,
    npcs: str,
    **rest: Any,
) -> BaselineSpec:
    from pytest_garl.gate.record import BaselineSpec
    from pytest_garl.npcs.domain_policy import domain_with_policy, policy_in
    from pytest_garl.verdicts.verdict import Limits

    names = tuple(dict.fromkeys(part.strip() for part in maps.split(",") if part.strip()))
    if not names:
        raise OptionError(f"--maps: found {maps!r}, expected names such as court,lawn")
    conditions = domain_with_policy(domain or DEFAULT_DOMAIN)
    return BaselineSpec(
        maps=names,
        domain=conditions,
        npcs=npcs or policy_in(conditions, IN_PAPER),
        limits=Limits(distance_m=distance_m, time_s=time_s, abort=abort),
        simulator=_simulator(simulator),
        map_folders=(_maps_folder(),),
        **rest,
    )


def _simulator(text: str) -> Reference:
    from pytest_garl.execution.reference import BUILT_IN, Reference

    if not text:
        return BUILT_IN
    module, _, name = text.partition(":")
    if not module or not name:
        raise OptionError(f"--simulator: found {text!r}, expected MODULE:FUNCTION")
    return Reference(module=module, file="", qualname=name)


def _maps_folder() -> Path:
    return Path.cwd() / "scenarios" / "maps"


def _progress(
    flights: Iterator[CompletedFlight], title: str, total: int
) -> Iterable[CompletedFlight]:
    """Show the progress of flights on a terminal; on stderr, because the result goes to stdout."""
    console = Console(stderr=True)
    hidden = not console.is_terminal
    return track(flights, title, total, console=console, disable=hidden, transient=True)


def _show_set(each: BaselineSet) -> None:
    from pytest_garl.gate.comparison_text import column_lines, size_lines
    from pytest_garl.verdicts.wording import limits_text

    flights = [flight.summary for flight in each.flights]
    inconclusive = sum(not flight.decided for flight in flights)
    left_out = f", {inconclusive} inconclusive, which the gate leaves out" if inconclusive else ""
    conditions = f"limits {limits_text(each.limits)}; NPCs {each.npcs}"
    click.echo(f"{each.title}: {len(flights)} flown{left_out}; {conditions}")
    for line in (*column_lines(("", flights)), *size_lines(flights)):
        click.echo(f"    {line}")
    if each.warning:
        click.echo(f"    note: {each.warning}")


def _show(title: str, found: Comparison) -> None:
    from pytest_garl.gate.comparison_text import summary_lines
    from pytest_garl.gate.pairs import DIFFERENT_RESULTS

    table = Table(box=None, header_style="bold")
    for name in ("scenario", "", "base", "head"):
        table.add_column(name, overflow="fold")
    for result in DIFFERENT_RESULTS:
        for pair in found.with_result(result):
            # As Text: rich would replace ":dog:" in a string by an emoji.
            cells = (pair.name, result, pair.base.text, pair.head.text)
            table.add_row(*(Text(cell) for cell in cells), style=COLOURS[result])
    console = Console()
    if table.row_count:
        console.print(table)
    verdict, *details = summary_lines(found)
    click.secho(f"{title}: {verdict}", bold=True, fg="green" if found.passed else "red")
    for line in details:
        click.echo(f"    {line}")
