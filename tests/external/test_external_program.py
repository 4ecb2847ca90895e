"""A program in any language flies as a class does, and what it does wrong is a finding."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

from pytest_garl import Camera, Command, Mission, Observation, PositionSetpoint
from pytest_garl.errors import LandingSystemError
from pytest_garl.external.external_program import ExternalProgram
from pytest_garl.process_tree import any_command_contains
from pytest_garl.simulation.fly import fly
from tests.external.programs import CLIENTS, RISES, at_once, flown, written
from tests.support.flights import EMPTY, STAND, nominal

SHADE = """
import garl_client

link = garl_client.Link(frame={frame!r}, reads=["image", "depth_m"])
x, y, _ = link.mission["home_m"]
for seen in link:
    shade = 0.0
    for row in range(0, 240, 24):
        for column in range(0, 320, 32):
            shade += float(seen.image[row, column, 1]) + float(seen.depth_m[row, column])
    link.position({place})
"""


class Shade:
    """The rule of ``SHADE`` as a class."""

    airframe = at_once()

    def reset(self, mission: Mission) -> None:
        self.home = mission.home_m

    def step(self, observation: Observation) -> Command:
        shade = 0.0
        for row in range(0, 240, 24):
            for column in range(0, 320, 32):
                image, depth = observation.image, observation.depth_m
                shade += float(image[row, column, 1]) + float(depth[row, column])
        x, y, _ = self.home
        return PositionSetpoint(position_m=(x, y, 1.0 + shade / 1e4), speed_mps=2.0)


def test_a_program_flies_to_the_byte_as_the_same_rule_in_a_class(tmp_path: Path) -> None:
    """It sees the same pictures, gets the same numbers, and its answers arrive as it means them."""
    place = "[x, y, 1.0 + shade / 1e4], speed_mps=2.0"
    program = written(tmp_path, SHADE.format(frame="ENU", place=place), airframe=at_once())
    by_class = fly(nominal(), Shade, STAND, map=EMPTY, time_limit_s=3.0)
    by_program = flown(program, 3.0)
    assert by_program.crash is None
    assert by_program.sha256 == by_class.sha256
    assert by_program.data_read == by_class.data_read == ("image", "depth_m")


def test_a_program_may_speak_ned(tmp_path: Path) -> None:
    place = "[x, y, -1.0 - shade / 1e4], speed_mps=2.0"
    program = written(tmp_path, SHADE.format(frame="NED", place=place), airframe=at_once())
    by_class = fly(nominal(), Shade, STAND, map=EMPTY, time_limit_s=3.0)
    by_program = flown(program, 3.0)
    assert by_program.crash is None
    assert by_program.sha256 == by_class.sha256


def test_what_it_thinks_is_in_the_record(tmp_path: Path) -> None:
    flight = flown(written(tmp_path, RISES.format(misbehaves="pass")))
    said = flight.steps[-1].diagnostics
    assert said is not None
    assert (said.phase, said.target_m) == ("rises", (*flight.uav.position_m[0][:2].round(3), 0.0))


@pytest.mark.parametrize(
    ("misbehaves", "kind", "error", "words"),
    [
        ("raise SystemExit(3)", "died", "exit-status-3", "exit status 3 before it answered step"),
        ("1 / 0", "died", "exit-status-1", "step, frame 5: ZeroDivisionError: division by zero"),
        ("import wanted", "died", "exit-status-1", "No module named 'wanted'"),
        ("__import__('os').kill(__import__('os').getpid(), 11)", "died", "signal-11", "SIGSEGV"),
        ("__import__('os').close(link._answers); __import__('time').sleep(9)", "died", "Closed",
         "closed its stdin or stdout"),
        ("__import__('os').write(link._answers, b'hello there\\n')", "nonsense", "BadMessage",
         "wrote 'hello there' to stdout"),
        ("__import__('os').write(link._answers, b'x' * 2**21)", "nonsense", "BadMessage",
         "without the end of a line"),
        ("[link.send('land') or setattr(link, '_frame', 5) for _ in range(99)]", "nonsense",
         "BadMessage", 'answered "frame": 5; expected "frame": 6'),
        ("link._frame = 4", "nonsense", "BadMessage", 'answered "frame": 4'),
        ("__import__('os').write(link._answers, b'{\"note\": \"\\xff\"}\\n')", "nonsense",
         "BadMessage", "whose byte 10 is not UTF-8"),
        ("link._write({'type': 'hover', 'frame': 5})", "nonsense", "BadMessage",
         "position or velocity or attitude or land or abort"),
        ("link.position([0, 0]); continue", "nonsense", "BadCommand", "position_m = (0, 0)"),
        ("link.position([0, 0, float('nan')]); continue", "nonsense", "BadCommand", "nan"),
        ("link.position([0, 0, 1], speed=1); continue", "nonsense", "BadMessage",
         "found speed; expected position_m, speed_mps, yaw_rad"),
        ("link.land(diagnostics={'detections': [{'id': 1}]}); continue", "nonsense", "BadMessage",
         "found id; expected marker_id"),
        ("link.land(diagnostics={'detections': [3]}); continue", "nonsense", "BadDiagnostics",
         "expected Detection"),
        ("link.send('attitude'); continue", "nonsense", "BadMessage", "expected attitude, thrust"),
        ("link._write([1])", "nonsense", "BadMessage", "expected a JSON object"),
        ("__import__('os').write(link._answers, b'[' * 9999 + b'\\n')", "nonsense", "BadMessage",
         "nested too deeply"),
    ],
)  # fmt: skip
def test_what_a_program_does_wrong_is_a_finding(
    misbehaves: str, kind: str, error: str, words: str, tmp_path: Path
) -> None:
    flight = flown(written(tmp_path, RISES.format(misbehaves=misbehaves)))
    assert flight.outcome == "crashed"
    assert flight.crash is not None
    assert (flight.crash.kind, flight.crash.error) == (kind, error)
    assert words in flight.crash.message
    assert len(flight.steps) == 5 or '"frame": 5' in words


def test_its_last_words_explain_its_death(tmp_path: Path) -> None:
    text = RISES.format(misbehaves="print('no plan'); raise ValueError('no way')")
    crash = flown(written(tmp_path, text)).crash
    assert crash is not None
    assert crash.where == "lander"
    assert "no plan" in crash.traceback
    assert "ValueError: no way" in crash.traceback


def test_a_flood_of_errors_neither_blocks_nor_fills_memory(tmp_path: Path) -> None:
    text = RISES.format(misbehaves="print('x' * 2**20); raise SystemExit(1)")
    crash = flown(written(tmp_path, text)).crash
    assert crash is not None
    assert crash.error == "exit-status-1"
    assert len(crash.traceback) <= 16_384


@pytest.mark.parametrize(
    ("answer", "error", "words"),
    [
        ('{"type": "hello", "protocol": 2}', "OtherProtocol", "version 2 of the protocol"),
        ('{"type": "hello"}', "OtherProtocol", "version None"),
        ('{"type": "hello", "protocol": 1, "frame": "FRD"}', "BadMessage", "ENU or NED"),
        ('{"type": "hello", "protocol": 1, "reads": ["lidar"]}', "BadMessage", "image, depth_m"),
        ("Starting lander 1.0", "BadMessage", "wrote 'Starting lander 1.0' to stdout"),
    ],
)
def test_a_program_of_another_kind_is_a_finding(
    answer: str, error: str, words: str, tmp_path: Path
) -> None:
    flight = flown(written(tmp_path, f"input(); print({answer!r}, flush=True); input()"))
    assert flight.crash is not None
    assert (flight.crash.kind, flight.crash.error) == ("nonsense", error)
    assert words in flight.crash.message


def test_nothing_of_a_flight_is_left(tmp_path: Path) -> None:
    """Neither the program, nor what it started, nor an open file."""
    mark = f"sleep-of-{tmp_path.name}"
    command = ["setsid", "sh", "-c", f"sh -c 'sleep 99; : {mark}' & exec true"]
    starts = f"__import__('subprocess').run({command}, stdout=-3, stderr=-3)"
    before = len([*Path("/proc/self/fd").iterdir()])
    flight = flown(written(tmp_path, RISES.format(misbehaves=starts)))
    assert flight.crash is None
    assert not any_command_contains(mark)
    assert len([*Path("/proc/self/fd").iterdir()]) == before


def test_a_program_that_never_ends_is_killed_when_the_flight_ends(tmp_path: Path) -> None:
    text = RISES.format(misbehaves="pass") + f"\n__import__('time').sleep(99)  # {tmp_path.name}\n"
    assert flown(written(tmp_path, text)).crash is None
    assert not any_command_contains(str(tmp_path))


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["./lander"], "there is no program './lander' in"),
        (["lander-of-nobody"], "there is no program 'lander-of-nobody' on the PATH"),
        (["notes.txt"], "did you mean ./notes.txt?"),
        (["./notes.txt"], "is no executable file"),
        (["python3", "-u", "lander.py"], "there is no file 'lander.py' in"),
    ],
)
def test_a_program_that_is_not_there_is_named_before_the_flight(
    command: list[str], words: str, tmp_path: Path
) -> None:
    (tmp_path / "notes.txt").write_text("a lander")
    with pytest.raises(LandingSystemError, match=words.replace(".", r"\.").replace("?", r"\?")):
        ExternalProgram(command, folder=tmp_path).check()


def test_a_program_that_goes_after_the_check_is_a_finding(tmp_path: Path) -> None:
    crash = flown(ExternalProgram(["./lander"], folder=tmp_path)).crash
    assert crash is not None
    assert (crash.kind, crash.error) == ("died", "NotStarted")
    assert "No such file" in crash.message


@pytest.mark.parametrize(
    ("command", "name"),
    [
        (["./lander"], "lander"),
        (["build/fast-lander", "--fast", "a.yaml"], "fast_lander"),
        (["venv/bin/python3.8", "-u", "my_lander.py"], "my_lander"),
        (["python", "-m", "landing"], "landing"),
        (["env", "bash", "-c", "./2nd"], "_2nd"),
        (["python"], "python"),
    ],
)
def test_a_program_has_the_name_of_what_runs(command: list[str], name: str) -> None:
    assert ExternalProgram(command).name == name


def test_what_decides_how_it_flies_is_part_of_its_sources(tmp_path: Path) -> None:
    """The mount of its camera, its command and its environment, beside the files in its folder."""
    plain = written(tmp_path, "").source_hashes()
    assert {"garl_client.py", "lander.py"} < {*plain}
    tilted = at_once(camera=Camera(tilt_rad=0.5))
    for changed in ({"airframe": tilted}, {"environment": {"SPEED": "2"}}):
        hashes = written(tmp_path, "", **changed).source_hashes()
        assert {name for name in hashes if hashes[name] != plain[name]} == {
            "the settings of lander"
        }
    assert written(tmp_path, "# changed").source_hashes() != plain


def test_a_command_is_a_list_of_words() -> None:
    with pytest.raises(LandingSystemError, match="expected a list of words"):
        ExternalProgram("./lander")


def test_its_environment_is_of_texts() -> None:
    with pytest.raises(LandingSystemError, match="environment has 'SPEED': 2; expected texts"):
        ExternalProgram(["./lander"], environment={"SPEED": 2})  # type: ignore[dict-item]


def test_a_program_flies_on_linux_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.system", lambda: "Darwin")
    with pytest.raises(LandingSystemError, match="on Linux only"):
        written(tmp_path, "").check()


def test_a_program_flies_no_motors(tmp_path: Path) -> None:
    program = written(tmp_path, "", airframe=at_once(control_rate_hz=240.0))
    with pytest.raises(LandingSystemError, match="control_rate_hz"):
        program.check()


def test_a_second_flight_of_one_instance_starts_the_program_anew(tmp_path: Path) -> None:
    """As ``garl check`` flies one instance of a class twice."""
    running = written(tmp_path, RISES.format(misbehaves="pass"))()
    try:
        flights = [fly(nominal(), lambda: running, STAND, map=EMPTY, time_limit_s=0.5)]
        flights.append(fly(nominal(), lambda: running, STAND, map=EMPTY, time_limit_s=0.5))
    finally:
        running.close()
    assert flights[0].crash is None
    assert flights[0].sha256 == flights[1].sha256


def test_its_camera_is_that_of_its_airframe(tmp_path: Path) -> None:
    text = """
import garl_client

link = garl_client.Link()
camera = link.mission["camera"]
for seen in link:
    assert seen.image.shape == (camera["height_px"], camera["width_px"], 3) == (48, 64, 3)
    link.land()
"""
    camera = Camera(width_px=64, height_px=48)
    assert flown(written(tmp_path, text, airframe=at_once(camera=camera))).crash is None


def test_the_client_is_one_file_of_python_3_8_that_needs_nothing() -> None:
    tree = ast.parse((CLIENTS / "garl_client.py").read_text(), feature_version=(3, 8))
    imported = {
        name.name.partition(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for name in node.names
    }
    # NumPy is used if it is there.
    assert imported - {"numpy"} <= sys.stdlib_module_names
