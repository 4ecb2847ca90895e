"""``garl schema``: write the schemas by which an editor completes the files of pytest-garl."""

from __future__ import annotations

import json
from pathlib import Path

import click

from pytest_garl.cli.file_schemas import SCHEMAS
from pytest_garl.files.atomic import write_text_atomically

FOLDER = "schemas"


@click.command()
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=FOLDER,
    show_default=True,
    help="The folder.",
)
def schema(out: Path) -> None:
    """Write JSON schemas of files, for editors.

    They describe case, domain, map and scenario files. An editor with an extension for TOML
    completes such a file and explains its keys if the file begins with a line such as `#:schema
    schemas/domain.schema.json`, or if .taplo.toml names the schema of a folder (docs/editors.md).
    """
    for name, make in SCHEMAS.items():
        path = out / f"{name}.schema.json"
        write_text_atomically(path, json.dumps(make(), indent=1) + "\n")
        click.echo(f"wrote {path}")
