"""``garl client``: copy the other side of the protocol into a project."""

from __future__ import annotations

from pathlib import Path

import click

FILES = {
    "python": ("garl_client.py",),
    "cpp": ("garl.hpp",),
    "ros2": ("garl_client.py", "garl_ros2.py"),
}
"""The files of each language, in ``external/clients/``."""
_HOME = Path(__file__).parents[1] / "external" / "clients"


@click.command()
@click.argument("languages", metavar="python|cpp|ros2", nargs=-1, required=True)
def client(languages: tuple[str, ...]) -> None:
    """Write the file by which a program of yours flies.

    It goes into the current folder. python: garl_client.py, one module for Python 3.8 or later
    without dependencies. cpp: garl.hpp, one header for C++17. ros2: garl_ros2.py too, which stands
    between pytest-garl and a ROS 2 node. A file of an earlier version is replaced. A test flies the
    program by system=pytest_garl.ExternalProgram([...]); docs/protocol.md says what it reads and
    writes.
    """
    unknown = [each for each in languages if each not in FILES]
    if unknown:
        raise click.UsageError(f"there is no {unknown[0]!r}; expected {', '.join(FILES)}")
    for name in dict.fromkeys(name for each in languages for name in FILES[each]):
        text, target = (_HOME / name).read_text(), Path(name)
        known = target.read_text(errors="replace") if target.exists() else None
        if known != text:
            target.write_text(text)
        done = "wrote" if known is None else "kept" if known == text else "updated"
        click.echo(f"{done:<10} {name}")
