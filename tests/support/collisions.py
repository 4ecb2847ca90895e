"""A flight made by hand that ends in a collision with a person."""

from __future__ import annotations

import dataclasses

import numpy as np

from pytest_garl.flight.flight import Flight, ObjectRecord, Track
from tests.verdicts.flights import flight, hit

CONTACT_S = 30.0
TIMES = np.arange(0.0, CONTACT_S + 0.25, 0.5)


def track(x_m: np.ndarray, z_m: np.ndarray) -> Track:
    zeros = np.zeros_like(TIMES)
    return Track(
        time_s=TIMES,
        position_m=np.stack([x_m, zeros, z_m], axis=1),
        attitude=np.zeros((len(TIMES), 4)),
        velocity_mps=np.stack([np.gradient(x_m, TIMES), zeros, zeros], axis=1),
    )


def hits_a_person(speed_mps: float = 1.0) -> Flight:
    """Return a flight that sinks from 10 m and hits a person who walks towards it at 30 s."""
    sinking = np.maximum(1.0, 10.0 - 0.45 * np.maximum(0.0, TIMES - 10.0))
    person = ObjectRecord(
        name="person-1",
        type="person",
        track=track(speed_mps * (TIMES - CONTACT_S), np.zeros_like(TIMES)),
        moves=np.zeros((0, 2)),
    )
    return dataclasses.replace(
        flight("collision", (0.0, 0.0, 1.0)),
        uav=track(np.zeros_like(TIMES), sinking),
        objects=(person,),
        contacts=hit("person-1", "person", "dynamic"),
    )
