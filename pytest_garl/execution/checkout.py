"""Checkouts of a landing stack: a process imports the modules of one, and never of the others."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.errors import LandingSystemError
from pytest_garl.execution.reference import (
    Reference,
    reference_to,
    system_named,
)
from pytest_garl.execution.sources import sources_sha256


@dataclass(frozen=True, slots=True, kw_only=True)
class Checkout:
    """A folder with a landing stack; nothing may be imported from the folders ``others``."""

    folder: Path
    others: tuple[Path, ...] = ()

    @property
    def arguments(self) -> tuple[str, ...]:
        """The folders as arguments for a process that calls :func:`isolate_imports`."""
        return tuple(str(each.resolve()) for each in (self.folder, *self.others))


def isolate_imports(folders: Sequence[str]) -> None:
    """Have imports search the first folder first, and never the others.

    The working directory is left out too: ``python -m`` puts it first, and it may be another
    checkout.  This package is imported before, and stays where it is.
    """
    folder, *others = (Path(each) for each in folders)
    hidden = {place for other in (folder, Path.cwd(), *others) for place in _places(other)}
    rest = [entry for entry in sys.path if Path(entry).resolve() not in hidden]
    sys.path[:] = [*(str(place) for place in _places(folder) if place.is_dir()), *rest]


def _places(folder: Path) -> tuple[Path, Path]:
    """Return the folders of a checkout that may hold packages."""
    return folder.resolve(), (folder / "src").resolve()


def describe(checkout: Checkout, system: str) -> tuple[Reference, str]:
    """Return where a checkout defines a landing system ("module:class"), and its sources' hash.

    A process of its own imports it, so that this one imports from no checkout.  Raises
    LandingSystemError if the import fails, or if it finds no landing system.
    """
    command = [sys.executable, "-m", __name__, system, *checkout.arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        reason = (done.stderr.strip().splitlines() or ["it ended its process"])[-1]
        raise LandingSystemError(
            f"system {system!r} of {checkout.folder}: {reason}. Expected MODULE:CLASS as it is "
            "imported from that folder (or its src), such as landing_systems.mm_mls:MyLanding"
        )
    values = json.loads(done.stdout.splitlines()[-1])
    reference = Reference(**values["reference"])
    if checkout.others and not Path(reference.file).is_relative_to(checkout.folder.resolve()):
        raise LandingSystemError(
            f"system {system!r} of {checkout.folder}: is not there; {reference.file} would be "
            "imported instead. Is it a checkout of the landing stack?"
        )
    return reference, str(values["sha256"])


def main(system: str, folders: Sequence[str]) -> None:
    """Import a system and print the facts that :func:`describe` returns."""
    isolate_imports(folders)
    try:
        found = system_named(system)
    except LandingSystemError as error:
        sys.exit(str(error).replace("\n", " "))
    reference = reference_to(found)
    facts = {name: getattr(reference, name) for name in ("module", "file", "qualname")}
    line = json.dumps({"reference": facts, "sha256": sources_sha256(found)})
    sys.stdout.write(f"\n{line}\n")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
