"""The command-line options and ini keys as pytest learns of them.

Every pytest run imports this module, so it imports and defines as little as it can; what the
values mean is read in ``options.py`` once there is something to fly.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pytest_garl.plugin.collection import Target

RUN = pytest.StashKey[Any]()
"""Where a session keeps its run; none if nothing is to be flown."""
LANDING = pytest.StashKey[Any]()
"""Where an item keeps the landing that it asked for."""
BEGUN = pytest.StashKey[bool]()
"""Where an item keeps whether the test's body runs."""
FATAL = "garl.fatal"
"""The user property by which an xdist worker tells the controller that the run cannot go on."""
OWN = "garl.own"
"""The user property by which it tells of a test that failed in an assertion of its own."""
FOUND = "garl.found"
"""The user property by which it tells that a test failed for a search's violation."""
TALLY = pytest.StashKey[Any]()
"""Where a session that is no xdist worker keeps what its items say."""
SLOT = "garl.slot"
"""The user property that names the slot of an item."""
NOTHING = "garl.nothing"
"""The user property of an item that has nothing to fly, with the reason."""
FAILURE = "garl.failure"
"""The user property that names what a failing item tells of."""
EXCUSED = "garl.excused"
"""The user property of an item that is excused, with what another item tells of."""
UNREPEATED = "garl.unrepeated"
"""The user property of a violation that did not show when it was flown again."""
METHODS = ("garl", "garl-paper", "ga", "offline-rl", "online-rl", "random", "surrogate-random")
POLICIES = (
    "dqn",
    "dqn-paper",
    "online-rl",
    "greedy",
    "stand",
    "destination",
    "waypoint",
    "random_walk",
    "stationary",
)
Option = namedtuple("Option", ["name", "metavar", "help", "default"], defaults=[""])
"""One option: its name without ``garl-``, default, and what ``--help`` says."""

OPTIONS = (
    Option(
        name="budget",
        metavar="N",
        help="Search: fly N scenarios per landing system and map. Without it only saved cases "
        "are flown, and all other tests of landings are skipped.",
    ),
    Option(
        name="seed",
        metavar="SEED",
        default="0",
        help="Seed of the search: a whole number, or 'random' to draw one, which the header "
        "prints. The same seed gives the same results (default: 0).",
    ),
    Option(
        name="method",
        metavar="METHOD",
        default="garl",
        help=f"How scenarios are proposed: {', '.join(METHODS)}, or a search of your own as "
        "module:factory (default: garl).",
    ),
    Option(
        name="population",
        metavar="N",
        help="Scenarios that are bred at a time (default: a tenth of the budget, 8 to 20).",
    ),
    Option(
        name="map",
        metavar="MAPS",
        help="Fly only on these maps of the tests, separated by commas, such as court,lawn "
        "(default: all).",
    ),
    Option(
        name="workers",
        metavar="N",
        help="Fly in N child processes, whatever the -n of pytest-xdist; 0 flies inside pytest, "
        "for a debugger (default: one per CPU core, with a Ray cluster one per CPU of it).",
    ),
    Option(
        name="pool",
        metavar="WHERE",
        default="local",
        help="Where flights are flown: 'local' in child processes, 'ray' on the Ray cluster of "
        "RAY_ADDRESS or, if that is not set, on one that is started here and ends with the run; "
        "'ray' needs pytest-garl[ray]. The results are the same (default: local).",
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
        help="Wall-clock seconds that one call of the landing system may take; a call that takes "
        "longer counts as hung (default: 10).",
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
        help="How to report a test that fails in the same assertion and for the same signature "
        "as an earlier slot of the search: 'xfail' or 'fail' (default: xfail).",
    ),
    Option(
        name="shrink",
        metavar="N",
        help="Flights to confirm, shrink and save each new kind of violation that a search found: "
        "8 or more; a Python exception or a hang takes 2. With 0 nothing is confirmed, shrunk or "
        "saved (default: 12, but for all kinds together no more than the search itself).",
    ),
    Option(
        name="baseline",
        metavar="FILE",
        help="Gate: fly the scenarios of a file that `garl baseline save` wrote, and fail on a new "
        "type of violation, significantly more violations or aborts, or an inconclusive flight.",
    ),
    Option(
        name="level",
        metavar="P",
        default="0.05",
        help="How often the gate may fail a landing system that is no worse than the baseline, per "
        "map: a share between 0 and 1 (default: 0.05).",
    ),
    Option(
        name="npcs",
        metavar="POLICY",
        help=f"Who moves people, dogs and birds: {', '.join(POLICIES)}, or weights (.npz) that "
        "`garl train` wrote (default: dqn; dqn-paper for the methods garl-paper and "
        "surrogate-random, online-rl for online-rl, waypoint for random, destination for ga and "
        "offline-rl; for --garl-repeat those of the search).",
    ),
)


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
        help="Continue the interrupted run in the ledger. Options, landing system and versions "
        "must be as they were.",
    )
    parser.addini("garl_dir", help="Folder of the ledger and the flights.", default=".garl")
    parser.addini("garl_cases", help="Folder of the saved cases.", default="scenarios/regressions")
    parser.addini(
        "garl_xfail_strict",
        help="Whether a saved case that is open and passes fails the run.",
        type="bool",
        default=False,
    )


def asked(config: pytest.Config) -> bool:
    """Whether the command line or the configuration says anything about flying."""
    names = [option.name for option in OPTIONS]
    if config.getoption("--garl-resume"):
        return True
    return any(config.getoption(f"--garl-{name}") is not None for name in names) or any(
        config.getini(f"garl_{name}") for name in ("budget", "repeat", "baseline")
    )


def computes(config: pytest.Config) -> bool:
    """Whether this process breeds or flies, as far as it can be told before conftest.py is read."""
    given = config.known_args_namespace
    return (
        any(getattr(given, f"garl_{option.name}", None) is not None for option in OPTIONS)
        or any(config.getini(f"garl_{name}") for name in ("budget", "repeat", "baseline"))
        or config.getini("garl_workers") == "0"
    )


def flies(item: pytest.Item) -> bool:
    """Whether an item needs a run: a landing test, or a gate against a baseline."""
    return target_of(item) is not None or hasattr(item, "garl_gate")


def target_of(item: pytest.Item) -> Target | None:
    """Return what an item tests, or None for an item that is not ours."""
    callspec = getattr(item, "callspec", None)
    target = callspec.params.get("garl_slot") if callspec else None
    # Where there is nothing to fly the parameter is the reason, a string.
    return None if isinstance(target, str) else target


def name_slots(items: Iterable[pytest.Item]) -> None:
    """Let the reports of landing tests tell what they test, whether or not it is flown."""
    for item in items:
        callspec: Any = getattr(item, "callspec", None)
        slot = callspec.params.get("garl_slot") if callspec else None
        if isinstance(slot, str):
            item.user_properties += [(SLOT, ""), (NOTHING, slot)]
        elif slot is not None:
            item.user_properties.append((SLOT, slot.name))
