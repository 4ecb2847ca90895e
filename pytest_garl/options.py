"""Every command-line option and ini key, validated once into one frozen object."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import pytest

if TYPE_CHECKING:
    from pytest_garl.run import Target
    from pytest_garl.scenarios.genes import WeatherRange

RUN = pytest.StashKey[Any]()
"""Where a session keeps its run; none if nothing is to be flown."""
FATAL = "garl.fatal"
"""The user property by which an xdist worker tells the controller that the run cannot go on."""
METHODS = ("garl", "garl-paper", "random")
POLICIES = ("waypoint", "random_walk", "stationary")
SLOT_ID = re.compile(r"(?P<map>.+)-g(?P<generation>\d{2,})-s(?P<slot>\d{2,})")


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """One option: its name without ``garl-``, default, and what ``--help`` says."""

    name: str
    metavar: str
    help: str
    default: str = ""


OPTIONS = (
    Option(
        name="budget",
        metavar="N",
        help="Search: fly N scenarios per landing system and map. Without it only committed "
        "cases are flown, and other tests of landings are skipped.",
    ),
    Option(
        name="seed",
        metavar="SEED",
        default="0",
        help="Seed of the search; the same seed finds the same. A whole number, or 'random' to "
        "draw one, which the header prints (default: 0).",
    ),
    Option(
        name="method",
        metavar="METHOD",
        default="garl",
        help=f"How scenarios are proposed: {', '.join(METHODS)} (default: garl).",
    ),
    Option(
        name="population",
        metavar="N",
        help="Scenarios that are bred at a time (default: a tenth of the budget, 8 to 20).",
    ),
    Option(
        name="map",
        metavar="MAPS",
        help="Fly only on these of the tests' maps, separated by commas, such as court,lawn "
        "(default: all).",
    ),
    Option(
        name="workers",
        metavar="N",
        help="Fly in N child processes, whatever the -n of pytest-xdist; 0 flies inside pytest, "
        "for a debugger (default: one per CPU core).",
    ),
    Option(
        name="weather",
        metavar="RANGE",
        default="confined",
        help="How bad the weather may get: 'confined' keeps its genes in [0, 0.15], 'full' lets "
        "them reach 1 (default: confined).",
    ),
    Option(
        name="timeout",
        metavar="SECONDS",
        default="10",
        help="Wall-clock time that one call of the landing system may take; beyond that it "
        "counts as hung (default: 10).",
    ),
    Option(
        name="repeat",
        metavar="SLOT|FILE",
        help="Fly one scenario again instead of searching: a slot of the last run, such as "
        "court-g03-s17, or a scenario file.",
    ),
    Option(
        name="duplicates",
        metavar="HOW",
        default="xfail",
        help="Report further violations with a signature already found in the same search as "
        "'xfail' or as 'fail' (default: xfail).",
    ),
    Option(
        name="npcs",
        metavar="POLICY",
        default="waypoint",
        help=f"Who moves people, dogs and birds: {', '.join(POLICIES)} (default: waypoint).",
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What the user wants, checked."""

    budget: int
    seed: int
    method: str
    population: int
    resume: bool
    maps: tuple[str, ...]
    workers: int
    weather: WeatherRange
    timeout_s: float
    repeat: str
    duplicates: Literal["xfail", "fail"]
    npcs: str
    folder: Path
    root: Path

    @property
    def active(self) -> bool:
        """Whether anything will be flown."""
        return self.budget > 0 or bool(self.repeat)

    @property
    def map_folders(self) -> tuple[Path, ...]:
        """Where a user's own maps lie."""
        return (self.root / "scenarios" / "maps",)

    @property
    def ledger(self) -> Path:
        """The ledger of this run; repeating writes one of its own and keeps the search's."""
        return self.folder / ("repeat.sqlite" if self.repeat else "ledger.sqlite")


def add_options(parser: pytest.Parser) -> None:
    """Register all options and ini keys."""
    group = parser.getgroup("garl", "search for violations of landing systems (pytest-garl)")
    for option in OPTIONS:
        group.addoption(
            f"--garl-{option.name}", default=None, metavar=option.metavar, help=option.help
        )
        parser.addini(
            f"garl_{option.name}",
            help=f"Value of --garl-{option.name} where the command line gives none.",
            default=option.default,
        )
    group.addoption(
        "--garl-resume",
        action="store_true",
        help="Continue the interrupted run in the ledger; everything else must be as it was.",
    )
    parser.addini("garl_dir", help="Folder of the ledger and the flights.", default=".garl")


def read_options(config: pytest.Config) -> Options:
    """Return the options; raise UsageError that says what was found and what is expected."""
    text = {option.name: _value(config, option) for option in OPTIONS}
    budget = _integer("budget", text["budget"], 1) if text["budget"] else 0
    size = _integer("population", text["population"], 1) if text["population"] else 0
    return Options(
        budget=budget,
        population=min(size, budget) if size else _population(budget),
        resume=bool(config.getoption("--garl-resume")),
        seed=_seed(config, text["seed"]),
        method=_among("method", text["method"], METHODS),
        maps=tuple(part.strip() for part in text["map"].split(",") if part.strip()),
        workers=_integer("workers", text["workers"], 0) if text["workers"] else os.cpu_count() or 1,
        weather=cast("WeatherRange", _among("weather", text["weather"], ("confined", "full"))),
        timeout_s=_seconds(text["timeout"]),
        repeat=_repeat(text["repeat"]),
        duplicates=cast(
            Literal["xfail", "fail"], _among("duplicates", text["duplicates"], ("xfail", "fail"))
        ),
        npcs=_among("npcs", text["npcs"], POLICIES),
        folder=config.rootpath / str(config.getini("garl_dir")),
        root=config.rootpath,
    )


def target_of(item: pytest.Item) -> Target | None:
    """Return what an item tests, or None for an item that is not ours."""
    callspec = getattr(item, "callspec", None)
    target = callspec.params.get("garl_slot") if callspec else None
    # Where there is nothing to fly the parameter is the reason, a string.
    return None if isinstance(target, str) else target


def _value(config: pytest.Config, option: Option) -> str:
    given = config.getoption(f"--garl-{option.name}")
    return str(config.getini(f"garl_{option.name}") if given is None else given)


def _wrong(name: str, found: str, expected: str) -> pytest.UsageError:
    return pytest.UsageError(f"--garl-{name}: found {found!r}, expected {expected}")


def _integer(name: str, text: str, low: int) -> int:
    if not re.fullmatch(r"\d+", text) or int(text) < low:
        raise _wrong(name, text, f"a whole number of at least {low}")
    return int(text)


def _population(budget: int) -> int:
    if not budget:
        return 0
    from pytest_garl.search.slots import population

    return population(budget)


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 < value < 1e6:
        raise _wrong("timeout", text, "a positive number of seconds")
    return value


def _among(name: str, text: str, known: tuple[str, ...]) -> str:
    if text not in known:
        raise _wrong(name, text, f"one of {', '.join(known)}")
    return text


def _seed(config: pytest.Config, text: str) -> int:
    given: dict[str, Any] = getattr(config, "workerinput", {})
    if "garl_seed" in given:
        return int(given["garl_seed"])
    if text == "random":
        import secrets

        return secrets.randbelow(2**32)
    return _integer("seed", text, 0)


def _repeat(text: str) -> str:
    if text and not SLOT_ID.fullmatch(text) and not Path(text).is_file():
        raise _wrong("repeat", text, "a slot such as court-g03-s17, or an existing scenario file")
    return text
