"""Poses between two samples are interpolated."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_garl import Camera
from pytest_garl.flight.flight import Track
from pytest_garl.reports.film.pose import path_until, poses_at
from tests.support.videos import Video


def test_poses_between_two_samples_are_interpolated(video: Video) -> None:
    uav = Track(
        time_s=np.array([0.0, 1.0]),
        position_m=np.array([[0.0, 0.0, 1.0], [2.0, 4.0, 1.0]]),
        # A quarter turn about z, written with the other sign.
        attitude=np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -(0.5**0.5), -(0.5**0.5)]]),
        velocity_mps=np.zeros((2, 3)),
    )
    flight = dataclasses.replace(video.flight, uav=uav, objects=())
    middle = poses_at(flight, 0.5)
    assert middle.position_m == pytest.approx((1.0, 2.0, 1.0))
    assert middle.attitude == pytest.approx((0, 0, math.sin(math.pi / 8), math.cos(math.pi / 8)))
    assert middle.eye_m(Camera()) == pytest.approx((1.0, 2.0, 0.95))
    assert poses_at(flight, 9.0).position_m == (2.0, 4.0, 1.0)
    assert path_until(uav, 0.5).tolist() == [[0.0, 0.0, 1.0], [1.0, 2.0, 1.0]]
