"""MAVSDK's ``System`` for a program: its calls over MAVLink, in the flight's time.

The real one is a server in C++ with threads and a clock of its own, which no flight can hold.  Its
Python package stays: the classes of its values and errors are what the calls take and return.
"""

from __future__ import annotations

import asyncio
import importlib
import math
import threading
import time
from collections.abc import AsyncIterator, Callable
from typing import Any

ADDRESS = "tcp:127.0.0.1:5760"
"""The vehicle listens here, whatever address a program gives."""
ACK_S = 3.0
STREAM_S = 0.05
"""How often the server repeats a setpoint."""
GUIDED, OFFBOARD = 4, 6
PX4, NO_AUTOPILOT, GROUND_STATION = 12, 8, 6
_modules_own: Any = asyncio
"""Before Python 3.11 its ``TimeoutError`` was another one."""
_ANSWERS = {"COMMAND_ACK": "command", "PARAM_VALUE": "param_id"}
"""Messages that answer one of the program, and the field that says which."""
_MODES = {
    "OFFBOARD": "OFFBOARD",
    "GUIDED": "OFFBOARD",
    "LAND": "LAND",
    "RTL": "RETURN_TO_LAUNCH",
    "LOITER": "HOLD",
    "TAKEOFF": "TAKEOFF",
    "POSCTL": "POSCTL",
    "STABILIZE": "STABILIZED",
}


class Server:
    """The link to the vehicle in its own thread: it repeats setpoints while others compute."""

    def __init__(self, package: str) -> None:
        self._package = package
        self._listeners: list[tuple[str, Any, Any]] = []
        self._asked: dict[tuple[str, Any], Callable[[Any], object]] = {}
        self._newest: dict[str, Any] = {}
        self.link: Any = None
        self.setpoint: tuple[Any, ...] | None = None
        self.takeoff_m = 2.5

    def connect(self) -> None:
        """Open the link; all that is heard is kept for who asks later."""
        mavutil = importlib.import_module("pymavlink.mavutil")
        self.link = mavutil.mavlink_connection(ADDRESS, source_system=245, source_component=190)
        threading.Thread(target=self._serve, daemon=True).start()

    def module(self, name: str) -> Any:
        """Return a module of MAVSDK's package."""
        return importlib.import_module(f"{self._package}.{name}")

    @property
    def is_px4(self) -> bool:
        """Whether the vehicle's autopilot is PX4."""
        beat = self._newest.get("HEARTBEAT")
        return beat is not None and bool(beat.autopilot == PX4)

    def _serve(self) -> None:
        stream_s = beat_s = 0.0
        while True:
            message = self.link.recv_match(blocking=True, timeout=STREAM_S / 2)
            if message is not None:
                self._take(message)
            now_s = time.monotonic()
            if now_s >= beat_s:
                beat_s = now_s + 1.0
                self.link.mav.heartbeat_send(GROUND_STATION, NO_AUTOPILOT, 0, 0, 0)
            if now_s >= stream_s:
                stream_s = now_s + STREAM_S
                self.send_setpoint()

    def _take(self, message: Any) -> None:
        kind = message.get_type()
        answers = _ANSWERS.get(kind)
        if answers is not None:
            answer = self._asked.pop((kind, getattr(message, answers)), None)
            if answer is not None:
                answer(message)
        self._newest[kind] = message
        for wanted, loop, queue in list(self._listeners):
            if kind == wanted:
                loop.call_soon_threadsafe(queue.put_nowait, message)

    def send_setpoint(self) -> None:
        """Send the setpoint of the moment, if there is one."""
        if self.setpoint is not None:
            self.link.mav.set_position_target_local_ned_send(0, 1, 1, *self.setpoint)

    async def messages(self, kind: str) -> AsyncIterator[Any]:
        """Yield the messages of a kind, and first the one that came last."""
        queue: asyncio.Queue[Any] = asyncio.Queue()
        if kind in self._newest:
            queue.put_nowait(self._newest[kind])
        listener = (kind, asyncio.get_running_loop(), queue)
        self._listeners.append(listener)
        try:
            while True:
                yield await queue.get()
        finally:
            self._listeners.remove(listener)

    async def reply(self, kind: str, key: Any, send: Callable[[], None]) -> Any:
        """Send something, and return the message that answers it, or None."""
        loop = asyncio.get_running_loop()
        future = loop.create_future()

        def arrived(message: Any) -> None:
            if not future.done():
                future.set_result(message)

        self._asked[kind, key] = lambda message: loop.call_soon_threadsafe(arrived, message)
        send()
        try:
            return await asyncio.wait_for(future, ACK_S)
        except _modules_own.TimeoutError:
            return None

    async def command(self, plugin: str, origin: str, number: int, *values: float) -> None:
        """Send a command, and wait for its acknowledgement; raise the plugin's error otherwise."""
        numbers = (*values, *[0.0] * (7 - len(values)))
        answer = await self.reply(
            "COMMAND_ACK",
            number,
            lambda: self.link.mav.command_long_send(1, 1, number, 0, *numbers),
        )
        if answer is None or answer.result != 0:
            raise self.error(plugin, origin, "COMMAND_DENIED" if answer else "TIMEOUT")

    def error(self, plugin: str, origin: str, kind: str) -> Exception:
        """Return an error of a plugin as MAVSDK raises it."""
        module, name = self.module(plugin), plugin.capitalize()
        result = getattr(module, f"{name}Result")
        found = result(result.Result[kind], kind.replace("_", " ").capitalize())
        error: Exception = getattr(module, f"{name}Error")(found, f"{origin}()")
        return error

    async def set_mode(self, plugin: str, origin: str, px4: tuple[int, int], other: int) -> None:
        """Enter a mode by its numbers in PX4 and in ArduPilot."""
        await self.command(plugin, origin, 176, 1, *(px4 if self.is_px4 else (other,)))


class Plugin:
    """A part of ``System``; what it does not have is refused by name."""

    def __init__(self, server: Server, name: str) -> None:
        self._server, self._name = server, name

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name.startswith("set_rate_"):
            return self._nothing
        raise NotImplementedError(
            f"System.{self._name}.{name} of MAVSDK is not there in a flight; the calls that are, "
            "are in docs/your-stack.md of pytest-garl"
        )

    async def _nothing(self, *_: Any) -> None:
        """Change no rate: all are sent often enough."""


class Core(Plugin):
    """MAVSDK's ``core``."""

    async def connection_state(self) -> AsyncIterator[Any]:
        async for _ in self._server.messages("HEARTBEAT"):
            yield self._server.module("core").ConnectionState(True)


class Action(Plugin):
    """MAVSDK's ``action``."""

    async def arm(self) -> None:
        await self._server.command("action", "arm", 400, 1)

    async def disarm(self) -> None:
        await self._server.command("action", "disarm", 400, 0)

    async def takeoff(self) -> None:
        server, height_m = self._server, self._server.takeoff_m
        if server.is_px4:
            home = await server.messages("HOME_POSITION").__anext__()
            height_m += home.altitude / 1000
        else:
            await server.set_mode("action", "takeoff", (0, 0), GUIDED)
        await server.command("action", "takeoff", 22, 0, 0, 0, math.nan, 0, 0, height_m)

    async def land(self) -> None:
        await self._server.command("action", "land", 21)

    async def return_to_launch(self) -> None:
        await self._server.command("action", "return_to_launch", 20)

    async def hold(self) -> None:
        await self._server.set_mode("action", "hold", (4, 3), 5)

    async def set_takeoff_altitude(self, altitude: float) -> None:
        self._server.takeoff_m = altitude

    async def get_takeoff_altitude(self) -> float:
        return self._server.takeoff_m


class Offboard(Plugin):
    """MAVSDK's ``offboard``: a setpoint is repeated until the next one."""

    def _set(self, frame: int, mask: int, *values: float) -> None:
        known = [value if math.isfinite(value) else 0.0 for value in values]
        if not math.isfinite(values[-2]):
            mask |= 0x400
        self._server.setpoint = (frame, mask, *known)
        self._server.send_setpoint()

    async def set_position_ned(self, p: Any) -> None:
        place, yaw = (p.north_m, p.east_m, p.down_m), math.radians(p.yaw_deg)
        self._set(1, 0x9F8, *place, *[0.0] * 6, yaw, 0.0)

    async def set_velocity_ned(self, v: Any) -> None:
        speed, yaw = (v.north_m_s, v.east_m_s, v.down_m_s), math.radians(v.yaw_deg)
        self._set(1, 0x9C7, 0.0, 0.0, 0.0, *speed, 0.0, 0.0, 0.0, yaw, 0.0)

    async def set_position_velocity_ned(self, p: Any, v: Any) -> None:
        place, yaw = (p.north_m, p.east_m, p.down_m), math.radians(p.yaw_deg)
        speed = (v.north_m_s, v.east_m_s, v.down_m_s)
        self._set(1, 0x9C0, *place, *speed, 0.0, 0.0, 0.0, yaw, 0.0)

    async def set_velocity_body(self, v: Any) -> None:
        speed, rate = (v.forward_m_s, v.right_m_s, v.down_m_s), math.radians(v.yawspeed_deg_s)
        self._set(8, 0x5C7, 0.0, 0.0, 0.0, *speed, 0.0, 0.0, 0.0, 0.0, rate)

    async def start(self) -> None:
        if self._server.setpoint is None:
            raise self._server.error("offboard", "start", "NO_SETPOINT_SET")
        # The vehicle has received the stream when it gets the command to enter the mode.
        await asyncio.sleep(2 * STREAM_S)
        await self._server.set_mode("offboard", "start", (OFFBOARD, 0), GUIDED)

    async def stop(self) -> None:
        self._server.setpoint = None
        await self._server.set_mode("offboard", "stop", (4, 3), 5)

    async def is_active(self) -> bool:
        return self._server.setpoint is not None


class Param(Plugin):
    """MAVSDK's ``param``."""

    async def set_param_float(self, name: str, value: float) -> None:
        self._server.link.mav.param_set_send(1, 1, name.encode(), value, 9)

    set_param_int = set_param_float

    async def get_param_float(self, name: str) -> float:
        mav = self._server.link.mav
        answer = await self._server.reply(
            "PARAM_VALUE", name, lambda: mav.param_request_read_send(1, 1, name.encode(), -1)
        )
        if answer is None:
            raise self._server.error("param", "get_param", "TIMEOUT")
        return float(answer.param_value)

    async def get_param_int(self, name: str) -> int:
        return int(await self.get_param_float(name))


_TELEMETRY: dict[str, tuple[str, Callable[[Any, Any], Any]]] = {
    "position": (
        "GLOBAL_POSITION_INT",
        lambda t, m: t.Position(m.lat / 1e7, m.lon / 1e7, m.alt / 1000, m.relative_alt / 1000),
    ),
    "home": (
        "HOME_POSITION",
        lambda t, m: t.Position(m.latitude / 1e7, m.longitude / 1e7, m.altitude / 1000, 0.0),
    ),
    "heading": ("GLOBAL_POSITION_INT", lambda t, m: t.Heading(m.hdg / 100)),
    "velocity_ned": ("LOCAL_POSITION_NED", lambda t, m: t.VelocityNed(m.vx, m.vy, m.vz)),
    "position_velocity_ned": (
        "LOCAL_POSITION_NED",
        lambda t, m: t.PositionVelocityNed(
            t.PositionNed(m.x, m.y, m.z), t.VelocityNed(m.vx, m.vy, m.vz)
        ),
    ),
    "attitude_euler": (
        "ATTITUDE",
        lambda t, m: t.EulerAngle(
            *map(math.degrees, (m.roll, m.pitch, m.yaw)), 1000 * m.time_boot_ms
        ),
    ),
    "distance_sensor": (
        "DISTANCE_SENSOR",
        lambda t, m: t.DistanceSensor(
            *(each / 100 for each in (m.min_distance, m.max_distance, m.current_distance)),
            t.EulerAngle(0.0, -90.0, 0.0, 0),
        ),
    ),
    "health": ("SYS_STATUS", lambda t, _: t.Health(*[True] * 7)),
    "health_all_ok": ("SYS_STATUS", lambda *_: True),
    "armed": ("HEARTBEAT", lambda _, m: bool(m.base_mode & 128)),
    "in_air": ("EXTENDED_SYS_STATE", lambda _, m: m.landed_state in (2, 3, 4)),
    "landed_state": ("EXTENDED_SYS_STATE", lambda t, m: t.LandedState(m.landed_state)),
    "flight_mode": (
        "HEARTBEAT",
        lambda t, m: t.FlightMode[_MODES.get(_mode_of(m), "UNKNOWN")],
    ),
    "status_text": (
        "STATUSTEXT",
        lambda t, m: t.StatusText(t.StatusTextType.INFO, m.text.strip("\0")),
    ),
}
"""What MAVSDK's ``telemetry`` tells: for each call the message, and the value that it becomes."""


def _mode_of(beat: Any) -> str:
    return str(importlib.import_module("pymavlink.mavutil").mode_string_v10(beat))


class Telemetry(Plugin):
    """MAVSDK's ``telemetry``."""

    def __getattr__(self, name: str) -> Any:
        if name not in _TELEMETRY:
            return super().__getattr__(name)
        kind, convert = _TELEMETRY[name]

        async def told() -> AsyncIterator[Any]:
            module = self._server.module("telemetry")
            async for message in self._server.messages(kind):
                yield convert(module, message)

        return told


def change_mavsdk(module: Any) -> None:
    """Give MAVSDK's package a ``System`` that flies in the flight's time."""
    plugins = {
        "core": Core,
        "action": Action,
        "offboard": Offboard,
        "param": Param,
        "telemetry": Telemetry,
    }

    class System:
        """The vehicle, as MAVSDK has it."""

        def __init__(self, *_: Any, **__: Any) -> None:
            self._server = Server(module.__name__)
            for name, plugin in plugins.items():
                setattr(self, name, plugin(self._server, name))

        def __getattr__(self, name: str) -> Any:
            return Plugin(self._server, name)

        async def connect(self, *_: Any, **__: Any) -> None:
            self._server.connect()

    module.System = System
