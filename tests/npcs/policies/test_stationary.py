from __future__ import annotations

from tests.support.situations import walk


def test_a_stationary_npc_stays_where_it_starts() -> None:
    assert set(walk("stationary", (-4.0, 1.0), 5)) == {(-4.0, 1.0)}
