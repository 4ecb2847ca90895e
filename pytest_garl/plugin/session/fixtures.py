"""The fixtures of a landing test: landing, scenario, npcs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.plugin.items.abort import abort_session
from pytest_garl.plugin.items.keys import BODY_RUNS, LANDING, NO_PARAMETERS, RUN

if TYPE_CHECKING:
    from pytest_garl.plugin.items.landing import Landing
    from pytest_garl.plugin.items.target import Target
    from pytest_garl.scenarios.scenario import Scenario
    from pytest_garl.simulation.npc_policy import PolicySpec


@pytest.fixture
def garl_slot(request: pytest.FixtureRequest) -> Target:
    """Return the slot of the item."""
    target: Target | str | None = getattr(request, "param", None)
    if target is None:
        pytest.fail(f"{request.node.nodeid}: {NO_PARAMETERS}", pytrace=False)
    if isinstance(target, str):
        pytest.skip(target)
    if target.broken:
        pytest.fail(target.broken, pytrace=False)
    return target


@pytest.fixture(scope="session")
def npcs(request: pytest.FixtureRequest) -> PolicySpec | None:
    """Return the NPC policy of ``--garl-npcs``, or None for the one of the test's domain.

    Where NPCs may interfere, as in the domain field, that is graded: a learned director decides
    when curious and chasing NPCs begin and events strike.  Override this fixture in a conftest.py
    to choose another.
    """
    from pytest_garl.npcs.policy_catalogue import policy_spec

    run = request.config.stash.get(RUN, None)
    return policy_spec(run.options.npcs) if run and run.options.npcs else None


@pytest.fixture
def landing(request: pytest.FixtureRequest, garl_slot: Target, npcs: PolicySpec | None) -> Landing:
    """Return the landing of the item's slot; wait until it is flown."""
    from pytest_garl.plugin.items.item_record import ItemRecord
    from pytest_garl.plugin.items.landing import Landing
    from pytest_garl.plugin.session.item_facts import another_test_fails, is_known_case
    from pytest_garl.plugin.session.item_report import end_unjudged

    run = request.config.stash[RUN]
    try:
        flight = run.fly(garl_slot, _checked_policy(npcs))
    except GarlError as error:
        abort_session(request.node, error)
    item, result = request.node, flight.result
    landing = Landing(
        garl_slot,
        flight,
        getattr(item, "obj", None),
        is_shown_elsewhere=lambda: another_test_fails(run, garl_slot, flight),
    )
    entry = garl_slot.entry
    renewable = entry.path.name if entry is not None and run.prove_reference(garl_slot) else ""
    ItemRecord(
        flight=garl_slot.flight_key,
        outcome=result.outcome,
        signature=result.signature,
        story=result.verdict.story,
        excuse=result.verdict.excuse_text or result.verdict.excuse,
        final_distance_m=result.final_distance_m,
        elapsed_s=result.elapsed_s,
        trajectory_sha256=flight.sha256,
        expected=is_known_case(run, garl_slot, result),
        outside=garl_slot.outside_domain(run.options.map_folders),
        unproven="; ".join(run.unproven(garl_slot)),
        renewable=renewable,
    ).add_to(item)
    item.stash[LANDING] = landing
    if item.stash.get(BODY_RUNS, False):
        # Asked for by the test's body, which must not go on.
        end_unjudged(item)
    return landing


@pytest.fixture
def scenario(request: pytest.FixtureRequest, garl_slot: Target, landing: Landing) -> Scenario:
    """Return the scenario of the item's flight, which is flown as for ``landing``."""
    del landing
    run = request.config.stash[RUN]
    scenario: Scenario = run.scenario(garl_slot)
    return scenario


def _checked_policy(given: object) -> PolicySpec | None:
    """Return what the fixture ``npcs`` names; raise PolicyError for what names no policy."""
    from pytest_garl.errors import PolicyError
    from pytest_garl.npcs.policy_catalogue import policy_spec
    from pytest_garl.simulation.npc_policy import PolicySpec

    if given is None:
        return None
    if isinstance(given, str):
        return policy_spec(given)
    if not isinstance(given, PolicySpec):
        raise PolicyError(
            f"fixture npcs: found {given!r}, expected the name of a policy as --garl-npcs takes it "
            "('waypoint'), the path of weights (.npz), or a pytest_garl PolicySpec"
        )
    return given
