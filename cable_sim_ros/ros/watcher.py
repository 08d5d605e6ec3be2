"""Listens to a node: the newest shape and contact, every tick output, sentences of /diagnostics. It sends nothing.

Before that it reads the node's parameters once, for the scene with every override. Messages are kept as bytes and read
where they are drawn, so that listening costs little.
"""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple, TypeVar

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import GetParameters
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState, PointCloud2

from ..errors import CODE_INPUT, RunError, TowError
from ..io.messages.channels import CHANNELS, decode, decode_frames
from ..io.scenes.load import load_scene
from ..sim.scene import Scene
from . import discovery
from .client import Client
from .parameters import rows, settle

NAMED = {channel.name: channel for channel in CHANNELS}
HEALTH, SHAPE, CONTACT = NAMED["sim_health"], NAMED["cable_shape"], NAMED["sheave_contact"]
KEPT = 20_000  # messages of sim/health that may wait to be read: 200 s of 100 Hz
NEEDED = ("tension", "sheave_position", "ship_position", "ship_quaternion", "body_position", "body_quaternion")
NAMED_WITHIN = 10.0  # s
PART = 200  # parameters asked for at once


class WatchError(RunError):
    """There is no node to watch, or not one that can be; the text says what there is and what to do."""


class WatchInputError(WatchError):
    """What was given cannot be."""

    exit_code = CODE_INPUT


class Tick(NamedTuple):
    """A shape with the tick output and the contact that belong to it."""

    frame: np.record
    shape: np.ndarray
    contact: np.ndarray | None


class Watcher:
    """Of one namespace. `heard`: seconds since the newest tick output arrived."""

    def __init__(self, client: Client, namespace: str) -> None:
        self.client, self.namespace = client, namespace
        self.lock = threading.Lock()
        self._health: deque[bytes] = deque(maxlen=KEPT)
        self._shape: bytes | None = None
        self._contact: bytes | None = None
        self._frames: deque[np.record] = deque(maxlen=KEPT)
        self._heard = 0.0
        self.sentences: dict[str, tuple[int, str]] = {}
        self.problem = ""  # of a message that cannot be read

    def topic(self, name: str) -> str:
        """Absolute name."""
        return f"{self.namespace}/{name}"

    def listen(self) -> None:
        """Subscribe; best effort hears every publisher and holds none up."""
        for kind, channel, put in (
            (JointState, HEALTH, self._put_health),
            (PointCloud2, SHAPE, self._put_shape),
            (PointCloud2, CONTACT, self._put_contact),
        ):
            self.client.hear(kind, self.topic(channel.topic), put, reliable=False)
        self.client.hear(DiagnosticArray, "/diagnostics", self._put_diagnostics, reliable=False)

    def _put_health(self, data: bytes) -> None:
        with self.lock:
            self._health.append(bytes(data))
            self._heard = time.monotonic()

    def _put_shape(self, data: bytes) -> None:
        with self.lock:
            self._shape = bytes(data)

    def _put_contact(self, data: bytes) -> None:
        with self.lock:
            self._contact = bytes(data)

    def _put_diagnostics(self, data: bytes) -> None:
        found = {}
        for status in deserialize_message(data, DiagnosticArray).status:
            node, _, task = status.name.partition(": ")
            if node.strip("/").startswith(self.namespace.strip("/")) or node in ("cable_sim", ""):
                found[task or node] = (status.level[0], status.message)
        with self.lock:
            self.sentences.update(found)

    @property
    def heard(self) -> float | None:
        """Seconds since the newest tick output arrived, None before the first."""
        return time.monotonic() - self._heard if self._heard else None

    def publishers(self) -> int:
        """How many nodes publish tick outputs there."""
        return len(self.client.node.get_publishers_info_by_topic(self.topic(HEALTH.topic)))

    def take(self) -> tuple[np.recarray, Tick | None]:
        """Tick outputs since the last call, and what is drawn, where there is a new shape."""
        with self.lock:
            waiting, shape, contact = list(self._health), self._shape, self._contact
            self._health.clear()
            self._shape = None
        try:
            frames = decode_frames(waiting)
            table = decode(SHAPE, shape) if shape is not None else None
            load = decode(CONTACT, contact)["contact"] if contact is not None else None
        except Exception as error:  # of another version or a damaged message: said on the page, the rest goes on
            self.problem = (
                f"a message cannot be read ({type(error).__name__}: {error}); is the node of another version?"
            )
            return decode_frames([]), None
        whole = np.ones(len(frames), bool)
        for name in NEEDED:
            finite = np.isfinite(frames[name])
            whole &= finite if finite.ndim == 1 else finite.all(axis=1)
        if not whole.all() or (table is not None and not _drawable(table["shape"])):
            self.problem = "messages lack numbers that are drawn; is the node of another version?"
            frames = frames[whole].view(np.recarray)
            if table is not None and not _drawable(table["shape"]):
                table = shape = None
        if table is None or not len(frames):
            if shape is not None:
                with self.lock:
                    self._shape = self._shape or shape  # its tick output is on its way
            return frames, None
        near = int(np.argmin(np.abs(frames["time"] - table["time"])))
        return frames, Tick(frames[near], table["shape"], load)

    def _node(self) -> str:
        """Full name of the node; a publisher may be known before the name of its node."""
        deadline = time.monotonic() + NAMED_WITHIN
        while time.monotonic() < deadline:
            for one in self.client.node.get_publishers_info_by_topic(self.topic(HEALTH.topic)):
                if "UNKNOWN" not in one.node_name + one.node_namespace:
                    return f"{one.node_namespace.rstrip('/')}/{one.node_name}"
            time.sleep(0.05)
        raise WatchError(
            f"the node on {self.topic(HEALTH.topic)} did not say its name within {NAMED_WITHIN:g} s, so that its scene "
            "is not known: nothing was drawn; give --scene NAME or FILE"
        )

    def parameters(self, names: list[str]) -> dict[str, Any]:
        """Values of parameters of the node; names that it does not have are left out."""
        node = self._node()
        found: dict[str, Any] = {}
        for k in range(0, len(names), PART):
            part = names[k : k + PART]
            answer = self.client.call(GetParameters, f"{node}/get_parameters", GetParameters.Request(names=part))
            for name, value in zip(part, answer.values):
                if value.type:
                    found[name] = rclpy.parameter.parameter_value_to_python(value)
        return found

    def scene(self, given: str | None) -> Scene:
        """The scene of the node, with what its parameters change; given: a name or file in its place."""
        if given is not None:
            return load_scene(given)
        try:
            name = self.parameters(["scene"]).get("scene")
        except TowError as error:
            name, why = None, f": {error}"
        else:
            why = ""
        if not name:
            raise WatchError(
                f"the node on {self.topic(HEALTH.topic)} does not say which scene it has (parameter 'scene'){why}; "
                "nothing was drawn; give --scene NAME or FILE"
            )
        try:
            plain = settle({"scene": name}).scene
            known = {row.name: row.value for row in rows(plain)}
            there = self.parameters(list(known))
            changed = {key: value for key, value in there.items() if not _same(value, known[key])}
            return settle({"scene": name, **changed}).scene if changed else plain
        except (OSError, ValueError) as error:
            raise WatchInputError(
                f"the scene '{name}' of the node cannot be read here ({error}): nothing was drawn; give --scene with "
                "the same scene"
            ) from None


W = TypeVar("W", bound=Watcher)


def _drawable(shape: np.ndarray) -> bool:
    return len(shape) > 1 and bool(np.isfinite(shape).all())


def _same(one: Any, other: Any) -> bool:
    a = list(one) if isinstance(one, (list, tuple)) or hasattr(one, "tolist") else [one]
    b = list(other) if isinstance(other, (list, tuple)) else [other]
    return len(a) == len(b) and all(x == y or (x != x and y != y) for x, y in zip(a, b))


def domain() -> int:
    """ROS_DOMAIN_ID of the environment; WatchInputError where it is no number that can be one."""
    text = os.environ.get("ROS_DOMAIN_ID", "0") or "0"
    if not text.isdigit() or int(text) > 232:
        raise WatchInputError(f"ROS_DOMAIN_ID={text} is no number from 0 to 232; nothing was started")
    return int(text)


@contextmanager
def watching(
    namespace: str,
    wait: float,
    alive: Callable[[], bool],
    open_: bool = False,
    made: Callable[[Client, str], W] = Watcher,  # type: ignore[assignment]
    name: str = "",
) -> Iterator[W]:
    """A watcher of a node that is there; made: of which kind; name: of its own node. WatchError with what there is
    where none is within ``wait`` s."""
    space = "/" + namespace.strip("/") if namespace.strip("/") else ""
    discovery.limit([discovery.OPEN] if open_ else [])
    client = Client(domain(), name or f"cable_sim_view_{os.getpid()}")
    try:
        watcher = made(client, space)
        watcher.listen()
        deadline = time.monotonic() + wait
        while watcher.heard is None:
            client.check()
            if not alive():
                raise WatchError("ended before there was anything to draw")
            if time.monotonic() >= deadline:
                raise WatchError(_absent(watcher, wait))
            time.sleep(0.05)
        yield watcher
    finally:
        client.close()


def _absent(watcher: Watcher, wait: float) -> str:
    """Why nothing came, and what there is instead."""
    wanted = watcher.topic(HEALTH.topic)
    topics = dict(watcher.client.node.get_topic_names_and_types())
    kinds = [kind for kind in topics.get(wanted, []) if kind != HEALTH.msgtype]
    if kinds:
        return (
            f"{wanted} has messages of type {', '.join(kinds)}, not {HEALTH.msgtype}: this is no node of this program, "
            "and nothing was drawn; give the --namespace of one"
        )
    others = sorted(
        topic.removesuffix(f"/{HEALTH.topic}") or "/"
        for topic, found in topics.items()
        if topic.endswith(f"/{HEALTH.topic}") and topic != wanted and HEALTH.msgtype in found
    )
    if watcher.publishers():
        return (
            f"a node publishes {wanted}, but no message came within {wait:g} s: it waits for motion, is paused, or is "
            "not active; nothing was drawn. Start its motion (cable-sim play nbp1406), or give a longer --wait"
        )
    where = f" There is one in {', '.join(others)}: give --namespace {others[0]}" if others else ""
    return f"nothing publishes {wanted} within {wait:g} s; nothing was drawn." + (
        where or " Start a node (cable-sim node), or give --namespace, ROS_DOMAIN_ID, or a BAG"
    )
