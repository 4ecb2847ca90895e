"""Read a test's marker ``garl``: landing system, maps, limits, data files."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.execution.reference import check_system
from pytest_garl.execution.sources import data_files
from pytest_garl.fiducial import MarkerSpec
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.target import Target
from pytest_garl.scenarios.placed import MAP_DICTIONARY
from pytest_garl.scenarios.task import Start, StartMode, Task

if TYPE_CHECKING:
    from pytest_garl.scenarios.domains.domain import Domain
    from pytest_garl.scenarios.maps.map import Map

T = TypeVar("T", MarkerSpec, Start)


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerArguments:
    """Checked arguments of a marker."""

    maps: tuple[str, ...]
    """Those of the marker's maps that ``--garl-map`` selects."""
    all_maps: tuple[str, ...]
    target: Target
    """A target without map, for items that have none."""
    marker: MarkerSpec | None = None
    """The marker on the ground; None for that of each map."""
    start: Start = field(default_factory=Start)
    has_distance: bool = False
    """Whether the user limits the distance, which else follows from the marker's size."""
    map_folders: tuple[Path, ...] = ()

    def on(self, map: str) -> Target:
        """Return the target on a map."""
        from pytest_garl.scenarios.maps.loading import load_map
        from pytest_garl.verdicts.verdict import default_distance_m

        spec, limits = self.marker or load_map(map, self.map_folders).marker, self.target.limits
        if not self.has_distance:
            limits = replace(limits, distance_m=default_distance_m(spec.side_m))
        task = Task(marker=spec, start=self.start)
        return replace(self.target, map=map, limits=limits, task=task)


def read_marker(marker: pytest.Mark, options: Options) -> MarkerArguments:
    """Return the arguments of a marker; raise GarlError if one is invalid."""
    from pytest_garl.scenarios.domains.own_navigation import within
    from pytest_garl.scenarios.maps.loading import load_map, map_names
    from pytest_garl.verdicts.verdict import Limits, LimitsOfMarker, limits

    known = {"system", "maps", "domain", "marker", "start", "limits"}
    known |= {"deterministic", "files"}
    unknown = sorted(set(marker.kwargs) - known)
    if unknown or marker.args:
        raise GarlError(
            f"mark.garl: found {', '.join(unknown) or 'positional arguments'}, expected keywords "
            "system=, maps=, domain=, marker=, start=, limits=, deterministic= and files="
        )
    if "system" not in marker.kwargs:
        raise GarlError("mark.garl: system= is missing; give the landing system's class")
    system = marker.kwargs["system"]
    check_system(system)
    maps = marker.kwargs.get("maps", ("court", "lawn"))
    maps = [maps] if isinstance(maps, str) else maps
    if not isinstance(maps, list | tuple) or not all(isinstance(each, str) for each in maps):
        raise GarlError(f"mark.garl: maps={maps!r}: expected a list of names, as ['court', 'lawn']")
    maps = tuple(dict.fromkeys(maps))
    if not maps:
        there = ", ".join(map_names(options.map_folders))
        raise GarlError(f"mark.garl: maps=[]: nothing to fly on; expected one or more of {there}")
    spec = _of_type(marker, "marker", MarkerSpec)
    for map in maps:
        _check_ids(spec, load_map(map, options.map_folders))
    given = marker.kwargs.get("limits", {})
    if isinstance(given, dict):
        given = limits(**{str(name): value for name, value in given.items()})
    if not isinstance(given, Limits):
        raise GarlError(
            f"mark.garl: limits={given!r}: expected pytest_garl.limits(distance_m=..., "
            "time_s=..., abort='needless', 'ok' or 'violation')"
        )
    deterministic = marker.kwargs.get("deterministic", True)
    if not isinstance(deterministic, bool):
        raise GarlError(f"mark.garl: deterministic={deterministic!r}: expected True or False")
    target = Target(
        system=system,
        limits=Limits(**asdict(given)),
        deterministic=deterministic,
        domain=_domain(marker.kwargs.get("domain"), options),
        files=_files(marker.kwargs.get("files", ()), options),
    )
    if target.domain is not None:
        within(target.domain, target.navigation)  # Raises if they contradict each other.
    return MarkerArguments(
        maps=tuple(map for map in maps if not options.maps or map in options.maps),
        all_maps=maps,
        target=target,
        marker=spec,
        start=_start(marker),
        has_distance=not isinstance(given, LimitsOfMarker),
        map_folders=options.map_folders,
    )


def _domain(given: Any, options: Options) -> Domain:
    if given is not None and not isinstance(given, str):
        raise GarlError(
            f"mark.garl: domain={given!r}: expected a name such as 'field', or a TOML file"
        )
    try:
        return options.domain_of(given)
    except GarlError as error:
        raise GarlError(f"mark.garl: domain={given!r}: {error}") from error


def _start(marker: pytest.Mark) -> Start:
    """Return the start; a text is its mode, as in ``start="hover"``."""
    given = marker.kwargs.get("start")
    if isinstance(given, str):
        return Start(mode=cast("StartMode", given))  # Raises for another mode.
    return _of_type(marker, "start", Start) or Start()


def _of_type(marker: pytest.Mark, name: str, kind: type[T]) -> T | None:
    """Return an argument, made from a dict if it is one; None if it is not given."""
    given = marker.kwargs.get(name)
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


def _check_ids(spec: MarkerSpec | None, map: Map) -> None:
    """Refuse a marker that another one on the map's ground equals."""
    own = spec or map.marker
    same_family = own.dictionary.rpartition("_")[0] == MAP_DICTIONARY.rpartition("_")[0]
    painted = {each.marker_id for each in map.ground.layers if each.kind == "marker"}
    twice = sorted(painted & {each.id for each in own.markers}) if same_family else []
    if twice:
        raise GarlError(
            f"mark.garl: marker={own!r}: the map {map.name!r} has another marker of the id "
            f"{twice[0]} on its ground, so nobody could tell them apart; choose another id or map"
        )


def _files(given: Any, options: Options) -> tuple[str, ...]:
    """Return the marker's data files; raise GarlError if one does not exist."""
    named = isinstance(given, list | tuple) and all(isinstance(each, str | Path) for each in given)
    if not named:
        raise GarlError(f"mark.garl: files={given!r}: expected a list of paths, as ['model.onnx']")
    files = tuple(str(each) for each in given)
    try:
        data_files(files, options.root)
    except FileNotFoundError as error:
        raise GarlError(
            f"mark.garl: files: there is no {str(error)!r} below {options.root}; expected a file "
            "or a folder"
        ) from error
    return files
