from __future__ import annotations

import math

import pytest

from pytest_garl.flight.thresholds import feet_height_m
from tests.reports.mcap.conftest import Exported
from tests.support.mcap_files import decoded, needs_extra

needs_extra()


def test_protobuf_reads_schema_and_values() -> None:
    from pytest_garl.reports.mcap.numbers import Numbers

    # More than fifteen fields have tags of two bytes, and a long name a length of two bytes.
    values = {f"number_{index}": index / 3 for index in range(40)}
    values |= {"x" * 200: -math.inf, "unknown": math.nan}
    message = Numbers(name="Facts", values=values)
    schema = message.get_schema()
    assert (schema.name, schema.encoding) == ("pytest_garl.Facts", "protobuf")
    found = decoded(message)
    assert [each.name for each in found.DESCRIPTOR.fields] == list(values)
    for name, value in values.items():
        assert getattr(found, name) == pytest.approx(value, nan_ok=True)


def test_states_are_those_of_the_record(exported: Exported) -> None:
    flight, recording = exported.flight, exported.recording
    track = flight.uav
    assert len(recording.topics["/state"]) == len(recording.topics["/margins"]) == len(track.time_s)
    for index, time_s in enumerate(track.time_s):
        state = recording.at("/state", round(time_s * 1e9))
        x, y, z = track.position_m[index]
        assert max(0.0, state.height_m) == pytest.approx(feet_height_m(z))
        assert state.to_marker_m == pytest.approx(math.dist((x, y), flight.marker_position_m))
        assert state.up_mps == track.velocity_mps[index, 2]
        margins = recording.at("/margins", round(time_s * 1e9))
        assert margins.time_s == pytest.approx(120 - time_s)
        assert margins.distance_m == pytest.approx(0.75 - state.to_marker_m)
        assert margins.moving_m == state.to_nearest_npc_m


def test_sights_are_those_of_the_steps(exported: Exported) -> None:
    flight, recording = exported.flight, exported.recording
    assert len(recording.topics["/sight"]) == len(flight.steps)
    for step in flight.steps:
        sight = recording.at("/sight", round(step.time_s * 1e9))
        found = step.diagnostics.detections if step.diagnostics else ()
        assert sight.marker_visible == step.marker_visible
        assert sight.reported_markers == len(found)
        assert math.isnan(sight.target_off_m) == (not found)
        assert math.isnan(sight.rangefinder_m) == (step.rangefinder_m is None)
