"""A program over MAVSDK: its package is real, its server is replaced, its time is the flight's.

``make test-dronekit`` installs it and sets DRONEKIT_PYTHON to the Python that has it.
"""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.airframe import Camera
from pytest_garl.companion.companion_program import CompanionProgram
from pytest_garl.npcs.domain_policy import domain_with_policy
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.search.probes import clear_scenario
from pytest_garl.simulation.fly import fly
from pytest_garl.vehicle.autopilot import ArduCopter
from pytest_garl.vehicle.px4 import Px4Copter
from tests.companion.processes import running, script

PYTHON = os.environ.get("DRONEKIT_PYTHON")
VALUES = """
    import enum

    class Named:
        def __init__(self, *values):
            self.values = values
    class ActionResult(Named):
        Result = enum.Enum("Result", "COMMAND_DENIED TIMEOUT")
    class ActionError(Exception):
        pass
    class Position(Named):
        pass
    class VelocityBodyYawspeed:
        forward_m_s, right_m_s, down_m_s, yawspeed_deg_s = 1.0, 0.0, 0.5, 90.0
"""
"""In place of MAVSDK's package: the classes that these calls take and return."""
CALLS = """
    import asyncio
    from mavsdk import System, action, offboard

    async def main():
        drone = System()
        await drone.connect("udp://:14540")
        async for position in drone.telemetry.position():
            print(position.values)
            break
        await drone.offboard.set_velocity_body(offboard.VelocityBodyYawspeed())
        try:
            await drone.action.arm()
        except action.ActionError as error:
            result, origin = error.args
            print(result.values[0].name, origin)
        try:
            drone.gimbal.set_angles
        except NotImplementedError as error:
            print(error)

    asyncio.run(main())
"""
LANDER = """
import asyncio, sys
from mavsdk import System
from mavsdk.offboard import OffboardError, PositionNedYaw, VelocityBodyYawspeed
from mavsdk.telemetry import LandedState

async def main():
    drone = System()
    await drone.connect(system_address="udp://:14540")
    async for state in drone.core.connection_state():
        if state.is_connected:
            break
    async for health in drone.telemetry.health():
        if health.is_global_position_ok and health.is_home_position_ok:
            break
    try:
        await drone.offboard.start()
    except OffboardError as error:
        print("refused:", error._result.result.name)
    await drone.action.arm()
    await drone.action.set_takeoff_altitude(6.0)
    await drone.action.takeoff()
    async for position in drone.telemetry.position():
        if position.relative_altitude_m > 5.5:
            break
    north, east = map(float, sys.argv[2:])
    await drone.offboard.set_position_ned(PositionNedYaw(north, east, -6.0, 0.0))
    await drone.offboard.start()
    # Nobody sets it again: the server repeats it.
    await asyncio.sleep(12.0)
    async for found in drone.telemetry.position_velocity_ned():
        at = found.position
        print("arrived", abs(at.north_m - north) < 0.1, abs(at.east_m - east) < 0.1)
        break
    await drone.offboard.set_velocity_body(VelocityBodyYawspeed(0.0, 0.0, 1.0, 0.0))
    await asyncio.sleep(2.0)
    print("armed", await drone.telemetry.armed().__anext__())
    print("in", (await drone.telemetry.flight_mode().__anext__()).name)
    await drone.param.set_param_float(sys.argv[1], 31.0)
    print("parameter", await drone.param.get_param_float(sys.argv[1]))
    try:
        drone.gimbal.set_angles
    except NotImplementedError as error:
        print(error)
    await drone.action.land()
    async for landed in drone.telemetry.landed_state():
        if landed is LandedState.ON_GROUND:
            break

asyncio.run(main())
"""


def test_calls_of_mavsdk_become_messages_and_messages_become_values(tmp_path: Path) -> None:
    (tmp_path / "mavsdk").mkdir()
    script(tmp_path, "", "mavsdk/__init__.py")
    for name in ("action", "offboard", "telemetry"):
        script(tmp_path, VALUES, f"mavsdk/{name}.py")
    d: Any = importlib.import_module("pymavlink.dialects.v20.ardupilotmega")
    vehicle = d.MAVLink(None, srcSystem=1, srcComponent=1)
    beat = d.MAVLink_heartbeat_message(2, 3, 209, 4, 4, 3).pack(vehicle)
    place = 470_000_000, 80_000_000, 590_000, 6_000
    told = d.MAVLink_global_position_int_message(0, *place, 0, 0, 0, 0).pack(vehicle)
    with running(tmp_path, CALLS) as simulator:
        simulator.fly(0.5)
        simulator.fly(4.0, data=beat + told)
        assert simulator.failure == ""
        assert simulator.printed.splitlines()[:2] == ["(47.0, 8.0, 590.0, 6.0)", "TIMEOUT arm()"]
        assert "System.gimbal.set_angles of MAVSDK is not there" in simulator.printed
    heard = d.MAVLink(None).parse_buffer(simulator.sent)
    kinds = [each.get_type() for each in heard]
    assert kinds.count("COMMAND_LONG") == 1
    assert kinds.count("HEARTBEAT") in (4, 5)
    setpoints = [each for each in heard if each.get_type() == "SET_POSITION_TARGET_LOCAL_NED"]
    # The server repeats it at 20 Hz while the program waits for the acknowledgement.
    assert 55 < len(setpoints) < 70
    last = setpoints[-1]
    assert (last.coordinate_frame, last.type_mask) == (d.MAV_FRAME_BODY_NED, 0x5C7)
    assert (last.vx, last.vz, round(last.yaw_rate, 2)) == (1.0, 0.5, 1.57)


@pytest.mark.skipif(PYTHON is None, reason="needs mavsdk's package: run make test-dronekit")
@pytest.mark.parametrize(
    ("vehicle", "parameter"),
    [(ArduCopter(), "LAND_SPEED"), (Px4Copter(), "RTL_RETURN_ALT")],
    ids=["ardupilot", "px4"],
)
def test_a_program_over_mavsdk_lands_and_flies_the_same_bytes_again(
    tmp_path: Path, vehicle: ArduCopter | Px4Copter, parameter: str
) -> None:
    script(tmp_path, LANDER, "sdk_lander.py")
    program = CompanionProgram(
        f"python sdk_lander.py {parameter} {{north_m}} {{east_m}}",
        folder=tmp_path,
        camera=Camera(width_px=32, height_px=24),
        vehicle=vehicle,
        python=PYTHON,
    )
    map = load_map("lawn")
    task = Task(marker=map.marker, start=Start())
    scenario = clear_scenario(map, task, domain_with_policy("calm", tmp_path))
    first, second = (fly(scenario, program, policy_spec("stationary"), map=map) for _ in range(2))
    notes = "\n".join(each.diagnostics.note for each in first.steps if each.diagnostics)
    assert first.crash is None
    for said in (
        "refused: NO_SETPOINT_SET",
        "arrived True True",
        "armed True",
        "in OFFBOARD",
        "parameter 31.0",
    ):
        assert said in notes
    assert "System.gimbal.set_angles of MAVSDK is not there" in notes
    assert first.touchdown is not None
    assert first.touchdown.distance_m < 0.3
    assert first.sha256 == second.sha256
