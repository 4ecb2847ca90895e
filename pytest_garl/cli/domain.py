"""``garl domain``: show operational domains."""

from __future__ import annotations

import math
from pathlib import Path

import click

from pytest_garl.scenarios.domains.domain import ABSENT, CONDITIONS, Domain
from pytest_garl.scenarios.domains.names import BUILT_IN, DEFAULT_DOMAIN
from pytest_garl.scenarios.domains.reader import domain_named
from pytest_garl.scenarios.groups.catalogue import GROUPS
from pytest_garl.scenarios.units import unit_of

MEANINGS = {
    "field": "what a landing system in the field meets",
    "calm": "fair weather, light wind, nothing broken: where every system should land",
    "paper": "the world of the paper: eight weather genes, the sun, hostile objects",
}
"""What each built-in domain is for."""
_HEADS = {
    "weather": "weather",
    "light": "the sun, which may stand in any direction",
    "npcs": "persons, dogs and birds",
}


@click.group()
def domain() -> None:
    """Show operational domains: the conditions in which a system is to land.

    A test names one as domain="field" in its marker, a run as --garl-domain=NAME or FILE.
    """


@domain.command("list")
def list_domains() -> None:
    """List the domains that come with pytest-garl."""
    for name in BUILT_IN:
        default = " (default)" if name == DEFAULT_DOMAIN else ""
        click.echo(f"{name}: {MEANINGS[name]}{default}")


@domain.command()
@click.argument("name", default=DEFAULT_DOMAIN)
def show(name: str) -> None:
    """Show each range of the domain NAME, or of a TOML file, with its meaning and source."""
    click.echo(text_of(domain_named(name, Path.cwd())), nl=False)


def text_of(domain: Domain) -> str:
    """Return a domain for people: every range with unit, meaning and source."""
    npcs = "none" if domain.npc_behaviour == ABSENT else domain.npc_behaviour
    lines = [f"domain {domain.name}: NPCs {npcs}"]
    if domain.paper:
        top = "0.15" if domain.paper == "confined" else "1"
        lines += [
            f"The world of the paper: eight weather genes in [0, {top}], the sun on its way over",
            "the day, a marker within 7.5 m of the told coordinate, all objects there.",
        ]
        return "\n".join(lines) + "\n"
    for group in domain.groups:
        meaning = GROUPS[group].meaning if group in GROUPS else ""
        lines += ["", f"{group}: {_HEADS.get(group) or meaning}"]
        for key, low, high in domain.ranges:
            if key.partition(".")[0] == group:
                condition, title = CONDITIONS[key], key.partition(".")[2]
                unit = unit_of(title)
                lines.append(f"  {title}: {_range(low, high)} {unit}".rstrip())
                lines.append(f"    {condition.meaning}; nominal {condition.nominal:g}")
                lines.append(f"    source: {condition.source}")
    return "\n".join(lines) + "\n"


def _range(low: float, high: float) -> str:
    if low == high:
        return f"always {low:g}"
    return f"{low:g} and more" if math.isinf(high) else f"{low:g} to {high:g}"
