"""Read a test's marker ``garl``: landing system, maps, limits, data files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.execution.reference import check_system
from pytest_garl.execution.sources import data_files
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.target import Target


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerArguments:
    """Checked arguments of a marker."""

    maps: tuple[str, ...]
    """Those of the marker's maps that ``--garl-map`` selects."""
    target: Target
    """A target without map, which each item completes."""


def read_marker(marker: pytest.Mark, options: Options) -> MarkerArguments:
    """Return the arguments of a marker; raise GarlError if one is invalid."""
    from pytest_garl.scenarios.maps.map import load_map, map_names
    from pytest_garl.verdicts.verdict import Limits, limits

    known = {"system", "maps", "limits", "deterministic", "files"}
    unknown = sorted(set(marker.kwargs) - known)
    if unknown or marker.args:
        raise GarlError(
            f"mark.garl: found {', '.join(unknown) or 'positional arguments'}, expected keywords "
            "system=, maps=, limits=, deterministic= and files="
        )
    if "system" not in marker.kwargs:
        raise GarlError("mark.garl: system= is missing; give the landing system's class")
    system = marker.kwargs["system"]
    check_system(system)
    maps = marker.kwargs.get("maps", ("court", "lawn"))
    maps = (maps,) if isinstance(maps, str) else tuple(maps)
    if not maps:
        there = ", ".join(map_names(options.map_folders))
        raise GarlError(f"mark.garl: maps=[]: nothing to fly on; expected one or more of {there}")
    for map in maps:
        load_map(map, options.map_folders)
    given = marker.kwargs.get("limits", Limits())
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
    return MarkerArguments(
        maps=tuple(map for map in maps if not options.maps or map in options.maps),
        target=Target(
            system=system,
            limits=given,
            deterministic=deterministic,
            files=_files(marker.kwargs.get("files", ()), options),
        ),
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
