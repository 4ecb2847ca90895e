"""Checkouts of a landing stack: a process imports modules from one checkout only."""

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
    """A folder with the code of landing systems.

    ``others`` are folders of other checkouts; a process that uses this one imports nothing there.
    """

    folder: Path
    others: tuple[Path, ...] = ()

    @property
    def arguments(self) -> tuple[str, ...]:
        """The folders as arguments for a process that calls :func:`isolate_imports`."""
        return tuple(str(each.resolve()) for each in (self.folder, *self.others))


def isolate_imports(folders: Sequence[str]) -> None:
    """Change ``sys.path``: imports search the first folder first, and never the others.

    The working directory is removed too: ``python -m`` puts it first, and it may be another
    checkout.  pytest_garl is already imported, so it still comes from its own folder.
    """
    folder, *others = (Path(each) for each in folders)
    removed = {path for each in (folder, Path.cwd(), *others) for path in _import_folders(each)}
    remaining = [entry for entry in sys.path if Path(entry).resolve() not in removed]
    added = [str(path) for path in _import_folders(folder) if path.is_dir()]
    sys.path[:] = [*added, *remaining]


def _import_folders(folder: Path) -> tuple[Path, Path]:
    """Return the folders of a checkout that may hold packages: itself and ``src``."""
    return folder.resolve(), (folder / "src").resolve()


def locate_system(checkout: Checkout, system: str) -> tuple[Reference, str]:
    """Return where a checkout defines a landing system ("module:class"), and its sources' hash.

    A child process imports the system, so that this process imports nothing from a checkout.
    Raises LandingSystemError if the import fails, or if it finds no landing system.
    """
    command = [sys.executable, "-m", __name__, system, *checkout.arguments]
    process = subprocess.run(command, capture_output=True, text=True, check=False)
    if process.returncode:
        reason = (process.stderr.strip().splitlines() or ["its import ended the process"])[-1]
        raise LandingSystemError(
            f"system {system!r} of {checkout.folder}: {reason}. Expected MODULE:CLASS as it is "
            "imported from that folder (or its src), such as landing_systems.mm_mls:MyLanding"
        )
    values = json.loads(process.stdout.splitlines()[-1])
    reference = Reference(**values["reference"])
    if checkout.others and not Path(reference.file).is_relative_to(checkout.folder.resolve()):
        raise LandingSystemError(
            f"system {system!r} of {checkout.folder}: is not in that folder; "
            f"{reference.file} would be imported instead. Is it a checkout of the landing stack?"
        )
    return reference, str(values["sha256"])


def main(system: str, folders: Sequence[str]) -> None:
    """Import a landing system and print the values that :func:`locate_system` returns."""
    isolate_imports(folders)
    try:
        system_class = system_named(system)
    except LandingSystemError as error:
        sys.exit(str(error).replace("\n", " "))
    reference = reference_to(system_class)
    fields = {name: getattr(reference, name) for name in ("module", "file", "qualname")}
    line = json.dumps({"reference": fields, "sha256": sources_sha256(system_class)})
    sys.stdout.write(f"\n{line}\n")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
