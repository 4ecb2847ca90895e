"""The command-line options and ini keys as pytest learns of them.

Every pytest run imports this module, so it imports and defines as little as it can; what the
values mean is read in ``options.py`` once there is something to fly.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterable

import pytest

from pytest_garl.files.run_files import CASES_FOLDER, RUN_FOLDER
from pytest_garl.npcs.policy_catalogue import DEFAULT_POLICY, expected_policies
from pytest_garl.scenarios.domains.names import DEFAULT_DOMAIN
from pytest_garl.search.method_catalogue import DEFAULT_METHOD, method_names

Option = namedtuple("Option", ["name", "metavar", "help", "default"], defaults=[""])
"""One option: its name without ``garl-``, default, and what ``--help`` says."""

Key = namedtuple("Key", ["name", "help", "default", "type"], defaults=["", None])
"""A setting that only an ini key has: its name, what ``--help`` says, default, and type."""

GROUPS = {
    "garl: what is flown (pytest-garl searches for violations of landing systems)": (
        *("budget", "map", "domain", "npcs", "repeat"),
    ),
    "garl: how it searches": ("seed", "method", "population", "shrink"),
    "garl: how it flies": ("workers", "timeout", "resume"),
    "garl: gate and reports": ("baseline", "report", "film"),
}
"""The names of the options by their heading in ``pytest --help``."""

OPTIONS = (
    Option(
        name="budget",
        metavar="N",
        help="Search: fly N scenarios per landing system and map. Without it pytest flies saved "
        "cases only, and skips all other landing tests.",
    ),
    Option(
        name="seed",
        metavar="SEED",
        default="0",
        help="Seed of the search: a whole number, or 'random'. The header prints the seed. The "
        "same seed gives the same results (default: 0).",
    ),
    Option(
        name="method",
        metavar="METHOD",
        default=DEFAULT_METHOD,
        help=f"Search method: {', '.join(method_names())}, or your own as module:factory "
        f"(default: {DEFAULT_METHOD}).",
    ),
    Option(
        name="population",
        metavar="N",
        help="Scenarios in a generation (default: a tenth of the budget, 8 to 20).",
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
        help="Fly in N worker processes, independent of the -n of pytest-xdist. With 0 pytest "
        "itself flies, so that a debugger works (default: one per CPU core, or per CPU of a Ray "
        "cluster).",
    ),
    Option(
        name="domain",
        metavar="NAME|FILE",
        help="Operational domain: the conditions in which the landing system is to land. Built in "
        "are field, calm and paper; or give your own TOML file. It wins over the domain of a "
        f"test's marker, and that over the ini key; `garl domain show` explains it (default: "
        f"{DEFAULT_DOMAIN}).",
    ),
    Option(
        name="timeout",
        metavar="SECONDS",
        default="10",
        help="Limit in wall-clock seconds for one call of the landing system; a longer call "
        "counts as hung (default: 10).",
    ),
    Option(
        name="repeat",
        metavar="SLOT|FILE",
        help="Fly one scenario again instead of searching: a slot of the last run, such as "
        "court-g03-s17, or a scenario file.",
    ),
    Option(
        name="shrink",
        metavar="N",
        help="Flights to confirm, shrink and save each new kind of violation: 8 or more; a Python "
        "exception or a hang takes 2. With 0 nothing is confirmed, shrunk or saved (default: 12, "
        "but at most as many for all kinds together as the search has).",
    ),
    Option(
        name="baseline",
        metavar="FILE",
        help="Gate: fly the scenarios of a file that `garl baseline save` wrote. It fails if "
        "there is a new type of violation, if there are significantly more violations or aborts, "
        "or if a flight is inconclusive.",
    ),
    Option(
        name="report",
        metavar="DIR",
        help="Write the run as pages into this folder when it ends: what was found, and a page for "
        "each kind of violation, with films if pytest-garl[video] is installed. `garl report "
        "--out=DIR` does the same later.",
    ),
    Option(
        name="film",
        metavar="failures",
        help="Draw films when the run ends, into .garl/films: of each saved case that fails, and "
        "of the first flight of each kind of violation, ten at most. It needs ffmpeg, or "
        "pytest-garl[video]. `garl film` draws any other flight.",
    ),
    Option(
        name="npcs",
        metavar="POLICY",
        help=f"NPC policy, which moves people, dogs and birds: {expected_policies()} "
        "(default: as the domain says, graded with its "
        "learned director where NPCs may interfere; in the domain paper "
        f"{DEFAULT_POLICY}, and the methods of the paper have their own, see docs/methods.md; with "
        "--garl-repeat the policy of the search).",
    ),
)

RESUME = (
    "Continue the interrupted run of the ledger. Options, landing system and versions must not "
    "have changed."
)

KEYS = (
    Key(
        name="garl_dir",
        help="Folder of the ledger and the records of flights.",
        default=RUN_FOLDER,
    ),
    Key(name="garl_cases", help=f"Folder of the saved cases (default: {CASES_FOLDER})."),
    Key(
        name="garl_archive",
        help="File in which searches keep their flights for later searches: read when a search "
        "begins, written when it ends (default: none).",
    ),
    Key(
        name="garl_use",
        help="File of the model of use from which --garl-method=use draws; `garl domain use` "
        "prints one to edit (default: none).",
    ),
    Key(
        name="garl_duplicates",
        default="xfail",
        help="How to report a test that fails in the same assertion and with the same signature "
        "as in an earlier slot of the search: 'xfail' or 'fail' (default: xfail).",
    ),
    Key(
        name="garl_xfail_strict",
        help="Whether an open saved case that passes fails the run.",
        type="bool",
        default=False,
    ),
    Key(
        name="garl_unasserted",
        help="What a violation is that no selected test asserts: 'fail' fails the run, 'note' is a "
        "line of the summary (default: fail where the environment variable CI is set, else note).",
    ),
    Key(
        name="garl_level",
        default="0.05",
        help="False-alarm rate of the gate per map: how often it may fail a landing system that "
        "is no worse than the baseline, between 0 and 1 (default: 0.05).",
    ),
    Key(
        name="garl_report-url",
        help="Where the folder of --garl-report will be published, such as a site of GitHub Pages: "
        "GitHub's step summary shows its pictures and links to its pages, and so does JUnit XML.",
    ),
    Key(
        name="garl_pool",
        default="local",
        help="Where to fly: 'local' flies in worker processes, 'ray' on the Ray cluster of "
        "RAY_ADDRESS. If RAY_ADDRESS is not set, 'ray' starts a cluster here, which ends with the "
        "run. 'ray' needs pytest-garl[ray]. The results are the same (default: local).",
    ),
    Key(
        name="garl_engine",
        help="The physics engine: 'bullet', 'mujoco', or 'auto': bullet if it is installed, else "
        "mujoco (default: what the environment variable GARL_ENGINE says, else auto).",
    ),
    Key(
        name="garl_probes",
        help="When a search flies the probes of a landing system before: 'first', until they have "
        "passed and again when the system has changed; 'always'; or 'never'.",
        default="first",
    ),
)


def add_options(parser: pytest.Parser) -> None:
    """Register all options and ini keys."""
    options = {option.name: option for option in OPTIONS}
    for heading, names in GROUPS.items():
        group = parser.getgroup(heading)
        for name in names:
            if name == "resume":
                group.addoption("--garl-resume", action="store_true", help=RESUME)
                continue
            option = options[name]
            group.addoption(
                f"--garl-{name}", default=None, metavar=option.metavar, help=option.help
            )
            parser.addini(
                f"garl_{name}",
                help=f"Value of --garl-{name} if the command line has none.",
                default=option.default,
            )
    for key in KEYS:
        parser.addini(key.name, help=key.help, default=key.default, type=key.type)


def check_keys(config: pytest.Config) -> None:
    """Raise UsageError for an unknown ini key ``garl_…`` of the configuration file or of ``-o``.

    pytest itself warns at most, and the key that was meant keeps its default.
    """
    # pytest has no public list of the keys that are given, nor of those that are known.
    known = config._parser._inidict
    for key in config._inicfg:
        if key.startswith("garl_") and key not in known:
            raise pytest.UsageError(_unknown_key(key, known))


def _unknown_key(key: str, known: Iterable[str]) -> str:
    import difflib

    near = difflib.get_close_matches(key, [each for each in known if each[:5] == "garl_"], n=1)
    meant = f"did you mean {near[0]}? " if near else ""
    return f"{key}: unknown ini key; {meant}`pytest --help` lists those that begin with garl_"


def is_enabled(config: pytest.Config) -> bool:
    """Whether the command line or the configuration asks for flights."""
    names = [option.name for option in OPTIONS]
    if config.getoption("--garl-resume"):
        return True
    return any(config.getoption(f"--garl-{name}") is not None for name in names) or any(
        config.getini(f"garl_{name}") for name in ("budget", "repeat", "baseline", "film")
    )


def computes(config: pytest.Config) -> bool:
    """Whether this process may breed or fly, asked before a conftest.py is read."""
    given = config.known_args_namespace
    return (
        any(getattr(given, f"garl_{option.name}", None) is not None for option in OPTIONS)
        or any(config.getini(f"garl_{name}") for name in ("budget", "repeat", "baseline"))
        or config.getini("garl_workers") == "0"
    )


def flies_itself(config: pytest.Config) -> bool:
    """Whether this process flies, and not workers; may be asked before a conftest.py is read."""
    given = getattr(config.known_args_namespace, "garl_workers", None)
    return str(config.getini("garl_workers") if given is None else given) == "0"
