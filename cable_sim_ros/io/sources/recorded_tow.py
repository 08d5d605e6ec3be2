"""Recorded bags as input: motion and commands in order of arrival, and what the bag recorded of the tow.

Inputs are found by `messages.find_topics`. Stamps are those of the messages' headers, arrivals the log times of the
bag, and both are judged as the live node judges them (`motion/arrival_order.py`). A bag that this program recorded has
a journal (`recordings/journal.py`) beside, which says what the simulation took and when.

What an imported bag keeps of how it came about: into the JSON and the verdict of a run under its motion.

Ship motion and winch commands of a bag of any kind: rosbag2 (MCAP, SQLite) or a ROS 1 file.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import cos, isfinite, nan, sin
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...files import read_bytes
from ...physics.heave_filter import Convention, Heave, MotionInput
from ...physics.inputs import Inputs
from ...sim.scene import Scene
from ...sim.verdict import Reason
from ..bags.bag import BagError, BagReader, Damage, report
from ..bags.mcap_file import size_text
from ..messages.channels import CHANNELS, channel_of, decode, decode_frames
from ..messages.commands import NEVER
from ..messages.messages import COMMANDS, KINDS, VEHICLES, Event, Refused, decode_odometry, find_topics, stamp_of
from ..messages.mounting import heading_of, moved_on
from ..motion.arrival_order import CONFIRM, DataClock, Intake, Stamp, Took
from ..recordings import journal
from .motion_curves import Given, Rounding, Samples, judged

MAX_INPUT = 1_000_000  # bytes; an Imu has 350, and a frame_id of megabytes is no name

STILL = 1_000_000_000  # ns; a longer step of the stamps says nothing of how long a bag lasts
LARGEST = 32 << 20  # bytes of a bag that is kept
AGREE = 0.5  # share of the time by the stamps that log times must cover to be arrivals

KEY = "import"  # of the custom data of a bag
ALONG = "speed_of_scene"  # of that: its log has no speed; {"heading": rad, null: along the yaw of each message}
OF_A_RUN = "imported"  # of the custom data of a run under its motion
KEPT = ("files", "records", "lost", "mappings", "motion", "given", "track")
LOST = "imported: lost records, "  # notes that begin so
MOST = 100  # notes of a run
LONGEST = 400  # characters of one


def read_motion(
    path: str | os.PathLike, topics: dict[str, str] | None = None, damage: Damage | None = None
) -> Iterator[tuple[int, str, bytes]]:
    """(log time ns, kind, CDR bytes) of a bag.

    kind is one of KINDS; topics: kind -> name where the search by type and name is not to decide.
    Order: time, then topic (those of the winch commands as one), then order of recording. damage: as in `read_bag`;
    larger messages than MAX_INPUT are left out and counted there. BagError if the bag cannot be read or has no ship
    motion.
    """
    with BagReader(path) as reader:
        names = find_topics(reader.topics, topics)
        if not {"imu", "odometry"} & set(names):
            raise BagError(
                f"bag '{path}' has neither {KINDS['imu'][0]} nor {KINDS['odometry'][0]}: no ship motion "
                f"was read; record imu/data or odom"
            )
        kinds = {name: kind for kind, name in names.items()}
        winch = min((name for kind, name in names.items() if kind in COMMANDS), default="")
        place = {name: winch if kind in COMMANDS else name for name, kind in kinds.items()}
        same: list[tuple[str, bytes]] = []  # messages of one time
        now = 0
        for topic, _, time, data in reader.read(kinds):
            if len(data) > MAX_INPUT:
                reader.damage.add(f"messages of '{topic}' above {size_text(MAX_INPUT)} are left out")
                continue
            if time != now:
                yield from ((now, kinds[name], item) for name, item in sorted(same, key=lambda pair: place[pair[0]]))
                same, now = [], time
            same.append((topic, data))
        yield from ((now, kinds[name], item) for name, item in sorted(same, key=lambda pair: place[pair[0]]))
        report(reader, damage)


class Span(NamedTuple):
    """Motion between two jumps of its clock: stamps of the first and the last message [ns], and their number."""

    start: int
    end: int
    count: int  # type: ignore[assignment]  # a tuple's own count() is not used here


@dataclass
class RecordedTow:
    """A bag read once: input events in order of arrival, recorded outputs by channel, what the bag says of itself."""

    path: str
    events: list[Event]
    outputs: dict[str, list[bytes]] = field(default_factory=dict)  # name of the channel -> messages in order
    about: dict[str, str] = field(default_factory=dict)  # custom data of the bag
    journal: list[bytes] = field(default_factory=list)
    behind: dict[str, list[int]] = field(default_factory=dict)  # name of the channel -> of each message, how many of
    # the journal stand before it in the bag
    notices: list[str] = field(default_factory=list)  # what a user should know of the bag
    damage: str = ""  # what could not be read
    rounded: list[dict[str, object]] = field(default_factory=list)  # columns that were smoothed, for the JSON
    unfit: set[str] = field(default_factory=set)  # kinds of messages that are refused from the beginning
    doubts: list[Reason] = field(default_factory=list)  # what of the motion makes a run under it doubtful
    heading: float | None = None  # rad, of the mean track, where it is not to be taken from the messages
    imported: dict[str, object] = field(default_factory=dict)  # how an imported bag came about, for the JSON
    ship_plan: str = ""  # that the ship goes by, its text
    sea_motion: dict[str, object] = field(default_factory=dict)  # of motion by the waves of the scene, for the JSON

    @cached_property
    def spans(self) -> list[Span]:
        """The motion by its stamps; odd stamps belong to none."""
        clock, spans = DataClock(), []
        for event in self.events:
            if not event.is_motion:
                continue
            judged = clock.judge(event.time, event.arrival)
            if judged is Stamp.FITS:
                if clock.offset is None:
                    spans.append(Span(event.time, event.time, 0))
                first, last, count = spans[-1]
                spans[-1] = Span(first, max(last, event.time), count + 1)
                clock.update(event.time, event.arrival)
            elif judged is Stamp.JUMPED:
                clock.reset()
                if spans[-1].count < CONFIRM:  # it was the odd one
                    spans.pop()
        return spans or [Span(0, 0, 0)]

    @property
    def start(self) -> int:
        """Stamp of the first motion message, ns."""
        return self.spans[0].start

    @property
    def end(self) -> int:
        """Stamp of the last motion message, ns."""
        return self.spans[-1].end

    @property
    def length(self) -> int:
        """Time that the motion covers, ns."""
        return sum(span.end - span.start for span in self.spans)

    @cached_property
    def rate(self) -> float:
        """Motion messages per second."""
        return sum(span.count for span in self.spans) / max(1e-9, self.length * 1e-9)

    def judge(self, found: dict[int, Rounding], motion: Samples, sheave: tuple[float, float, float]) -> None:
        """Put what rounding left of a motion into `rounded`, `notices` and `doubts`; as `judged`."""
        rounded, notices, doubts = judged(self.path, found, motion, sheave)
        self.rounded, self.doubts = [*self.rounded, *rounded], [*self.doubts, *doubts]
        self.notices += notices


def odometry_of(tow: RecordedTow) -> tuple[np.ndarray, np.ndarray]:
    """Odometry in order of arrival: stamps [n] in ns, and x, y, z [m], roll, pitch, yaw [rad, without jumps] as [n, 6].

    Refused messages are left out.
    """
    rows = []
    for event in tow.events:
        if event.kind == "odometry":
            try:
                message = decode_odometry(event.data, Convention.ENU)
            except Refused:
                continue
            rows.append((event.time, (*message.position, *message.angles)))
    value = np.array([row[1] for row in rows], float).reshape(-1, 6)
    value[:, 3:] = np.unwrap(value[:, 3:], axis=0)
    return np.array([row[0] for row in rows], np.int64), value


def read_tow(
    path: str | os.PathLike, *, imu_only: bool = False, topics: Mapping[str, str] | None = None
) -> RecordedTow:
    """Read a bag; one with the content of the last that was read is not decoded again.

    imu_only: leave odometry out; topics: as of `read_motion`. BagError if it cannot be read, or holds neither motion
    nor journal.
    """
    path = os.fspath(path)
    content = _content(Path(path))
    key = (path, content, imu_only, tuple(sorted((topics or {}).items())))
    tow = _last_read.get(key) or _read_tow(path, imu_only, topics)
    _last_read.clear()
    if content and not tow.damage:
        _last_read[key] = tow
    taken = replace(tow, rounded=[], unfit=set(), doubts=[])
    taken.events, taken.about, taken.notices = list(tow.events), dict(tow.about), list(tow.notices)
    return taken


_last_read: dict[tuple, RecordedTow] = {}  # nobody writes to it


def _content(path: Path) -> bytes:
    """What a bag holds, as a digest; empty where it is too large to be kept, or cannot be read."""
    digest = hashlib.sha256()
    try:
        files = sorted(path.iterdir()) if path.is_dir() else [path]
        if not all(file.is_file() for file in files) or sum(file.stat().st_size for file in files) > LARGEST:
            return b""
        for file in files:
            digest.update(os.fsencode(file.name) + b"/" + hashlib.sha256(read_bytes(file)).digest())
    except OSError:
        return b""
    return digest.digest()


def _read_tow(path: str, imu_only: bool, topics: Mapping[str, str] | None) -> RecordedTow:
    """As `read_tow`, from the files."""
    outputs: dict[str, list[bytes]] = {}
    behind: dict[str, list[int]] = {}
    entries: list[bytes] = []
    damage, lost = Damage(), Damage()
    with BagReader(path) as reader:
        about = dict(reader.custom_data)
        ours = [name for name, kind in reader.topics.items() if channel_of(name, kind) or _is_journal(name, kind)]
        kept = any(_is_journal(name, kind) for name, kind in reader.topics.items())
        # in lockstep a restore takes the clock back: the order of the log times is not that of the ticks then
        for message in reader.as_written(ours) if kept else reader.read(ours) if ours else ():
            channel = channel_of(message.topic, message.msgtype)
            if channel is not None:
                outputs.setdefault(channel.name, []).append(message.data)
                behind.setdefault(channel.name, []).append(len(entries))
            else:
                entries.append(message.data)
        report(reader, damage)
    events = []
    try:
        for time, kind, data in read_motion(path, dict(topics or {}), damage=lost):
            if not (imu_only and kind == "odometry"):
                events.append(Event(stamp_of(data), time, kind, data))
    except BagError:
        if not entries:  # with them it is a run without motion
            raise
    if not entries and not any(event.is_motion for event in events):
        raise BagError(
            f"bag '{path}' holds no {KINDS['imu'][0]}: nothing was simulated; leave --imu-only out, or give "
            "a bag with an IMU"
        )
    tow = RecordedTow(
        path, events, outputs, about, entries, behind, damage=str(lost or damage) if lost or damage else ""
    )
    if not usable_arrivals(events):
        tow.events = by_stamps(events)
        tow.notices.append(
            f"{path}: the log times do not run with the stamps of the motion, so they are no times of arrival: "
            f"messages are taken in their order, as if each had come at once"
        )
    return tow


def _is_journal(topic: str, msgtype: str) -> bool:
    return msgtype == journal.MSGTYPE and f"/{topic}".endswith(f"/{journal.TOPIC}")


def usable_arrivals(events: list[Event]) -> bool:
    """Can the log times be times of arrival? Not where they stand still while the stamps go on."""
    motion = [event for event in events if event.is_motion]
    by_stamp = sum(min(max(b.time - a.time, 0), STILL) for a, b in zip(motion, motion[1:]))
    by_log = motion[-1].arrival - motion[0].arrival if motion else 0
    return by_log >= AGREE * by_stamp


def by_stamps(events: list[Event]) -> list[Event]:
    """The events as if each had come at once: the arrival runs with the stamps, whose jumps are left out."""
    out, now, last = [], events[0].time if events else 0, None
    for event in events:
        if event.is_motion:
            if last is not None:
                now += min(max(event.time - last, 0), STILL)
            last = event.time
        out.append(event._replace(arrival=now))
    return out


class Feeder:
    """Pushes the events of a bag into the rings, in order of arrival, up to a time; its intake counts refusals.

    `jumped`: the clock of the motion has jumped, and no more comes before `follow`.
    """

    def __init__(
        self,
        inputs: Inputs,
        tow: RecordedTow,
        scene: Scene,
        motion: MotionInput | None = None,
        heave: Heave | None = None,
        drum: np.record | None = None,
    ) -> None:
        self.intake = Intake(inputs, scene, motion, heave, drum=drum)
        self.inputs, self.tow, self.jumped = inputs, tow, False
        self.position = 0  # events that have been pushed

    @property
    def following(self) -> int:
        """Stamp of the next event, ns."""
        return self.tow.events[self.position].time

    @property
    def done(self) -> bool:
        """True when every event has been pushed."""
        return self.position >= len(self.tow.events)

    def until(self, time_ns: int) -> list[Event]:
        """Push every event up to this time, or to a jump of the clock; returns them.

        The time of motion is its stamp, that of a command its arrival on the clock of the motion. An odd stamp has
        none: it is judged in its turn.
        """
        first, events = self.position, self.tow.events
        while not self.jumped and self.position < len(events) and self._due(events[self.position]) <= time_ns:
            event = events[self.position]
            self.position += 1
            if event.is_command:
                self.intake.command(event.data, event.arrival, event.kind)
            elif event.kind in VEHICLES:
                self.intake.of_vehicle(event)
            else:
                self.jumped = self.intake.motion(event) is Took.JUMPED
        return events[first : self.position]

    def follow(self) -> None:
        """Go on behind a jump of the clock; no tick may run meanwhile."""
        self.intake.jump()
        self.jumped = False

    def _due(self, event: Event) -> int:
        if event.is_motion:
            known = self.intake.clock.offset is not None and self.intake.clock.fits(event.time, event.arrival)
            return event.time if known else NEVER
        now = self.intake.clock.now(event.arrival)
        return NEVER if now is None else now


class Residual(NamedTuple):
    """Ours less what the bag recorded, of one quantity: mean, RMS and largest magnitude over `count` times."""

    channel: str
    quantity: str
    unit: str
    mean: float
    rms: float
    largest: float
    count: int  # type: ignore[assignment]  # a tuple's own count() is not used here


COMPARED = (  # channel, quantity, unit, field of the tick output, component or None
    ("sheave/tension", "tension", "N", "tension", None),
    ("towbody/pose", "x", "m", "body_position", 0),
    ("towbody/pose", "y", "m", "body_position", 1),
    ("towbody/pose", "z", "m", "body_position", 2),
    ("winch/state", "payout", "m", "payout", None),
    ("winch/state", "payout rate", "m/s", "payout_rate", None),
    ("winch/state", "tension at the drum", "N", "tension_drum", None),
)
CHANNEL_NAMES = {"sheave/tension": "sheave_tension", "towbody/pose": "towbody_pose", "winch/state": "winch_state"}


class SameTicks:
    """Which recorded message is of which simulated tick, by the number of the tick in the count of the program that
    recorded. That count goes on over resets, jumps and restores, which stamps do not.

    segments: of the journal; numbers: of the simulated ticks, in order; period: of a tick [ns].
    """

    def __init__(self, tow: RecordedTow, segments: list[journal.Segment], numbers: np.ndarray, period: int) -> None:
        self.tow, self.segments, self.numbers, self.period = tow, segments, numbers, period
        self._begins = np.array([segment.message for segment in segments])

    def recorded(self, channel: str, time: np.ndarray) -> np.ndarray:
        """Numbers of the ticks of a channel's messages, -1: of none; time: their stamps [ns]."""
        of = np.searchsorted(self._begins, np.array(self.tow.behind.get(channel, ()), np.int64), "left") - 1
        found = np.full(len(time), -1, np.int64)
        for k, segment in enumerate(self.segments):
            found[of == k] = segment.number(np.asarray(time)[of == k], self.period)
        return found

    def of(self, channel: str, time: np.ndarray) -> np.ndarray:
        """Places among the simulated ticks of a channel's messages, -1: none."""
        wanted = self.recorded(channel, time)
        at = np.minimum(np.searchsorted(self.numbers, wanted), max(0, len(self.numbers) - 1))
        return np.where(self.numbers[at] == wanted, at, -1) if len(self.numbers) else np.full(len(wanted), -1)


def paired(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Index of the tick of ours at each time of theirs, -1: none; both in order, times may come again after a jump."""
    places: dict[int, list[int]] = {}
    for k, time in enumerate(ours.tolist()):
        places.setdefault(time, []).append(k)
    found, minimum = np.full(len(theirs), -1), 0
    for i, time in enumerate(theirs.tolist()):
        later = [k for k in places.get(time, ()) if k >= minimum]
        if later:
            found[i] = minimum = later[0]
    return found


def recorded_values(
    tow: RecordedTow, wanted: Iterable[tuple[str, str, int | None]]
) -> Iterator[tuple[np.ndarray, np.ndarray] | None]:
    """Stamps [ns] and values that a bag recorded, of each (name of a channel, field of it, component or None); None
    where it lacks the channel."""
    table = {channel.name: channel for channel in CHANNELS}
    decoded: dict[str, list[dict]] = {}
    for name, field_, part in wanted:
        if name not in decoded:
            decoded[name] = [decode(table[name], data) for data in tow.outputs.get(name, ())]
        rows = decoded[name]
        values = [row[field_] if part is None else row[field_][part] for row in rows]
        yield (np.array([row["time"] for row in rows], np.int64), np.array(values, float)) if rows else None


def residuals(frames: np.recarray, tow: RecordedTow, same: SameTicks | None = None) -> list[Residual]:
    """What the bag recorded of the tow against the simulated tick outputs, at the same ticks, or at equal stamps.

    At a stamp that is no tick of ours, ours are interpolated linearly, but not where ``same`` says which are the same
    ticks. Only the time both cover counts. A channel that the bag lacks has no row.
    """
    rows: list[Residual] = []
    if not len(frames):
        return rows
    ours_time = frames["time"].astype(np.int64)
    recorded = recorded_values(tow, [(CHANNEL_NAMES[topic], name, part) for topic, _, _, name, part in COMPARED])
    for (topic, quantity, unit, name, part), had in zip(COMPARED, recorded):
        if had is None:
            continue
        time, value = had
        ours = frames[name] if part is None else frames[name][:, part]
        if topic == "sheave/tension":  # a wrench has the norm of the pull, also of a push
            ours = np.abs(ours)
        at = paired(ours_time, time) if same is None else same.of(CHANNEL_NAMES[topic], time)
        rest = ours[at] - value
        covered = (time >= ours_time[0]) & (time <= ours_time[-1])
        between = (at < 0) & (same is None) & covered & bool((np.diff(ours_time) > 0).all())
        origin = ours_time[0]  # differences of nanoseconds are exact in float64, the stamps are not
        rest[between] = np.interp((time[between] - origin).astype(float), (ours_time - origin).astype(float), ours)
        rest[between] -= value[between]
        rest = rest[((at >= 0) | between) & np.isfinite(value)]  # NaN: an import whose log had no such number
        if not len(rest):
            continue
        rms, largest = float(np.sqrt(np.mean(rest**2))), float(np.abs(rest).max())
        rows.append(Residual(topic, quantity, unit, float(rest.mean()), rms, largest, len(rest)))
    return rows


def recorded_frames(tow: RecordedTow) -> np.recarray | None:
    """The tick outputs the bag recorded (``sim/health``), None if it has none."""
    messages = tow.outputs.get("sim_health")
    return decode_frames(messages) if messages else None


def take_provenance(tow: RecordedTow, sheave: tuple[float, float, float]) -> None:
    """Put assumptions, losses and what rounding left of an import into `imported`, `notices`, `rounded`, `doubts`."""
    tow.imported = provenance(tow.about)
    about = kept_in(tow.about, KEY)
    if about is None:
        return
    tow.notices += [f"{tow.path}: {line}"[:LONGEST] for line in _lines(about, "said")[:MOST]]
    found = _roundings(about)
    motion = _moving(tow) if found else None
    if motion is not None:
        tow.judge(found, motion, sheave)


def provenance(custom_data: Mapping[str, str]) -> dict[str, Any]:
    """Figures of an import with `notes` of what it assumed, lacks and lost; empty for any other bag.

    custom_data: of an imported bag, or of the recording of a run under its motion.
    """
    about = kept_in(custom_data, KEY)
    if about is None:
        about = kept_in(custom_data, OF_A_RUN)
        if about is None:
            return {}
        notes = _lines(about, "notes")
    else:
        notes = [f"imported: {line}" for line in _lines(about, "assumed") + _lines(about, "missing")]
        notes += [f"{LOST}{line}" for line in _lines(about, "losses")]
    figures = {name: about[name] for name in KEPT if name in about}
    return figures | {"notes": [note[:LONGEST] for note in notes[:MOST]]}


def needs_speed(custom_data: Mapping[str, str]) -> bool:
    """Is it an imported bag whose log has no speed?"""
    return isinstance((kept_in(custom_data, KEY) or {}).get(ALONG), dict)


def at_speed(events: list[Event], custom_data: Mapping[str, str], speed: float) -> list[Event]:
    """Motion of an imported bag whose log has no speed, at one ahead [m/s]; of any other bag as it is."""
    about = (kept_in(custom_data, KEY) or {}).get(ALONG)
    if not isinstance(about, dict):
        return events
    heading = about.get("heading")
    out, last, east, north = list[Event](), None, 0.0, 0.0
    for event in events:
        yaw = heading_of(event.data) if event.kind == "odometry" else nan
        if isfinite(yaw):
            yaw = heading if isinstance(heading, float) and isfinite(heading) else yaw
            now = event.time, speed * cos(yaw), speed * sin(yaw)
            if last is not None:
                half = 0.5e-9 * (event.time - last[0])
                east, north = east + half * (last[1] + now[1]), north + half * (last[2] + now[2])
            last = now
            event = event._replace(data=moved_on(event.data, (east, north), now[1:]))
        out.append(event)
    return out


def kept_in(custom_data: Mapping[str, str], key: str) -> dict[str, Any] | None:
    """A JSON object in what a bag says of itself; None where there is none."""
    try:
        found = json.loads(custom_data.get(key, ""))
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def _lines(about: dict[str, Any], key: str) -> list[str]:
    found = about.get(key)
    return [str(line) for line in found] if isinstance(found, list) else []


def _roundings(about: dict[str, Any]) -> dict[int, Rounding]:
    """Of each coordinate, as `Rounding` was kept: name, unit, scale, angle, five numbers."""
    out = {}
    try:
        for key, (name, unit, scale, angle, *rest) in about.get("rounding", {}).items():
            numbers = [float(one) for one in rest]
            if int(key) in range(6) and len(numbers) == 5 and np.isfinite(numbers).all():
                out[int(key)] = Rounding(Given(str(name), str(unit), float(scale), bool(angle)), *numbers)
    except (TypeError, ValueError, AttributeError):
        return {}
    return out


def _moving(tow: RecordedTow) -> Samples | None:
    time, value = odometry_of(tow)
    if len(time) < 3:
        return None
    t = (time - time[0]) * 1e-9
    if not (np.diff(t) > 0.0).all():
        return None
    return Samples(time, value, np.gradient(value, t, axis=0))
