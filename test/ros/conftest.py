"""Real processes and a listener of our own, alone on a ROS domain, bounded in time, ended by process id."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from cable_sim_ros.ros.child import Process
from cable_sim_ros.testing.domain import reserve

if TYPE_CHECKING:
    from cable_sim_ros.ros.client import Client

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


def pytest_configure(config):
    config.addinivalue_line("markers", "ros: needs rclpy; runs several processes")


def poll(condition, within: float, what: str = "", step: float = 0.02):
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

    def stop(self, steps=((signal.SIGINT, 5.0),)) -> int:
        return super().stop(steps)  # the first signal must do

    def state(self) -> dict:
        try:
            return json.loads(self.status.read_text())
        except FileNotFoundError:
            return {}

    def until(self, state: str, within: float = 40.0) -> Node:
        def there():
            if self.code is not None:
                pytest.fail(f"the node ended with {self.code}:\n{self.text}")
            return self.state().get("state") == state

        poll(there, within, f"state {state}")
        return self


class Ship:
    """A ship that heaves 1 m in 10 s and goes ahead at 2.2 m/s, seen by an IMU and odometry at 50 Hz."""

    def __init__(self, ears: Client, odometry: bool = True) -> None:
        from nav_msgs.msg import Odometry
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import Imu

        self.imu_class, self.odometry_class = Imu, Odometry
        self.imu = ears.node.create_publisher(Imu, "imu/data", qos_profile_sensor_data)
        self.odom = ears.node.create_publisher(Odometry, "odom", qos_profile_sensor_data) if odometry else None
        self.shift = 0  # ns added to the stamps
        self.heave, self.speed = 1.0, 2.2  # m, m/s
        self.silent = False
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
        imu, odom = self.imu_class(), self.odometry_class()
        w = 2 * np.pi / 10
        for message in (imu, odom):
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
        imu.orientation.w = 1.0
        imu.linear_acceleration.z = float(9.81 - self.heave * w * w * np.sin(w * t))
        odom.header.frame_id, odom.child_frame_id = "odom", "base_link"
        odom.pose.pose.orientation.w = 1.0
        odom.pose.pose.position.x, odom.pose.pose.position.z = self.speed * t, float(self.heave * np.sin(w * t))
        odom.twist.twist.linear.x, odom.twist.twist.linear.z = self.speed, float(self.heave * w * np.cos(w * t))
        return imu, odom

    def _sail(self) -> None:
        begun, wall, k = time.monotonic(), time.time_ns(), 0  # stamps as even as the motion they belong to
        while not self._stop.wait(max(0.0, begun + 0.02 * k - time.monotonic())):
            k += 1
            if self.silent:
                continue
            imu, odom = self.messages(wall + 20_000_000 * k + self.shift, 0.02 * k)
            self.imu.publish(imu)
            if self.odom is not None:
                self.odom.publish(odom)


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
        process = Node(self, parameters, arguments, environment)
        self.processes.append(process)
        return process

    def run(self, module: str, *arguments: str) -> Process:
        log = self.folder / f"process{len(self.processes)}.log"
        process = Process(module, [sys.executable, "-m", module, *arguments], log, self.environment, folder=self.folder)
        self.processes.append(process)
        return process

    def ears(self) -> Client:
        from cable_sim_ros.ros.client import Client

        ears = Client(self.domain, "ears")
        self.closing.append(ears.close)
        return ears

    def ship(self, ears: Client, odometry: bool = True) -> Ship:
        ship = Ship(ears, odometry)
        self.closing.insert(0, ship.stop)
        return ship

    def close(self) -> None:
        for process in self.processes:
            process.kill()
        for close in self.closing:
            close()
        self._domain.close()


@pytest.fixture(scope="session")
def kernel_cache(tmp_path_factory):
    """Compiled stand-in kernels must not mix with those of the real simulator: the loop is cached by its types."""
    return tmp_path_factory.mktemp("kernels")


@pytest.fixture
def world(tmp_path, kernel_cache, monkeypatch):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_PYTHON_CHECK_FIELDS", "1")
    it = World(tmp_path, kernel_cache)
    yield it
    it.close()


@pytest.fixture(scope="session")
def bag(tmp_path_factory) -> Path:
    """12 s of a heaving ship, IMU and odometry at 50 Hz, stamps of the year 2014."""
    from cable_sim_ros.io.bags.bag import BagWriter
    from cable_sim_ros.io.bags.typestore import STORE

    types = STORE.types
    vector, point, turn = (types[f"geometry_msgs/msg/{name}"] for name in ("Vector3", "Point", "Quaternion"))
    path = tmp_path_factory.mktemp("bags") / "heaving"
    w, start = 2 * np.pi / 10, 1_400_000_000 * 10**9

    def header(t, frame):
        return types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](*divmod(t, 10**9)), frame)

    with BagWriter(path) as writer:
        for k in range(600):
            t, stamp = 0.02 * k, start + 20_000_000 * k
            imu = types["sensor_msgs/msg/Imu"](
                header(stamp, "imu_link"),
                turn(0.0, 0.0, 0.0, 1.0),
                np.zeros(9),
                vector(0.0, 0.0, 0.0),
                np.zeros(9),
                vector(0.0, 0.0, 9.81 - w * w * np.sin(w * t)),
                np.zeros(9),
            )
            pose = types["geometry_msgs/msg/Pose"](point(2.2 * t, 0.0, np.sin(w * t)), turn(0.0, 0.0, 0.0, 1.0))
            twist = types["geometry_msgs/msg/Twist"](vector(2.2, 0.0, w * np.cos(w * t)), vector(0.0, 0.0, 0.0))
            odom = types["nav_msgs/msg/Odometry"](
                header(stamp, "odom"),
                "base_link",
                types["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
                types["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36)),
            )
            for topic, message in (("/ship/imu/data", imu), ("/ship/odom", odom)):
                data = bytes(STORE.serialize_cdr(message, message.__msgtype__))
                writer.add(topic, message.__msgtype__, stamp, data)
    return path
