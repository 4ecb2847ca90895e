"""``garl domain``: show operational domains."""

from __future__ import annotations

import math
from pathlib import Path

import click

from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.scenarios.domains.domain import ABSENT, CONDITIONS, ELEVATION, Domain
from pytest_garl.scenarios.domains.genome import genome_of
from pytest_garl.scenarios.domains.names import BUILT_IN, DEFAULT_DOMAIN
from pytest_garl.scenarios.genes import CONFINED_WEATHER
from pytest_garl.scenarios.groups import GROUPS, WEATHER
from pytest_garl.scenarios.light import NOON_DEG, TWILIGHT_DEG
from pytest_garl.scenarios.maps.loading import load_map, map_names
from pytest_garl.scenarios.quantities import unit_of
from pytest_garl.scenarios.story import GRADES
from pytest_garl.scenarios.use_file import use_text

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
    """Show the conditions in which a system is to land.

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
    """Show each range of a domain, with its source.

    NAME is a domain that comes with pytest-garl, or a TOML file.
    """
    click.echo(text_of(domain_with_policy(name, Path.cwd())), nl=False)


@domain.command()
@click.argument("name", default=DEFAULT_DOMAIN)
def use(name: str) -> None:
    """Print a model of use of a domain, to edit.

    It states how often each condition and NPC occurs where you land, as --garl-method=use and `garl
    risk` need it. Its numbers are an example, and none is claimed to be true. NAME is a domain that
    comes with pytest-garl, or a TOML file.
    """
    found, folders = domain_with_policy(name, Path.cwd()), (Path.cwd() / "scenarios" / "maps",)
    maps = [load_map(each, folders) for each in map_names(folders)]
    click.echo(use_text(found.name, [(genome_of(found, each), each) for each in maps]), nl=False)


def text_of(domain: Domain) -> str:
    """Return a domain for people: every range with unit, meaning and source."""
    npcs = {ABSENT: "none"}.get(domain.npc_behaviour, domain.npc_behaviour)
    npcs = f"up to {npcs}" if npcs in GRADES[1:] else npcs
    lines = [f"domain {domain.name}: NPCs {npcs}{' or as the method says' * bool(domain.paper)}"]
    lines += ["The marker lies anywhere within 7.5 m of the middle of its place on the map."]
    ranges = ranges_of(domain)
    for group in dict.fromkeys(key.partition(".")[0] for key, _, _ in ranges):
        meaning = GROUPS[group].meaning if group in GROUPS else ""
        lines += ["", f"{group}: {_HEADS.get(group) or meaning}"]
        for key, low, high in ranges:
            if key.partition(".")[0] == group:
                condition, title = CONDITIONS[key], key.partition(".")[2]
                lines.append(f"  {title}: {range_in_words(title, low, high)}")
                lines.append(f"    {condition.meaning}; nominal {condition.nominal:g}")
                lines.append(f"    source: {condition.source}")
    return "\n".join(lines) + "\n"


def ranges_of(domain: Domain) -> tuple[tuple[str, float, float], ...]:
    """Return (condition, lowest, highest) of all that varies; the paper's genes in units."""
    if not domain.paper:
        return domain.ranges
    top = CONFINED_WEATHER if domain.paper == "confined" else 1.0
    weather = [
        (each.key, each.at(top), math.inf)
        if each.scale == "inverse"
        else (each.key, 0.0, each.at(top))
        for each in WEATHER.values()
    ]
    return (*weather, (ELEVATION, TWILIGHT_DEG, NOON_DEG))


def range_in_words(name: str, low: float, high: float) -> str:
    """Return a range with the unit that the condition's name ends with."""
    unit = f" {unit_of(name)}".rstrip()
    if math.isinf(high):
        return f"{low:g}{unit} and more"
    return f"always {low:g}{unit}" if low == high else f"{low:g} to {high:g}{unit}"
