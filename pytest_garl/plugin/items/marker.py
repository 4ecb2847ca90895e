"""Read a test's marker ``garl``: landing system, maps, limits, data files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar, cast

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.execution.reference import check_system
from pytest_garl.execution.sources import data_files
from pytest_garl.fiducial import MarkerSpec
from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.plugin.items.target import Target
from pytest_garl.plugin.options import Options
from pytest_garl.scenarios.domains.domain import Domain
from pytest_garl.scenarios.domains.own_navigation import within
from pytest_garl.scenarios.maps.loading import load_map, map_names
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.placed import MAP_DICTIONARY
from pytest_garl.scenarios.task import Start, StartMode, Task
from pytest_garl.verdicts.verdict import Limits, LimitsOfMarker, default_distance_m, limits

T = TypeVar("T", MarkerSpec, Start)
KNOWN = ("system", "maps", "domain", "marker", "start", "limits", "deterministic", "files")
"""The arguments of a marker."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerArguments:
    """Checked arguments of a marker."""

    maps: tuple[str, ...]
    """All maps that the marker names."""
    known_maps: tuple[str, ...]
    """All maps that there are."""
    target: Target
    """A target without map, for items that have none."""
    targets: Mapping[str, Target]
    """The target on each of the maps that ``--garl-map`` selects."""


def read_marker(marker: pytest.Mark, options: Options) -> MarkerArguments:
    """Return the arguments of a marker; raise GarlError if one is invalid."""
    given = marker.kwargs
    unknown = sorted(set(given) - set(KNOWN))
    if unknown or marker.args:
        raise GarlError(
            f"mark.garl: found {', '.join(unknown) or 'positional arguments'}, expected keywords "
            f"{'=, '.join(KNOWN[:-1])}= and {KNOWN[-1]}="
        )
    if "system" not in given:
        raise GarlError("mark.garl: system= is missing; give the landing system's class")
    deterministic = given.get("deterministic", True)
    if not isinstance(deterministic, bool):
        raise GarlError(f"mark.garl: deterministic={deterministic!r}: expected True or False")
    spec, start = _of_type(given, "marker", MarkerSpec), _start(given)
    names, files = _map_names(given), _files(given)
    bounds = _limits(given)
    domain = _domain(given.get("domain"), options)
    check_system(given["system"])
    data_files(files, options.root)  # Raises if one of them does not exist.
    known = map_names(options.map_folders)
    if not names:
        there = ", ".join(known)
        raise GarlError(f"mark.garl: maps=[]: nothing to fly on; expected one or more of {there}")
    maps = [load_map(name, options.map_folders) for name in names]
    target = Target(
        system=given["system"],
        limits=Limits(**asdict(bounds)),
        deterministic=deterministic,
        domain=domain,
        files=files,
    )
    within(domain, target.navigation)  # Raises if they contradict each other.
    targets = {}
    for map in maps:
        own = spec or map.marker
        _check_ids(own, map)
        if isinstance(bounds, LimitsOfMarker):
            bounds = replace(bounds, distance_m=default_distance_m(own.side_m))
        if not options.maps or map.name in options.maps:
            targets[map.name] = replace(
                target,
                map=map.name,
                limits=Limits(**asdict(bounds)),
                task=Task(marker=own, start=start),
            )
    return MarkerArguments(maps=names, known_maps=known, target=target, targets=targets)


def _map_names(given: Mapping[str, Any]) -> tuple[str, ...]:
    maps = given.get("maps", ("court", "lawn"))
    maps = [maps] if isinstance(maps, str) else maps
    if not isinstance(maps, list | tuple) or not all(isinstance(each, str) for each in maps):
        raise GarlError(f"mark.garl: maps={maps!r}: expected a list of names, as ['court', 'lawn']")
    return tuple(dict.fromkeys(maps))


def _limits(given: Mapping[str, Any]) -> Limits:
    found = given.get("limits", {})
    if isinstance(found, dict):
        found = limits(**{str(name): value for name, value in found.items()})
    if not isinstance(found, Limits):
        raise GarlError(
            f"mark.garl: limits={found!r}: expected pytest_garl.limits(distance_m=..., "
            "time_s=..., abort='needless', 'ok' or 'violation')"
        )
    return found


def _domain(named: Any, options: Options) -> Domain:
    """Return the domain of the command line, else that of the marker, else the session's.

    That of the marker is read in any case: it may be wrong.
    """
    if named is not None and not isinstance(named, str):
        raise GarlError(
            f"mark.garl: domain={named!r}: expected a name such as 'field', or a TOML file"
        )
    try:
        own = domain_with_policy(named, options.root) if named is not None else options.domain
    except GarlError as error:
        raise GarlError(f"mark.garl: domain={named!r}: {error}") from error
    return options.domain if "domain" in options.given else own


def _start(given: Mapping[str, Any]) -> Start:
    """Return the start; a text is its mode, as in ``start="hover"``."""
    start = given.get("start")
    if isinstance(start, str):
        return Start(mode=cast("StartMode", start))  # Raises for another mode.
    return _of_type(given, "start", Start) or Start()


def _of_type(arguments: Mapping[str, Any], name: str, kind: type[T]) -> T | None:
    """Return an argument, made from a dict if it is one; None if it is not given."""
    given = arguments.get(name)
    if isinstance(given, dict):
        known = [each.name for each in fields(kind)]
        unknown = [str(each) for each in given if each not in known]
        if unknown:
            raise GarlError(
                f"mark.garl: {name}= has {', '.join(unknown)}; expected {', '.join(known)}"
            )
        given = kind(**given)
    if given is not None and not isinstance(given, kind):
        raise GarlError(
            f"mark.garl: {name}={given!r}: expected pytest_garl.{kind.__name__}(...) or a dict of "
            "its fields"
        )
    return given


def _check_ids(own: MarkerSpec, map: Map) -> None:
    """Refuse a marker that another one on the map's ground equals."""
    same_family = own.dictionary.rpartition("_")[0] == MAP_DICTIONARY.rpartition("_")[0]
    painted = {each.marker_id for each in map.ground.layers if each.kind == "marker"}
    twice = sorted(painted & {each.id for each in own.markers}) if same_family else []
    if twice:
        raise GarlError(
            f"mark.garl: marker={own!r}: the map {map.name!r} has another marker of the id "
            f"{twice[0]} on its ground, so nobody could tell them apart; choose another id or map"
        )


def _files(given: Mapping[str, Any]) -> tuple[str, ...]:
    files = given.get("files", ())
    named = isinstance(files, list | tuple) and all(isinstance(each, str | Path) for each in files)
    if not named:
        raise GarlError(f"mark.garl: files={files!r}: expected a list of paths, as ['model.onnx']")
    return tuple(str(each) for each in files)
