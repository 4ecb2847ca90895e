from __future__ import annotations

import os
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.errors import PoolError
from pytest_garl.execution.processes import create_report_file, read_report
from pytest_garl.execution.ray import driver as ray_driver
from pytest_garl.execution.ray.actor import ActorWorkspace
from pytest_garl.execution.ray.ray_pool import check_ray


class FakeRay(types.ModuleType):
    """A fake of Ray that records its connections and the arguments of ``ray.init``."""

    exceptions = types.SimpleNamespace(RayError=type("RayError", (Exception,), {}))

    def __init__(self, error: Exception | None = None) -> None:
        super().__init__("ray")
        self._error = error
        self.init_arguments: dict[str, Any] = {}
        self.connections: list[bool] = []

    def init(self, address: str, **options: Any) -> None:
        self.init_arguments = {"address": address, **options}
        if self._error is not None:
            raise self._error
        self.connections.append(True)

    def shutdown(self) -> None:
        self.connections.append(False)

    def cluster_resources(self) -> dict[str, float]:
        return {"CPU": 6.0}


@pytest.fixture
def ray(monkeypatch: pytest.MonkeyPatch) -> FakeRay:
    return install(FakeRay(), monkeypatch)


def install(ray: FakeRay, monkeypatch: pytest.MonkeyPatch) -> FakeRay:
    monkeypatch.setitem(sys.modules, "ray", ray)
    monkeypatch.setattr(ray_driver, "version", lambda name: "2.60.0")
    return ray


def test_joined_cluster_gets_the_project_without_its_flights(
    ray: FakeRay, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "landing" / "tests").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "landing" / "tests")
    with ray_driver.joined_cluster("head:6379", tmp_path, tmp_path / "runs" / ".garl") as (
        _,
        workspace,
        cpus,
    ):
        assert (workspace, cpus) == (
            ActorWorkspace(project=str(tmp_path), working_dir="landing/tests"),
            6,
        )
    assert ray.connections == [True, False]
    assert ray.init_arguments["address"] == "head:6379"
    assert ray.init_arguments["runtime_env"] == {
        "working_dir": str(tmp_path),
        "excludes": ["/runs/.garl"],
    }


def test_pytest_may_run_and_fly_outside_the_project(
    ray: FakeRay, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with ray_driver.joined_cluster("head:6379", tmp_path / "project", tmp_path) as (
        _,
        workspace,
        _,
    ):
        assert workspace.working_dir == "."
    assert ray.init_arguments["runtime_env"]["excludes"] == []


def test_own_cluster_has_a_token_and_leaves_nothing(
    ray: FakeRay, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RAY_TMPDIR", str(tmp_path))
    for name in ("RAY_AUTH_MODE", "RAY_AUTH_TOKEN"):
        # Set first, so that monkeypatch removes it after the test.
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    with ray_driver.own_cluster(3) as (_, workspace, cpus):
        assert cpus == ray.init_arguments["num_cpus"] == 3
        assert [str(path) for path in tmp_path.iterdir()] == [workspace.scratch]
        assert len(os.environ["RAY_AUTH_TOKEN"]) == 64
    assert ray.init_arguments["address"] == "local"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "error",
    [
        ConnectionError("Failed to connect to Ray cluster at 10.0.0.1:6379"),
        RuntimeError("Version mismatch: The cluster was started with:\n    Ray: 2.40.0"),
        FakeRay.exceptions.RayError("wrong token"),
    ],
)
def test_error_of_a_cluster_names_the_expected_versions_and_token(
    error: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(FakeRay(error), monkeypatch)
    joined = ray_driver.joined_cluster("10.0.0.1:6379", tmp_path, tmp_path)
    with pytest.raises(PoolError) as found, joined:
        pass
    assert f"RAY_ADDRESS=10.0.0.1:6379: {error}" in str(found.value)
    assert "with Ray 2.60.0, Python 3." in str(found.value)
    assert "same RAY_AUTH_MODE and token" in str(found.value)


def test_failed_start_of_a_cluster_raises_one_error_and_leaves_no_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RAY_TMPDIR", str(tmp_path))
    for name in ("RAY_AUTH_MODE", "RAY_AUTH_TOKEN"):
        monkeypatch.setenv(name, "given")
    install(FakeRay(OSError("timed out during startup")), monkeypatch)
    with pytest.raises(PoolError, match="on this machine: timed out"), ray_driver.own_cluster(1):
        pass
    assert not list(tmp_path.iterdir())


def test_folder_is_removed_after_the_last_process_that_writes_there(tmp_path: Path) -> None:
    folder = tmp_path / "garl-ray-1"
    folder.mkdir()
    code = (
        "import pathlib, sys, time; print(flush=True); time.sleep(0.5); "
        "pathlib.Path(sys.argv[1], 'a').touch()"
    )
    command = [sys.executable, "-c", code, str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        # Right after its start a process has no command line for a moment.
        assert process.stdout is not None
        process.stdout.readline()
        ray_driver._remove(str(folder))
        assert process.wait(10) == 0
    assert not folder.exists()


def test_driver_ends_if_no_connection_is_made() -> None:
    code = (
        "import sys, time, types\n"
        "sys.modules['ray'] = types.SimpleNamespace(init=lambda *given, **more: time.sleep(60))\n"
        "from pytest_garl.execution.ray import driver as ray_driver\n"
        "ray_driver.CONNECT_S = 0.1\n"
        "ray_driver.version = lambda name: '2.60.0'\n"
        "with ray_driver._connected('head:6379'): pass\n"
    )
    report = create_report_file()
    command = [sys.executable, "-c", code, str(os.getpid()), str(report)]
    done = subprocess.run(command, check=False, timeout=50, pass_fds=[report])
    assert done.returncode == 1
    found = read_report(report)
    assert found is not None
    assert found.cannot_go_on.startswith("RAY_ADDRESS=head:6379: no cluster after 0.1 s")
    os.close(report)


def test_check_connects_only_to_an_address_with_a_port(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: object())
    for address in ("", "auto", "ray://head:10001"):
        check_ray(address)
    with pytest.raises(PoolError, match=r"RAY_ADDRESS=head:99999999: nobody answers"):
        check_ray("head:99999999")


def test_pytest_process_never_imports_ray() -> None:
    code = (
        "import sys\n"
        "import pytest_garl.plugin.session.startup, pytest_garl.execution.ray.scheduler\n"
        "import pytest_garl.execution.ray.driver\n"
        "print('ray' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
