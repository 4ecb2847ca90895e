from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from pytest_garl.flight.flight import Track
from pytest_garl.reports.film.pose import poses_at
from pytest_garl.simulation.camera.meshes import rotation_matrix
from pytest_garl.simulation.camera.projection import View
from tests.reports.mcap.conftest import Exported
from tests.support.mcap_files import matrix_to_world, needs_extra
from tests.support.videos import Hovers

needs_extra()


def test_poses_are_those_of_the_record(exported: Exported) -> None:
    flight, recording = exported.flight, exported.recording
    tracks = {"uav": flight.uav} | {item.name: item.track for item in flight.objects}
    assert len(tracks) == 4
    for name, track in tracks.items():
        for index, time_s in enumerate(track.time_s):
            matrix = matrix_to_world(recording.at("/tf", round(time_s * 1e9)), name)
            assert matrix[:3, 3] == pytest.approx(track.position_m[index], abs=1e-12)
            turn = tuple(track.attitude[index].tolist())
            assert matrix[:3, :3] == pytest.approx(rotation_matrix(turn), abs=1e-9)


def test_there_are_poses_of_the_camera_at_each_picture(exported: Exported) -> None:
    flight, recording = exported.flight, exported.recording
    for time_ns, _ in recording.topics["/camera/image"]:
        matrix = matrix_to_world(recording.at("/tf", time_ns), "camera")
        poses = poses_at(flight, time_ns / 1e9)
        camera = Hovers.airframe.camera
        view = View.of(camera, poses.eye_m(camera), poses.attitude)
        assert matrix[:3, 3] == pytest.approx(view.eye, abs=1e-9)
        # Right, down and forward are the columns of one matrix and the rows of the other.
        assert matrix[:3, :3] == pytest.approx(view.axes.T, abs=1e-9)
        assert matrix[2, 2] < -0.9


def test_each_message_holds_all_frames_and_each_time_is_there_once(exported: Exported) -> None:
    messages = exported.recording.topics["/tf"]
    times = [time_ns for time_ns, _ in messages]
    assert len(set(times)) == len(times)
    for time_ns, message in messages:
        pairs = [(each.parent_frame_id, each.child_frame_id) for each in message.transforms]
        assert pairs == [
            ("world", "uav"),
            ("world", "person-1"),
            ("world", "person-2"),
            ("world", "dog-1"),
            ("uav", "camera"),
        ]
        assert {each.timestamp.ToNanoseconds() for each in message.transforms} == {time_ns}


def test_attitudes_between_samples_take_the_shorter_turn() -> None:
    from pytest_garl.reports.mcap.transforms import sampled

    quarter = [0.0, 0.0, math.sin(math.pi / 8), math.cos(math.pi / 8)]
    track = Track(
        time_s=np.array([0.0, 1.0, 2.0]),
        position_m=np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 0.0, 4.0]]),
        attitude=np.array([quarter, [-each for each in quarter], quarter]),
        velocity_mps=np.zeros((3, 3)),
    )
    places, turns = sampled(track, np.array([0.5, 1.5]))
    assert places.tolist() == [[1.0, 0.0, 0.0], [2.0, 0.0, 2.0]]
    assert np.abs(turns) == pytest.approx(np.array([quarter, quarter]))
    unknown = dataclasses.replace(track, attitude=np.zeros((3, 4)))
    assert sampled(unknown, np.array([0.5]))[1].tolist() == [[0.0, 0.0, 0.0, 1.0]]
