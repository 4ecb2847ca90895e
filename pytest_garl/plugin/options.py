"""The options of a session: every command-line option and ini key in one frozen object."""

from __future__ import annotations

import os
import re
import urllib.parse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.files.run_files import ARCHIVE, CASES_FOLDER, REPEAT_LEDGER, SEARCH_LEDGER
from pytest_garl.npcs.domain_policy import domain_with_policy, policy_in
from pytest_garl.npcs.policy_catalogue import expected_policies, names_policy
from pytest_garl.plugin.arguments import OPTIONS, Option
from pytest_garl.plugin.xdist import CONTROLLER, SEED, is_xdist_worker
from pytest_garl.scenarios.domains.names import DEFAULT_DOMAIN
from pytest_garl.search.method_catalogue import (
    USE,
    default_policy,
    find_method,
    method_names,
)
from pytest_garl.shrinking.plan import FEWEST_FOR_VIOLATION

if TYPE_CHECKING:
    from pytest_garl.scenarios.domains.domain import Domain

_URL = re.compile(r"[\w.~:/?#@!$&*+,;=%-]+", re.ASCII)
"""An address without what ends it in Markdown or HTML."""
SLOT_ID = re.compile(r"(?P<map>.+)-g(?P<generation>\d{2,})-s(?P<slot>\d{2,})")
LARGEST_POPULATION = 20
SMALLEST_POPULATION = 8
"""Limits of the default population."""
SHRINK = 12
"""Flights for each new kind of violation: enough for the barest scenario, its neighbours, an escape
and a shorter record of moves."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Checked values of all options, and the paths that follow from them."""

    given: frozenset[str]
    """Names of the options on the command line, without ``--garl-``."""
    budget: int
    seed: int
    method: str
    population: int
    resume: bool
    maps: tuple[str, ...]
    pool: Literal["local", "ray"]
    workers: int | None
    """None: as many as the Ray cluster has CPUs."""
    ray_address: str
    """Of a cluster that is there already, or empty: one on this machine."""
    domain: Domain
    """Of the command line, else of the ini file, else the default one."""
    timeout_s: float
    repeat: str
    """A slot or a scenario file to fly again, or empty."""
    duplicates: Literal["xfail", "fail"]
    npcs: str
    """The NPC policy that an option names; empty: the domain's, or that of the repeated slot."""
    baseline: Path | None
    level: float
    report: Path | None
    """The folder for the pages of the run."""
    report_url: str
    """Where that folder will be published, without a slash at the end; may be empty."""
    film: Literal["", "failures"]
    """Which flights of the run have films."""
    shrink: int
    """Flights for each new kind of violation."""
    shrink_capped: bool
    """Whether all kinds of a search together have no more flights than the search."""
    xfail_strict: bool
    unasserted: Literal["fail", "note"]
    """What a violation is that no selected test asserts."""
    probes: Literal["first", "always", "never"]
    """When a search flies the probes of a landing system before."""
    archive: Path | None
    """The file that carries what searches know to later ones."""
    use: Path | None
    """The file of the model of use, if the method draws from one."""
    cases: Path
    cases_named: bool
    """Whether the ini file or the command line names the folder of the cases."""
    folder: Path
    root: Path
    controller: str

    @property
    def searches_or_repeats(self) -> bool:
        """Whether the session flies a search or a repeated scenario, and not saved cases only."""
        return self.budget > 0 or bool(self.repeat)

    def policy_in(self, domain: Domain) -> str:
        """Return the name of the policy that moves the NPCs of a search in a domain."""
        return self.npcs or policy_in(domain, default_policy(self.method))

    @property
    def map_folders(self) -> tuple[Path, ...]:
        """Folders of a user's own maps."""
        return (self.root / "scenarios" / "maps",)

    @property
    def search_ledger(self) -> Path:
        """The file of the ledger of a search."""
        return self.folder / SEARCH_LEDGER

    @property
    def repeat_ledger(self) -> Path:
        """The file of the ledger of a repeated scenario, which leaves that of the search alone."""
        return self.folder / REPEAT_LEDGER

    def archive_named(self, sha256: str) -> Path:
        """Return the file that keeps the archive with which the run began."""
        return self.folder / ARCHIVE.format(sha256)

    @property
    def flights(self) -> Path:
        """The folder of the flights' records."""
        return self.folder / "flights"

    @property
    def films(self) -> Path:
        """The folder of the films of failing flights."""
        return self.folder / "films"


_OPTIONS = pytest.StashKey[Options]()


def options_of(config: pytest.Config) -> Options:
    """Return the session's options; the first call reads them and keeps them in the stash.

    Raises UsageError for an invalid value.
    """
    if _OPTIONS not in config.stash:
        config.stash[_OPTIONS] = read_options(config)
    return config.stash[_OPTIONS]


def read_options(config: pytest.Config) -> Options:
    """Read the options, or raise UsageError; call ``options_of``, which does it once."""
    text = {option.name: _value(config, option) for option in OPTIONS}
    of_controller = getattr(config, "workerinput", {})
    budget = _integer("budget", text["budget"], 1) if text["budget"] else 0
    size = _integer("population", text["population"], 1) if text["population"] else 0
    address = os.environ.get("RAY_ADDRESS", "")
    address = "" if address == "local" else address
    folder = config.rootpath / str(config.getini("garl_dir"))
    pool = _word(config, "garl_pool", ("local", "ray"))
    return Options(
        given=_given(config),
        budget=budget,
        population=min(size, budget) if size else population(budget),
        resume=bool(config.getoption("--garl-resume")),
        seed=int(of_controller[SEED]) if SEED in of_controller else _seed(text["seed"]),
        method=_method(text["method"]),
        maps=tuple(part.strip() for part in text["map"].split(",") if part.strip()),
        pool=pool,
        workers=_workers(text["workers"], pool, address),
        ray_address=address,
        timeout_s=_number("--garl-timeout", text["timeout"], 1e6, "a positive number of seconds"),
        repeat=_repeat(text["repeat"]),
        duplicates=_word(config, "garl_duplicates", ("xfail", "fail")),
        npcs=_npcs(text["npcs"]),
        baseline=_baseline(config),
        level=_number(
            "garl_level", str(config.getini("garl_level")), 1, "a number between 0 and 1"
        ),
        report=_report(config),
        report_url=_report_url(str(config.getini("garl_report-url"))),
        film=_filmed(text["film"], draws=not is_xdist_worker(config)),
        shrink=_shrink(text["shrink"]),
        shrink_capped=not text["shrink"],
        xfail_strict=bool(config.getini("garl_xfail_strict")),
        # By default nobody reads the notes of a build server.
        unasserted=_word(
            config, "garl_unasserted", ("fail", "note"), "fail" if os.environ.get("CI") else "note"
        ),
        probes=_word(config, "garl_probes", ("first", "always", "never")),
        archive=_file(config, "garl_archive"),
        use=_use(config, text["method"]),
        cases=config.rootpath / str(config.getini("garl_cases") or CASES_FOLDER),
        cases_named=bool(config.getini("garl_cases")),
        folder=folder,
        root=config.rootpath,
        controller=str(of_controller.get(CONTROLLER, os.getpid())),
        domain=_domain(config),
    )


def population(budget: int) -> int:
    """Return the default population: a tenth of the budget, 8 to 20, at most the budget."""
    return min(LARGEST_POPULATION, max(SMALLEST_POPULATION, budget // 10), budget)


def _value(config: pytest.Config, option: Option) -> str:
    given = config.getoption(f"--garl-{option.name}")
    return str(config.getini(f"garl_{option.name}") if given is None else given)


def _given(config: pytest.Config) -> frozenset[str]:
    names = [each.name for each in OPTIONS if config.getoption(f"--garl-{each.name}") is not None]
    return frozenset([*names, *(["resume"] if config.getoption("--garl-resume") else [])])


def _workers(text: str, pool: str, ray_address: str) -> int | None:
    if text:
        # None of Ray's workers is the pytest process.
        return _integer("workers", text, 1 if pool == "ray" else 0)
    return None if pool == "ray" and ray_address else os.cpu_count() or 1


def _shrink(text: str) -> int:
    if not text:
        return SHRINK
    number = _integer("shrink", text, 0)
    if 0 < number < FEWEST_FOR_VIOLATION:
        raise _wrong("shrink", text, f"0, or at least {FEWEST_FOR_VIOLATION} flights per new kind")
    return number


def _word(config: pytest.Config, key: str, known: tuple[str, ...], default: str = "") -> Any:
    """Return the value of an ini key, one of the known words."""
    text = str(config.getini(key)) or default
    if text not in known:
        expected = f"{', '.join(known[:-1])} or {known[-1]}"
        raise pytest.UsageError(f"{key}: found {text!r}, expected {expected}")
    return text


def _place(config: pytest.Config, name: str) -> tuple[str, Path]:
    """Return a path of the command line, as seen from here, else of the ini key, from the root."""
    given = config.getoption(f"--garl-{name}")
    return (str(given), Path()) if given else (str(config.getini(f"garl_{name}")), config.rootpath)


def _baseline(config: pytest.Config) -> Path | None:
    text, folder = _place(config, "baseline")
    if text and not (folder / text).is_file():
        raise _wrong("baseline", text, "a file that `garl baseline save` wrote")
    return folder / text if text else None


def _file(config: pytest.Config, key: str) -> Path | None:
    text = str(config.getini(key))
    return config.rootpath / text if text else None


def _use(config: pytest.Config, method: str) -> Path | None:
    """Return the file of the model of use, which only one method needs."""
    if method != USE:
        return None
    path = _file(config, "garl_use")
    if path is None:
        raise pytest.UsageError(
            "garl_use: found no file, expected that of the model of use from which "
            f"--garl-method={USE} draws: `garl domain use field >use.toml` prints one to edit"
        )
    if not path.is_file():
        raise _refused("garl_use", str(path), "a file that `garl domain use` printed")
    return path


def _report(config: pytest.Config) -> Path | None:
    text, folder = _place(config, "report")
    return folder / text if text else None


def _method(text: str) -> str:
    if ":" not in text:
        return _among("method", text, method_names())
    try:
        find_method(text)
    except GarlError as error:
        raise pytest.UsageError(f"--garl-method: {error}") from error
    return text


def _domain(config: pytest.Config) -> Domain:
    named, folder = _place(config, "domain")
    text = named or DEFAULT_DOMAIN
    try:
        return domain_with_policy(text, folder)
    except GarlError as error:
        raise pytest.UsageError(f"--garl-domain={text}: {error}") from error


def _npcs(text: str) -> str:
    if text and not names_policy(text):
        raise _wrong("npcs", text, expected_policies())
    return text


def _seed(text: str) -> int:
    if text == "random":
        import secrets

        return secrets.randbelow(2**32)
    return _integer("seed", text, 0)


def _repeat(text: str) -> str:
    if text and not SLOT_ID.fullmatch(text) and not Path(text).is_file():
        raise _wrong("repeat", text, "a slot such as court-g03-s17, or an existing scenario file")
    return text


def _wrong(name: str, found: str, expected: str) -> pytest.UsageError:
    """Return the error of an option with a value that it cannot have."""
    return _refused(f"--garl-{name}", found, expected)


def _refused(where: str, found: str, expected: str) -> pytest.UsageError:
    """Return the error of an option or an ini key with a value that it cannot have."""
    return pytest.UsageError(f"{where}: found {found!r}, expected {expected}")


def _integer(name: str, text: str, low: int) -> int:
    """Return a whole number of at least ``low``."""
    if not re.fullmatch(r"\d+", text) or int(text) < low:
        raise _wrong(name, text, f"a whole number of at least {low}")
    return int(text)


def _number(where: str, text: str, below: float, expected: str) -> float:
    """Return a number between 0 and ``below``, both excluded, for an option or key ``where``."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 < value < below:
        raise _refused(where, text, expected)
    return value


def _among(name: str, text: str, known: tuple[str, ...]) -> str:
    """Return one of the known words."""
    if text not in known:
        raise _wrong(name, text, f"one of {', '.join(known)}")
    return text


def _filmed(text: str, *, draws: bool) -> Literal["", "failures"]:
    """Return which flights have films; a process that ``draws`` needs an encoder.

    It is looked for at once: a search of hours shall not end without its films.
    """
    if not text:
        return ""
    _among("film", text, ("failures",))
    if draws:
        from pytest_garl.reports.film.encoder import find_ffmpeg

        try:
            find_ffmpeg()
        except GarlError as error:
            raise pytest.UsageError(f"--garl-film={text}: {error}") from error
    return cast(Literal["failures"], text)


def _report_url(text: str) -> str:
    """Return the address without a slash at its end."""
    parts = urllib.parse.urlsplit(text)
    if text and not (parts.scheme in ("http", "https") and parts.netloc and _URL.fullmatch(text)):
        raise _refused("garl_report-url", text, "an address such as https://example.org/report")
    return text.rstrip("/")
