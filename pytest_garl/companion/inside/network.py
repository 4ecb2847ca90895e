"""Sockets, ``select`` and serial ports as queues in this process, and the vehicle at their end."""

from __future__ import annotations

import collections
import errno
import math
import os
import select
import selectors
import socket
import sys
import types
from collections.abc import Callable
from typing import Any, TypeVar, cast

from .turns import Task, Turns

T = TypeVar("T")

POLL_S = 100e-6
"""What a look at an empty socket takes: loops that poll shall end."""
PIPE_S = 1e-3
"""How often a pipe is looked at that may have something to read."""
VEHICLE_PORTS = (*range(5760, 5780), *range(14500, 14700))
"""Where the vehicle listens, and where a program that listens hears it: MAVLink's usual ports."""
VEHICLE = ("127.0.0.1", 14555)
LARGEST = 65_507
MOST_SENT = 200_000
"""Bytes to the vehicle in one exchange: no serial port carries a tenth of it."""
_modules_own: Any = socket
"""Before Python 3.10 its ``timeout`` was no ``TimeoutError``."""
Address = tuple[str, int]
_RealSocket = socket.socket
_real_select = select.select
_virtual = (socket.AF_INET, socket.AF_INET6, socket.AF_UNIX)


class Network:
    """All sockets of the program; ``outbox`` is what it has sent to the vehicle.

    ``line`` returns the program's line that is running.
    """

    def __init__(self, turns: Turns, line: Callable[[], str]) -> None:
        self.turns, self._line = turns, line
        self.outbox = bytearray()
        self.senders: list[tuple[int, str]] = []
        """Where in the outbox what a line has sent begins, and the line."""
        self.sockets: dict[int, Socket] = {}
        self.bound: dict[tuple[int, Any], Socket] = {}
        self.to_vehicle: list[Socket] = []
        """The ends of links to the vehicle, in the order in which they were opened."""
        self.pipes: set[int] = set()
        """Ends of pipes among the program's own threads."""
        self.mailboxes: list[bytearray] = []
        """Of other processes that the program has started."""
        self._port = 40_000

    def deliver(self, data: bytes) -> None:
        """Give bytes of the vehicle to all its links."""
        for box in self.mailboxes:
            box += data
        if data:
            for each in list(self.to_vehicle):
                each.take(data, VEHICLE)

    def transmit(self, data: bytes) -> None:
        """Send bytes to the vehicle; of a flood the first part."""
        if len(self.outbox) < MOST_SENT:
            line = self._line()
            if not self.senders or self.senders[-1][1] != line:
                self.senders.append((len(self.outbox), line))
        self.outbox += data[: MOST_SENT - len(self.outbox)]

    def link(self, end: Socket) -> None:
        """Note that a socket is an end of a link to the vehicle."""
        if end not in self.to_vehicle:
            self.to_vehicle.append(end)

    def free_port(self) -> int:
        """Return a port that nobody has."""
        self._port += 1
        return self._port

    def wait(self, ready: Callable[[], T], ends: list[Socket], timeout: float | None) -> T:
        """Wait until ``ready`` returns something, or a time is over; it depends on ``ends``."""
        turns = self.turns
        found = ready()
        if found or timeout == 0:
            if not found:
                turns.pass_time(POLL_S)
            return found
        until_s = None if timeout is None else turns.now_s + timeout
        me = turns.current
        while not found and (until_s is None or turns.now_s < until_s):
            for each in ends:
                each.watchers.append(me)
            turns.park(until_s)
            for each in ends:
                if me in each.watchers:
                    each.watchers.remove(me)
            found = ready()
        return found


class Socket(_RealSocket):
    """A socket of the program; the real one beneath is never connected and lends its number."""

    network: Network

    def __init__(
        self, family: int = -1, type: int = -1, proto: int = -1, fileno: Any = None
    ) -> None:
        super().__init__(family, type, proto, fileno)
        self.watchers: list[Task] = []
        self._inbox: collections.deque[tuple[bytes, Any]] = collections.deque()
        self._waits_s: float | None = socket.getdefaulttimeout()
        self._own: Any = None
        self._peer: Any = None
        self._other: Socket | None = None
        self._is_vehicles = self._listens = self._ended = False
        if self._simulated:
            self.network.sockets[self.fileno()] = self

    @property
    def _simulated(self) -> bool:
        return self.family in _virtual

    @property
    def _is_stream(self) -> bool:
        return bool(self.type & socket.SOCK_STREAM)

    # What the other end does.

    def take(self, data: bytes, source: Any) -> None:
        """Let bytes, or an end of them, arrive."""
        self._inbox.append((data, source))
        self._rouse()

    def _rouse(self) -> None:
        for each in self.watchers:
            self.network.turns.rouse(each)

    @property
    def readable(self) -> bool:
        """Whether a read returns at once."""
        return bool(self._inbox) or self._ended

    def end(self) -> None:
        """Let the other end know that nothing more comes."""
        self._ended = True
        self._rouse()

    # What the program calls.

    def settimeout(self, value: float | None) -> None:
        self._waits_s = value

    def gettimeout(self) -> float | None:
        return self._waits_s

    def setblocking(self, flag: bool) -> None:
        self._waits_s = None if flag else 0.0

    def getblocking(self) -> bool:
        return self._waits_s != 0

    timeout = property(gettimeout)

    def bind(self, address: Any) -> None:
        if not self._simulated:
            super().bind(address)
            return
        port = address
        if self.family != socket.AF_UNIX:
            port = address[1] or self.network.free_port()
            self._own = (address[0] or "0.0.0.0", port)
        key = (self._kind, port)
        if key in self.network.bound:
            raise OSError(errno.EADDRINUSE, f"port {port} is in use by this program")
        self.network.bound[key] = self
        self._own = self._own or address
        if not self._is_stream and port in VEHICLE_PORTS:
            self.network.link(self)

    @property
    def _kind(self) -> int:
        return int(socket.SOCK_STREAM if self._is_stream else socket.SOCK_DGRAM)

    def listen(self, backlog: int = 1) -> None:
        self._listens = True

    def accept(self) -> tuple[Socket, Any]:
        return self._received()  # type: ignore[return-value]

    def connect(self, address: Any) -> None:
        if not self._simulated:
            super().connect(address)
            return
        port = address if self.family == socket.AF_UNIX else address[1]
        self._peer = address
        if self._own is None and self.family != socket.AF_UNIX:
            self._own = ("127.0.0.1", self.network.free_port())
            if not self._is_stream:
                self.network.bound[self._kind, self._own[1]] = self
        if not self._is_stream:
            return
        listener = self.network.bound.get((self._kind, port))
        if listener is not None and listener._listens:
            other = Socket(self.family, self.type)
            _join(self, other)
            other._own, other._peer = address, self._own
            listener.take(other, self._own)  # type: ignore[arg-type]
        elif port in VEHICLE_PORTS:
            self._is_vehicles = True
            self.network.link(self)
        else:
            raise ConnectionRefusedError(
                errno.ECONNREFUSED, f"nobody listens at {address} in the flight's network"
            )

    def connect_ex(self, address: Any) -> int:
        try:
            self.connect(address)
        except OSError as error:
            return error.errno or errno.ECONNREFUSED
        return 0

    def send(self, data: Any, flags: int = 0) -> int:
        sent = bytes(data)
        if not self._is_stream:
            if self._peer is None and self._other is None:
                raise OSError(errno.EDESTADDRREQ, "Destination address required")
            if self._other is None:
                return self.sendto(sent, self._peer)
        if self._is_vehicles:
            self.network.transmit(sent)
        elif self._other is not None and not self._other._closed:  # type: ignore[attr-defined]
            self._other.take(sent, self._own)
        else:
            raise BrokenPipeError(errno.EPIPE, "Broken pipe")
        return len(sent)

    def sendall(self, data: Any, flags: int = 0) -> None:
        self.send(data)

    def sendto(self, data: Any, *where: Any) -> int:
        sent, address = bytes(data), where[-1]
        if len(sent) > LARGEST:
            raise OSError(errno.EMSGSIZE, "Message too long")
        if self._own is None and self.family != socket.AF_UNIX:
            self._own = ("127.0.0.1", self.network.free_port())
            self.network.bound[self._kind, self._own[1]] = self
        port = address if self.family == socket.AF_UNIX else address[1]
        other = self.network.bound.get((self._kind, port))
        if other is not None and other is not self:
            other.take(sent, self._own)
        elif address[:2] == VEHICLE or port in VEHICLE_PORTS:
            self.network.link(self)
            self.network.transmit(sent)
        return len(sent)

    def sendmsg(self, buffers: Any, *_: Any) -> int:
        return self.send(b"".join(bytes(each) for each in buffers))

    def recv(self, size: int = LARGEST, flags: int = 0) -> bytes:
        if not self._simulated:
            return super().recv(size, flags)
        return self.recvfrom(size, flags)[0]

    def recvfrom(self, size: int = LARGEST, flags: int = 0) -> tuple[bytes, Any]:
        data, source = self._received()
        if flags & socket.MSG_PEEK or (self._is_stream and len(data) > size):
            rest = data if flags & socket.MSG_PEEK else data[size:]
            self._inbox.appendleft((rest, source))
        return data[:size], source

    def recv_into(self, buffer: Any, nbytes: int = 0, flags: int = 0) -> int:
        data = self.recv(nbytes or len(buffer), flags)
        buffer[: len(data)] = data
        return len(data)

    def recvfrom_into(self, buffer: Any, nbytes: int = 0, flags: int = 0) -> tuple[int, Any]:
        data, source = self.recvfrom(nbytes or len(buffer), flags)
        buffer[: len(data)] = data
        return len(data), source

    def _received(self) -> tuple[bytes, Any]:
        ready = self.network.wait(lambda: self.readable, [self], self._waits_s)
        if not ready:
            if self._waits_s == 0:
                raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")
            raise _modules_own.timeout("timed out")
        return self._inbox.popleft() if self._inbox else (b"", None)

    def getsockname(self) -> Any:
        return self._own or ("0.0.0.0", 0)

    def getpeername(self) -> Any:
        if self._peer is None:
            raise OSError(errno.ENOTCONN, "Transport endpoint is not connected")
        return self._peer

    def shutdown(self, how: int) -> None:
        if self._other is not None and how != socket.SHUT_RD:
            self._other.end()
        if how != socket.SHUT_WR:
            self.end()

    def _real_close(self, *_: Any) -> None:
        number = self.fileno()
        if number >= 0 and self.network.sockets.get(number) is self:
            del self.network.sockets[number]
            for key, each in list(self.network.bound.items()):
                if each is self:
                    del self.network.bound[key]
            if self in self.network.to_vehicle:
                self.network.to_vehicle.remove(self)
            if self._other is not None:
                self._other.end()
        super()._real_close()  # type: ignore[misc]


def _join(one: Socket, other: Socket) -> None:
    one._other, other._other = other, one
    one._peer = one._peer or "peer"
    other._peer = other._peer or "peer"


def socketpair(family: Any = None, type: int = socket.SOCK_STREAM, proto: int = 0) -> Any:
    """Return two sockets that are connected."""
    one, other = (Socket(family or socket.AF_UNIX, type, proto) for _ in range(2))
    _join(one, other)
    return one, other


class Selection:
    """What ``select`` and its relatives ask: which of these are readable, which writable."""

    def __init__(self, network: Network, reads: list[Any], writes: list[Any]) -> None:
        self._reads, self._writes, self._network = reads, writes, network
        known = network.sockets
        self._ends = [known[each] for each in map(_number, reads) if each in known]
        self._real = [each for each in reads if _number(each) not in known]
        self._real_writes = [each for each in writes if _number(each) not in known]

    def wait(self, timeout: float | None) -> tuple[list[Any], list[Any]]:
        """Return them; real files alone are waited for in real time, as for another program."""
        network = self._network
        inside = self._ends or len(self._writes) > len(self._real_writes)
        inside = inside or not network.pipes.isdisjoint(map(_number, self._real))
        if not inside and (self._real or self._real_writes):
            reads, writes, _ = _real_select(self._real, self._real_writes, [], timeout)
            return reads, writes
        until_s = math.inf if timeout is None else network.turns.now_s + timeout
        while self._real and until_s - network.turns.now_s > PIPE_S:
            # Nobody tells of real files.
            if found := network.wait(self._ready, self._ends, PIPE_S):
                return found
        rest_s = None if timeout is None else max(until_s - network.turns.now_s, 0.0)
        return network.wait(self._ready, self._ends, rest_s) or ([], [])

    def _ready(self) -> tuple[list[Any], list[Any]] | None:
        known = self._network.sockets
        real = _real_select(self._real, [], [], 0)[0] if self._real else []
        reads = [
            each
            for each in self._reads
            if each in real or (_number(each) in known and known[_number(each)].readable)
        ]
        writes = [each for each in self._writes if _number(each) in known]
        return (reads, writes) if reads or writes else None


def _number(each: Any) -> int:
    return each if isinstance(each, int) else each.fileno()


def install(network: Network) -> None:
    """Let Python's sockets, selectors and serial ports be those of this network."""
    Socket.network = network
    changes: Any = socket
    changes.socket = changes.SocketType = Socket
    changes.socketpair = socketpair
    real = {name: getattr(socket, name) for name in ("getaddrinfo", "gethostbyname")}

    def getaddrinfo(host: Any, *arguments: Any, **options: Any) -> Any:
        return real["getaddrinfo"](_numeric(host), *arguments, **options)

    changes.getaddrinfo = getaddrinfo
    changes.gethostbyname = lambda host: real["gethostbyname"](_numeric(host))

    def selected(reads: Any, writes: Any, others: Any, timeout: float | None = None) -> Any:
        del others
        reads, writes = list(reads), list(writes)
        return (*Selection(network, reads, writes).wait(timeout), [])

    _install_pipes(network)
    change_select: Any = select
    change_select.select = selected
    change_select.poll = lambda: Poll(network, 1e-3)
    change_select.epoll = lambda *_, **__: Poll(network, 1.0)
    base: Any = selectors._BaseSelectorImpl

    class Selector(base):  # type: ignore[misc]
        """A selector over this network."""

        def select(self, timeout: float | None = None) -> list[Any]:
            keys = list(self._fd_to_key.values())
            reads = [each.fd for each in keys if each.events & selectors.EVENT_READ]
            writes = [each.fd for each in keys if each.events & selectors.EVENT_WRITE]
            if timeout is not None:
                timeout = max(timeout, 0)
            can_read, can_write = Selection(network, reads, writes).wait(timeout)
            found = []
            for key in keys:
                events = selectors.EVENT_READ if key.fd in can_read else 0
                events |= selectors.EVENT_WRITE if key.fd in can_write else 0
                if events & key.events:
                    found.append((key, events & key.events))
            return found

    change_selectors: Any = selectors
    for name in ("Default", "Epoll", "Poll", "Select"):
        setattr(change_selectors, f"{name}Selector", Selector)


def _install_pipes(network: Network) -> None:
    real, read, changes = os.pipe, os.read, cast(Any, os)

    def pipe() -> tuple[int, int]:
        ends = real()
        # Those of subprocess lead to another program, which runs in real time.
        if sys._getframe(1).f_globals.get("__name__") != "subprocess":
            network.pipes.update(ends)
        return ends

    def read_when_ready(number: int, size: int) -> bytes:
        if number in network.pipes and os.get_blocking(number):
            Selection(network, [number], []).wait(None)
        return read(number, size)

    changes.pipe, changes.read = pipe, read_when_ready


class Poll:
    """``select.poll`` and ``select.epoll`` over this network; they differ in the unit of time."""

    def __init__(self, network: Network, unit_s: float) -> None:
        self._network, self._unit_s = network, unit_s
        self._wanted: dict[int, int] = {}

    def register(self, each: Any, events: int = select.POLLIN) -> None:
        """Watch a file or socket."""
        self._wanted[_number(each)] = events

    modify = register

    def unregister(self, each: Any) -> None:
        """Watch it no more."""
        del self._wanted[_number(each)]

    def poll(self, timeout: float | None = None, maxevents: int = -1) -> list[tuple[int, int]]:
        """Return what is ready."""
        del maxevents
        reads = [each for each, events in self._wanted.items() if events & select.POLLIN]
        writes = [each for each, events in self._wanted.items() if events & select.POLLOUT]
        wait_s = None if timeout is None or timeout < 0 else timeout * self._unit_s
        can_read, can_write = Selection(self._network, reads, writes).wait(wait_s)
        found = [(each, select.POLLIN) for each in can_read]
        return found + [(each, select.POLLOUT) for each in can_write]

    def close(self, *_: Any) -> None:
        """Do nothing: it holds nothing."""

    __exit__ = close

    def __enter__(self) -> Poll:
        return self


def _numeric(host: Any) -> Any:
    """Return a host as it is if it is a number; all names are this machine's."""
    named = isinstance(host, str) and any(each.isalpha() for each in host) and ":" not in host
    return "127.0.0.1" if named else host


def serial_module(network: Network, module: types.ModuleType | None) -> Any:
    """Return pyserial's module with ports that lead to the vehicle, or one that has only these."""
    found: Any = module or types.ModuleType("serial")

    class Serial:
        """A serial port, of which the other end is the vehicle."""

        def __init__(self, port: Any = None, baudrate: int = 9600, **options: Any) -> None:
            self.port = self.name = port
            self.baudrate, self.timeout = baudrate, options.get("timeout")
            self._end = Socket(socket.AF_INET, socket.SOCK_STREAM)
            self._end.connect(VEHICLE)
            self.is_open = True
            self._rest = b""

        def read(self, size: int = 1) -> bytes:
            self._end.settimeout(self.timeout)
            while len(self._rest) < size:
                try:
                    self._rest += self._end.recv()
                except OSError:
                    break
            data, self._rest = self._rest[:size], self._rest[size:]
            return data

        def write(self, data: Any) -> int:
            return self._end.send(data)

        @property
        def in_waiting(self) -> int:
            return len(self._rest) + sum(len(each) for each, _ in self._end._inbox)

        def inWaiting(self) -> int:
            return self.in_waiting

        def isOpen(self) -> bool:
            return self.is_open

        def fileno(self) -> int:
            return self._end.fileno()

        def close(self) -> None:
            self.is_open = False
            self._end.close()

        def flush(self) -> None:
            """All is written at once."""

        def open(self) -> None:
            """Leave it open."""

        reset_input_buffer = reset_output_buffer = flushInput = flushOutput = flush
        setDTR = setRTS = setBaudrate = lambda self, *_: None

    found.Serial = Serial
    if module is None:
        found.SerialException = type("SerialException", (OSError,), {})
        sys.modules["serial"] = found
    return found
