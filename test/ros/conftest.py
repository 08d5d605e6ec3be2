"""Real processes and a listener of our own, alone on a ROS domain, bounded in time, ended by process id."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from std_srvs.srv import SetBool, Trigger

from cable_sim_ros.compiler.kernel_cache import roots
from cable_sim_ros.io.bags.bag import BagWriter, read_bag
from cable_sim_ros.io.messages.messages import KINDS
from cable_sim_ros.ros.child import Process
from cable_sim_ros.ros.client import Client
from cable_sim_ros.ros.topics import message_class
from cable_sim_ros.testing.arguments import SENT_AGAIN
from cable_sim_ros.testing.domain import reserve
from verification.soak import sender

HERE = Path(__file__).parent
LONG = 600.0  # s of wall time that only something that hangs takes
ROOT = HERE.parents[1]
# the loop calls libc from compiled code; the real simulator takes minutes without, and keeps no pace
COMPILED = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs compiled kernels")


def poll(condition, what: str = "", within: float = LONG, step: float = 0.02):
    """The first true value of condition(); fails the test after `within` seconds."""
    deadline = time.monotonic() + within
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            pytest.fail(f"not within {within:g} s: {what or condition}")
        time.sleep(step)


class Node(Process):
    """The node on the stand-in for the simulator."""

    def __init__(self, world: World, parameters: dict, arguments: tuple = (), environment: dict | None = None) -> None:
        number = len(world.processes)
        self.folder = world.folder
        self.status = world.folder / f"node{number}.json"
        given = {"statistics_file": str(self.status)} | parameters
        command = [sys.executable, str(HERE / "fake_sim.py"), "cable_sim_ros.ros.node"]
        command += [*(part for part in arguments if part == "--open"), "--ros-args"]
        command += [part for part in arguments if part != "--open"]
        for name, value in given.items():
            command += ["-p", f"{name}:={json.dumps(value)}"]
        own = world.environment | (environment or {})
        super().__init__("node", command, world.folder / f"node{number}.log", own, folder=world.folder)

    def stop(self, steps=((signal.SIGINT, LONG),)) -> int:
        return super().stop(steps)  # the first signal must do

    def state(self) -> dict:
        try:
            return json.loads(self.status.read_text())
        except FileNotFoundError:
            return {}

    def until(self, state: str, within: float = LONG) -> Node:
        def there():
            if self.code is not None:
                pytest.fail(f"the node ended with {self.code}:\n{self.text}")
            return self.state().get("state") == state

        poll(there, f"state {state}", within)
        return self


class Ears(Client):
    """Hears /diagnostics from its beginning, and asks the node."""

    def __init__(self, domain: int) -> None:
        super().__init__(domain, "ears")
        self.listen(DiagnosticArray, "/diagnostics")

    def call(self, kind, name, request, within=LONG):
        return super().call(kind, name, request, within)

    def task(self, name: str) -> tuple[int, str, dict[str, str]]:
        """Level, text and values of a task of /diagnostics, also before it came."""
        return self.diagnostics().get(name, (0, "", {}))

    def more(self, topic: str, count: int) -> None:
        """Wait for so many more messages of a topic that it listens to."""
        box, before = self.received[topic], len(self.received[topic])
        poll(lambda: len(box) >= before + count, f"{count} more of {topic}")

    def ask(self, service: str, data: bool | None = None) -> tuple[bool, str]:
        """Success and text of a Trigger of the node or, with data, of a SetBool."""
        kind, given = (Trigger, {}) if data is None else (SetBool, {"data": data})
        answer = self.call(kind, f"cable_sim/{service}", kind.Request(**given))
        return answer.success, answer.message

    def set(self, name: str, value) -> str:
        """Set a parameter of the node; why it was refused, or ""."""
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        (result,) = self.call(SetParameters, "cable_sim/set_parameters", request).results
        assert result.successful == (result.reason == ""), result
        return result.reason


class Ship(sender.Ship):
    """A ship that heaves 1 m in 10 s and goes ahead at 2.2 m/s, seen by an IMU and odometry at 50 Hz."""

    def __init__(self, ears: Client) -> None:
        super().__init__(1.0, 10.0, speed=2.2)
        self.publishers = {
            kind: ears.publisher(message_class(KINDS[kind][0]), KINDS[kind][1]) for kind in ("imu", "odometry")
        }
        self.imu, self.odom = self.publishers.values()
        self.silent: set[str] = set()  # kinds that are not sent
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._sail, daemon=True)

    def sail(self) -> Ship:
        self._thread.start()
        return self

    def stop(self) -> None:
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join(30.0)
            assert not self._thread.is_alive(), "the thread that publishes did not end within 30 s"

    def messages(self, stamp: int, t: float):
        publishers = self.publishers.items()
        return [deserialize_message(self.message(kind, stamp, t), its.msg_type) for kind, its in publishers]

    def _sail(self) -> None:
        sender.send(self._publish, self, {"imu": 50.0, "odometry": 50.0}, 0.0, lambda: not self._stop.is_set())

    def _publish(self, kind: str, data: bytes) -> None:
        if kind not in self.silent:
            self.publishers[kind].publish(data)


class World:
    """A domain of our own, with everything on it ended at the end."""

    def __init__(self, folder: Path, cache: Path) -> None:
        self.folder, self._domain = folder, reserve()
        self.domain = self._domain.number
        self.environment = os.environ | {
            "ROS_DOMAIN_ID": str(self.domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_PYTHON_CHECK_FIELDS": "1",
            "NUMBA_CACHE_DIR": str(cache),
            "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
            "ROS_LOG_DIR": str(folder / "log"),
        }
        self.processes: list[Process] = []
        self.closing: list = []

    def node(self, *arguments: str, environment: dict | None = None, **parameters) -> Node:
        parameters = {name.replace("__", "."): value for name, value in parameters.items()}
        if parameters.get("time_mode") == "lockstep":
            parameters = SENT_AGAIN | parameters  # what is waited for is not lost
        process = Node(self, parameters, arguments, environment)
        self.processes.append(process)
        return process

    def run(self, module: str, *arguments: str) -> Process:
        log = self.folder / f"process{len(self.processes)}.log"
        process = Process(module, [sys.executable, "-m", module, *arguments], log, self.environment, folder=self.folder)
        self.processes.append(process)
        return process

    def ears(self) -> Ears:
        ears = Ears(self.domain)
        self.closing.append(ears.close)
        return ears

    def ship(self, ears: Client) -> Ship:
        ship = Ship(ears)
        self.closing.insert(0, ship.stop)
        return ship

    def close(self) -> None:
        for process in self.processes:
            process.kill()
        for close in self.closing:
            close()
        self._domain.close()


def ns(stamp) -> int:
    """A stamp of a message, ns."""
    return stamp.sec * 10**9 + stamp.nanosec


def run_script(script: str, *arguments: str, **environment: str) -> str:
    """What a script prints that runs in a process of its own, with this folder, test/io and the package on its path."""
    path = os.pathsep.join(map(str, (HERE, HERE.parent / "io", ROOT)))
    command, own = [sys.executable, "-c", script, *arguments], os.environ | {"PYTHONPATH": path, **environment}
    done = subprocess.run(command, env=own, capture_output=True, text=True, timeout=LONG)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def recorded(path: Path) -> dict[str, list[bytes]]:
    """The messages of a bag by topic."""
    data: dict[str, list[bytes]] = {}
    for message in read_bag(path):
        data.setdefault(message.topic, []).append(message.data)
    return data


@pytest.fixture
def receivers():
    """Function: a socket for UDP at a port of this machine, 0: any; what has come to it: `datagrams`."""
    with ExitStack() as made:

        def receiver(port: int = 0) -> socket.socket:
            it = made.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            it.bind(("127.0.0.1", port))
            it.setblocking(False)
            return it

        yield receiver


def datagrams(receiver: socket.socket) -> list[bytes]:
    """What has come since it was asked before."""
    found = []
    while True:
        try:
            found.append(receiver.recv(4096))
        except BlockingIOError:
            return found


@pytest.fixture(scope="session")
def kernel_cache():
    """Compiled stand-in kernels must not mix with those of the real simulator, or of another stand-in: the loop is
    cached by its types. One folder for all workers and tiers, under a name that is swept when it is old."""
    return roots()[0] / hashlib.sha256((HERE / "fake_sim.py").read_bytes()).hexdigest()[:16]


def alone(folder: Path, cache: Path) -> Iterator[World]:
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        patched.setenv("ROS_PYTHON_CHECK_FIELDS", "1")
        it = World(folder, cache)
        yield it
        it.close()


@pytest.fixture
def world(tmp_path, kernel_cache):
    yield from alone(tmp_path, kernel_cache)


@pytest.fixture(scope="module")
def shared_world(tmp_path_factory, kernel_cache):
    """One for all tests of a file that leave it as they found it."""
    yield from alone(tmp_path_factory.mktemp("world"), kernel_cache)


@pytest.fixture(scope="session")
def bag(tmp_path_factory) -> Path:
    """12 s of a heaving ship, IMU and odometry at 50 Hz, stamps of the year 2014."""
    path, ship = tmp_path_factory.mktemp("bags") / "heaving", sender.Ship(1.0, 10.0, speed=2.2)
    with BagWriter(path) as writer:
        for k in range(600):
            stamp = (1_400_000_000 * 50 + k) * 20_000_000
            for kind in ("imu", "odometry"):
                name, topic = KINDS[kind]
                writer.add(f"/ship/{topic}", name, stamp, ship.message(kind, stamp, 0.02 * k))
    return path
