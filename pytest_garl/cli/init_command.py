"""``garl init``: write what a project needs before its first search."""

from __future__ import annotations

import json
import operator
import os
import re
import shlex
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from pytest_garl.cli import skeleton
from pytest_garl.cli.adapter import adapter_name, adapter_of
from pytest_garl.cli.check_command import imported_system
from pytest_garl.cli.pytest_settings import PYTHONPATH, SETTINGS, find_settings
from pytest_garl.companion.companion_program import CompanionProgram
from pytest_garl.errors import GarlError
from pytest_garl.messages import command

SKELETON = "my_landing:MyLandingSystem"
EXAMPLE = "landing_systems"
"""The folder of the example; a wheel holds it inside of the package, a checkout beside it."""
IGNORED = ".garl/"
"""Ledgers, records and films of runs: large, and made again by each run."""
IMPORT = """\
import pytest
from {module} import {name}

"""
IMPORT_WITH_MARKER = """\
import pytest
from {module} import {name}
from pytest_garl import MarkerSpec

"""
PROGRAM = """\
import math

import pytest
from pytest_garl import Camera, CompanionProgram, MarkerSpec

# How the program is started, and its camera. In the command may stand what it is told:
# {{north_m}} {{east_m}} or {{lat_deg}} {{lon_deg}}, about where the marker is;
# {{search_altitude_m}}, {{marker_id}}, {{marker_side_m}}. With python="..." it runs in another one.
lander = CompanionProgram(
    {words},{python}  # <-
    camera=Camera(width_px=640, height_px=480, field_of_view_rad=math.radians(90)),  # <-
)
"""
MARKED = """\
pytestmark = pytest.mark.garl(system={system}, maps=["court", "lawn"])
"""
WITH_MARKER = """\
pytestmark = pytest.mark.garl(
    system={system},
    maps=["court", "lawn"],
    marker=MarkerSpec(dictionary="DICT_5X5_50", id=0, side_m=1.5),  # <-
{more})
"""
START = """\
    start="ground",  # <- or "hover": the program takes over in the air, armed, in GUIDED
"""
TESTS = """\


def test_lands_on_the_marker(landing):
    assert landing.distance_to_landing_m <= landing.limits.distance_m


def test_lands_in_time(landing):
    assert landing.time_to_landing_s <= landing.limits.time_s


def test_collides_with_nothing(landing):
    assert not landing.collisions


def test_completes_the_mission(landing):
    assert landing.completed or landing.excused  # it may give up only where nobody could land
"""
_KNOWN_IGNORES = {".garl", ".garl/", "/.garl", "/.garl/", "**/.garl", "**/.garl/", ".garl/*"}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Step:
    """What was done to a file, for the user."""

    file: Path
    done: str


@click.command()
@click.argument("system", metavar="[MODULE:CLASS|SCRIPT|COMMAND]", default="")
@click.option(
    "--example", is_flag=True, help="Write the three landing systems of the paper and their tests."
)
@click.option(
    "--adapter",
    is_flag=True,
    help="MODULE:CLASS has an interface of its own: write a landing system around it.",
)
def init(system: str, *, example: bool, adapter: bool) -> None:
    """Write tests and settings for your landing system.

    MODULE:CLASS is your landing system, such as my_landing:MyLandingSystem. Without it the command
    writes one to begin with, my_landing.py, which lands in clear air. SCRIPT is a Python program
    that speaks MAVLink, such as my_lander.py; COMMAND is the line that starts it, such as 'python
    my_lander.py --marker {marker_id}'. Run garl init in the folder in which you will run pytest. It
    changes no line that is there; if all is there it changes nothing.
    """
    here = Path.cwd()
    settings = find_settings(here)
    if example:
        if system:
            raise GarlError(f"--example: found {system} too; expected one of them")
        test = here / EXAMPLE / "test_opencv_mls.py"
        steps = [
            _Step(file=settings.file, done=settings.add(SETTINGS)),
            _copy_example(here / EXAMPLE),
            _ignore(here / ".gitignore"),
        ]
        _show(steps, test, here)
        return
    steps = []
    if adapter and not system:
        raise GarlError("--adapter: expected the class of your stack too, as MODULE:CLASS")
    if adapter:
        found, system = system, adapter_name(_imported_class(system))
        steps.append(_write(here / f"{system.partition(':')[0]}.py", adapter_of(found)))
    states_marker = bool(system)
    if not system:
        system = SKELETON
        steps.append(_write_skeleton(here / f"{SKELETON.partition(':')[0]}.py"))
    folder = next((here / path for path in settings.test_paths if (here / path).is_dir()), here)
    if system.endswith(".py") or len(system.split()) > 1:
        line = f"python {shlex.quote(system)}" if (here / system).is_file() else system
        program = CompanionProgram(line, folder=here)
        program.check()
        name, text, needs_path = program.name, _test_of_program(line, here, folder), False
    else:
        # The import says what is wrong with the name before anything is written with it.
        imported_system(system)
        module = system.partition(":")[0].rpartition(".")[2]
        name, text = re.sub(r"\W", "_", module), _test_of(system, states_marker=states_marker)
        needs_path = _needs_path(system, folder, here)
    test = folder / f"test_{name}.py"
    wanted = SETTINGS | (PYTHONPATH if needs_path else {})
    steps += [
        _Step(file=settings.file, done=settings.add(wanted)),
        _write(test, text),
        _ignore(here / ".gitignore"),
    ]
    _show(steps, test, here)


def _show(steps: Sequence[_Step], test: Path, here: Path) -> None:
    """Print what was done and what to run next."""
    for step in steps:
        click.echo(f"{step.done:<10} {step.file.relative_to(here)}")
    shown = test.relative_to(here)
    marked = [each.file for each in steps if each.file.suffix == ".py" and _is_marked(each.file)]
    if marked:
        names = " and ".join(str(file.relative_to(here)) for file in marked)
        click.echo(f"\nIn {names} change the lines with <-. Then run:")
    else:
        click.echo("\nThen run:")
    click.echo(f"    {command('garl', 'check', shown)}")
    click.echo("        flies it in clear air and names its faults")
    click.echo(f"    {command('pytest', '--garl-budget=40', shown)}")
    click.echo("        searches: 40 flights on each map, saved cases in scenarios/regressions")


def _is_marked(file: Path) -> bool:
    """Return whether a file has lines for its owner to change."""
    return "# <-" in file.read_text()


def _needs_path(system: str, folder: Path, here: Path) -> bool:
    """Return whether pytest finds the landing system's module only with a path of its own.

    It finds what lies beside a test file, or beside the packages that the file is in.
    """
    top = system.partition(":")[0].partition(".")[0]
    is_here = (here / f"{top}.py").is_file() or (here / top).is_dir()
    return is_here and folder != here and not (folder / "__init__.py").is_file()


def _imported_class(name: str) -> str:
    """Return the name of a class that needs an adapter; raise GarlError if there is none."""
    try:
        imported_system(name)
    except GarlError:
        module, _, qualified = name.partition(":")
        try:
            found = operator.attrgetter(qualified)(sys.modules.get(module))
        except AttributeError:
            found = None
        complete = all(callable(getattr(found, each, None)) for each in ("reset", "step"))
        if not isinstance(found, type) or complete:
            raise
        return name
    raise GarlError(f"--adapter: {name} has reset and step: garl init {name} writes its tests")


def _test_of(system: str, *, states_marker: bool) -> str:
    """Return the tests of a landing system, named as MODULE:CLASS.

    The one to begin with lands on the marker that the mission names.
    """
    module, _, qualified = system.partition(":")
    imports = IMPORT_WITH_MARKER if states_marker else IMPORT
    head = imports.format(module=module, name=qualified.partition(".")[0])
    return (
        head + (WITH_MARKER if states_marker else MARKED).format(system=qualified, more="") + TESTS
    )


def _test_of_program(line: str, here: Path, folder: Path) -> str:
    """Return the tests of a companion program, which runs in the folder of its line."""
    words = json.dumps(line, ensure_ascii=False)
    if folder != here:
        words += f',\n    folder="{Path(os.path.relpath(here, folder)).as_posix()}"'
    return (
        PROGRAM.format(words=words, python=_own_python(here))
        + WITH_MARKER.format(system="lander", more=START)
        + TESTS
    )


def _own_python(here: Path) -> str:
    """Return the line that names the Python of a virtual environment here that is not pytest's."""
    for name in ("venv", ".venv", "env"):
        if (here / name / "bin" / "python").exists() and not (here / name).samefile(sys.prefix):
            return f'\n    python="{name}/bin/python",'
    return ""


def _write_skeleton(file: Path) -> _Step:
    """Write the landing system to begin with; raise GarlError if another file has its name."""
    text = Path(skeleton.__file__).read_text(encoding="utf-8")
    name = SKELETON.partition(":")[2]
    if file.exists() and f"class {name}" not in _text_of(file):
        raise GarlError(
            f"{file.name}: is here and has no class {name}; name the class that is your landing "
            f"system: garl init {file.stem}:CLASS"
        )
    return _write(file, text)


def _copy_example(folder: Path) -> _Step:
    """Write the landing systems that come with the package, as they are; a folder stays."""
    package = Path(__file__).parents[1]
    source = next(
        each for each in (package / "example" / EXAMPLE, package.parent / EXAMPLE) if each.is_dir()
    )
    if folder.exists():
        return _Step(file=folder, done="unchanged")
    try:
        shutil.copytree(source, folder, ignore=shutil.ignore_patterns("__pycache__"))
    except OSError as error:
        raise GarlError(f"{folder}: cannot be written ({error})") from error
    return _Step(file=folder, done="wrote")


def _write(file: Path, text: str) -> _Step:
    """Write a file that is not there."""
    try:
        with file.open("x", encoding="utf-8") as opened:
            opened.write(text)
    except FileExistsError:
        return _Step(file=file, done="unchanged")
    except OSError as error:
        raise GarlError(f"{file}: cannot be written ({error})") from error
    return _Step(file=file, done="wrote")


def _ignore(file: Path) -> _Step:
    """Let git ignore the folder of runs, and in a new project what Python compiles."""
    if not file.exists():
        return _write(file, f"{IGNORED}\n__pycache__/\n")
    text = _text_of(file)
    if _KNOWN_IGNORES & {line.strip() for line in text.splitlines()}:
        return _Step(file=file, done="unchanged")
    end = "" if not text or text.endswith("\n") else "\n"
    try:
        with file.open("a", encoding="utf-8") as opened:
            opened.write(f"{end}{IGNORED}\n")
    except OSError as error:
        raise GarlError(f"{file}: cannot be written ({error})") from error
    return _Step(file=file, done="added to")


def _text_of(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise GarlError(f"{file}: cannot be read ({error})") from error
