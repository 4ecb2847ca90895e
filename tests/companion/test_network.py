"""Python's sockets in simulated time, among themselves and with the vehicle."""

from __future__ import annotations

from pathlib import Path

from tests.companion.processes import running


def test_a_bound_udp_socket_hears_the_vehicle_and_answers_it(tmp_path: Path) -> None:
    text = """
        import socket, time
        link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        link.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        link.bind(("0.0.0.0", 14550))
        data, source = link.recvfrom(100)
        print(data, source, "%.2f" % time.monotonic())
        link.sendto(b"answer", source)
        link.setblocking(False)
        try:
            link.recv(100)
        except BlockingIOError as error:
            print(error.errno)
        link.settimeout(0.1)
        try:
            link.recv(100)
        except socket.timeout:
            print("%.2f" % time.monotonic())
    """
    with running(tmp_path, text) as simulator:
        simulator.fly(0.1)
        simulator.fly(0.3, data=b"heartbeat")
        assert simulator.printed.splitlines() == [
            "b'heartbeat' ('127.0.0.1', 14555) 0.10",
            "11",
            "0.20",
        ]
        assert simulator.sent == b"answer"
        assert simulator.answer is not None
        assert simulator.answer.links == 1


def test_tcp_and_outgoing_udp_reach_the_vehicle_and_nothing_else(tmp_path: Path) -> None:
    text = """
        import socket
        stream = socket.create_connection(("localhost", 5760), timeout=1)
        stream.sendall(b"by stream ")
        out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        out.connect(("10.1.1.1", 14550))
        out.send(b"by datagram")
        print(stream.recv(3), stream.recv(100), out.recv(100))
        for port in (80, 5000):
            try:
                socket.create_connection(("example.com", port))
            except ConnectionRefusedError as error:
                print(error)
    """
    with running(tmp_path, text) as simulator:
        simulator.fly(0.1)
        simulator.fly(0.2, data=b"state")
        assert simulator.sent == b"by stream by datagram"
        first, *refused = simulator.printed.splitlines()
    assert first == "b'sta' b'te' b'state'"
    assert len(refused) == 2
    assert "nobody listens at ('127.0.0.1', 80) in the flight's network" in refused[0]


def test_sockets_select_and_asyncio_work_within_the_program(tmp_path: Path) -> None:
    text = """
        import asyncio, select, socket, threading, time
        def serve():
            server = socket.create_server(("127.0.0.1", 9000))
            other, _ = server.accept()
            print("got", other.recv(100), other.recv(100) == b"")
        thread = threading.Thread(target=serve)
        thread.start()
        time.sleep(0.05)
        client = socket.create_connection(("127.0.0.1", 9000))
        client.sendall(b"hello")
        client.close()
        thread.join()
        one, other = socket.socketpair()
        print(select.select([one], [], [], 0.2)[0], "%.2f" % time.monotonic())
        threading.Timer(0.1, other.send, (b"x",)).start()
        print(select.select([one], [], [], 5)[0] == [one], "%.2f" % time.monotonic())
        async def main():
            async def answer(reader, writer):
                writer.write(b"re: " + await reader.readline())
                writer.close()
            server = await asyncio.start_server(answer, "127.0.0.1", 9001)
            reader, writer = await asyncio.open_connection("127.0.0.1", 9001)
            writer.write(b"line\\n")
            print(await reader.read())
            server.close()
        asyncio.run(main())
    """
    with running(tmp_path, text) as simulator:
        printed = simulator.fly(1).printed
        assert simulator.failure == ""
    assert printed.splitlines() == [
        "got b'hello' True",
        "[] 0.25",
        "True 0.35",
        "b're: line\\n'",
    ]


def test_a_serial_port_leads_to_the_vehicle_without_pyserial_too(tmp_path: Path) -> None:
    text = """
        import serial, time
        port = serial.Serial("/dev/ttyACM0", 57600, timeout=0.1)
        port.write(b"out")
        while not port.in_waiting:
            time.sleep(0.02)
        print(port.read(2), port.inWaiting(), port.read(100), "%.2f" % time.monotonic())
    """
    with running(tmp_path, text) as simulator:
        simulator.fly(0.1)
        simulator.fly(0.3, data=b"state")
        assert simulator.sent == b"out"
        assert simulator.printed == "b'st' 3 b'ate' 0.22\n"


def test_a_flood_of_bytes_and_text_is_cut(tmp_path: Path) -> None:
    text = """
        import os, socket
        link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        for _ in range(10_000):
            link.sendto(bytes(1000), ("127.0.0.1", 14550))
            print("x" * 1000)
        os.write(1, bytes(1_000_000))
    """
    with running(tmp_path, text) as simulator:
        simulator.fly(0.2)
        assert simulator.answer is not None
        assert simulator.answer.status == 0
        assert len(simulator.printed) <= 2_000
        assert len(simulator.sent) == 200_000
