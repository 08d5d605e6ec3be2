"""A log and a mapping to signals: fields found, units and axes turned, times put in order, lever arms taken out.

Values that a device sends where it has none: an attitude of identity, zeros, 9.999.

Such a value is legal by itself. It stands still to the bit while signals move that it must follow: a ship that rolls
also pitches and heaves, a gyro that turns has an attitude that turns. Where it does so for the whole log, or for a
stretch that its own movement elsewhere rules out, it is no measurement.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ....sim.tables.attitude import angles_of
from ..log import SECOND, Log, LogError
from ..not_valid import last_before
from ..own_signals import QUANTITIES, Signal
from .lever_arm import Vector, at_base_link
from .mapping_file import Clock, Entry, Frame, Mapping, dimension_of, fields_of, sources_of, word_of
from .time_base import ascending, begin_of, dated, device_of, every, least_delay, thinned
from .units import AMBIGUOUS, UNITS, named, nearest
from .words import SHOWN, VECTORS, WORDS, column_of, find_sources, listed, near, one_after_another

FEWEST, SHORTEST = 30, 5.0  # records and s that stand still
AS_USUAL = 0.3  # of its deviation in the whole log: a signal that keeps to less is at rest itself
FINE = 0.1  # of its own deviation: a coarser resolution may stand still in a seaway
STEPS = 8  # values that a signal takes, at least, where it moves
_WAVES, _RATES = ("roll", "pitch", "heave"), ("roll_rate", "pitch_rate", "yaw_rate")
_FORCES = ("acceleration_x", "acceleration_y", "acceleration_z")
FOLLOWS: dict[str, tuple[str, ...]] = {  # signal -> signals that do not move without it
    "roll": ("pitch", "heave", "roll_rate"),
    "pitch": ("roll", "heave", "pitch_rate"),
    "heave": ("roll", "pitch", "heave_rate"),
    "surge": _WAVES,
    "sway": _WAVES,
    "heave_rate": _WAVES,
    **dict.fromkeys(_RATES, ("roll", "pitch")),
    **dict.fromkeys(_FORCES, (*_WAVES, *_RATES)),
    "latitude": ("speed",), "longitude": ("speed",), "x": ("speed",), "y": ("speed",),
}  # fmt: skip
PLACES = {"latitude": "longitude", "longitude": "latitude", "x": "y", "y": "x"}  # one alone may stand: due east
UNDER_WAY = 0.5  # m/s, that a place cannot stand still

SHIP = (Frame.FLU, Frame.FRD)
CONSTANT = 30  # records that are all the same, where others of the same signal are not


def without_placeholders(signals: dict[str, tuple[Signal, Entry]], missing: list[str]) -> None:
    """Take them out of the signals in place, each named in `missing` with its count; whole signals go."""
    still = {name: _still(signal, name in PLACES) for name, (signal, _) in signals.items() if name in FOLLOWS}
    found: dict[str, np.ndarray] = {}
    for name, stretches in still.items():
        signal = signals[name][0]
        bad = np.zeros(len(signal.time), bool)
        moving: list[str] = []
        for a, b in stretches:
            others = [one for one in FOLLOWS[name] if one in signals and _moves(signals[one][0], signal, a, b)]
            twin = PLACES.get(name)
            if twin and not (twin in still and any(_overlap(signal, a, b, signals[twin][0], *s) for s in still[twin])):
                others = []
            if others:
                bad[a:b] = True
                moving += others
        if bad.any():
            found[name] = bad
            values = ", ".join(f"{value:.6g}" for value in np.unique(signal.value[bad])[:3])
            missing.append(
                f"{name}: {values} {signal.unit} to the bit in {int(bad.sum())} of {len(bad)} records while "
                f"{' and '.join(dict.fromkeys(moving))} moves: no measurement, left out"
            )
    yaw = signals.get("yaw")
    if yaw and all(name in found and found[name].all() and signals[name][1] is yaw[1] for name in ("roll", "pitch")):
        if not np.ptp(yaw[0].value):
            found["yaw"] = np.ones(len(yaw[0].time), bool)  # of the same attitude
            missing.append("yaw: of the same attitude, left out")
    for name, bad in found.items():
        signal = signals[name][0]
        if bad.all():
            del signals[name]
        else:
            signal.time, signal.value = signal.time[~bad], signal.value[~bad]


def _still(signal: Signal, coarse: bool) -> list[tuple[int, int]]:
    """Stretches [a, b) in which a signal stands still to the bit longer than its movement elsewhere allows."""
    value, n = signal.value, len(signal.value)
    steps = np.diff(value)
    if n < FEWEST:
        return []
    if not steps.any():
        return [(0, n)]
    ends = np.concatenate(([0], np.flatnonzero(steps) + 1, [n]))
    runs = [
        (a, b)
        for a, b in zip(ends[:-1].tolist(), ends[1:].tolist())
        if b - a >= FEWEST and (signal.time[b - 1] - signal.time[a]) / SECOND >= SHORTEST
    ]
    if not runs or coarse:
        return runs
    rest = np.ones(n, bool)
    for a, b in runs:
        rest[a:b] = False
    if rest.sum() < FEWEST or float(np.abs(steps[steps != 0.0]).min()) > FINE * float(value[rest].std()):
        return []
    return runs


def _moves(other: Signal, signal: Signal, a: int, b: int) -> bool:
    """Does another signal move as usual while this one stands?"""
    inside = (other.time >= signal.time[a]) & (other.time <= signal.time[b - 1])
    part = other.value[inside]
    if other.quantity == "speed":
        return len(part) > 0 and float(np.median(part)) > UNDER_WAY
    if len(part) < FEWEST or len(np.unique(part)) < STEPS:
        return False
    return float(part.std()) >= AS_USUAL * float(other.value.std())


def _overlap(one: Signal, a: int, b: int, other: Signal, c: int, d: int) -> bool:
    return bool(one.time[a] < other.time[d - 1] and other.time[c] < one.time[b - 1])


@dataclass
class Applied:
    """What a mapping makes of a log: signals; what it could not, a line each; what was done about times and values."""

    signals: list[Signal]
    missing: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    empty: int = 0  # records without a number in a field that is mapped, of the field that has most
    velocities: dict[int, Vector] = field(default_factory=dict)  # by the id of their entry


def applied(log: Log, mapping: Mapping, ready: bool = False) -> Applied:
    """Signals, and what of the mapping the log does not give."""
    out = Applied([])
    whole: dict[str, tuple[Signal, Entry]] = {}
    for name, entry in mapping.signals.items():
        found = find_sources(log, sources_of(entry))
        if not found:
            if not entry.optional:
                wanted = sources_of(entry)
                text = f"there is no source {listed(wanted)}. {near(wanted[0], [*log.sources, *log.left])}"
                out.missing.append(f"{log.path}: signals.{name}: {text}")
            continue
        for signal in _of_entry(log, mapping, name, entry, found, ready, out):
            if signal.quantity in whole:
                if entry.optional:
                    continue
                out.missing.append(
                    f"{log.path}: signals.{name}: {signal.quantity} is given by {whole[signal.quantity][0].source} "
                    f"already; this one is left out"
                )
                continue
            whole[signal.quantity] = (signal, entry)
    if not whole:
        known = listed([*log.sources, *log.left]) or "none"
        lines = "; ".join(out.missing[:SHOWN])
        raise LogError(
            f"{log.path}: the mapping '{mapping.mapping}' gives no signal of it ({lines or 'no usable record'}); "
            f"nothing was read. Sources of the log: {known}. `cable-sim inspect --mapping-out FILE` writes a first one"
        )
    without_placeholders(whole, out.missing)
    _check_overlap(log, list(whole.values()))
    at_base_link(whole, out.velocities, _of_velocity, out.missing)
    out.signals = [signal for signal, _ in whole.values()]
    return out


def covers(log: Log, mapping: Mapping) -> bool:
    """Are all entries that are not optional there, and one at all?"""
    return entries_covered(log, mapping) > 0 and all(
        entry.optional or _there(log, entry) for entry in mapping.signals.values()
    )


def entries_covered(log: Log, mapping: Mapping) -> int:
    """Entries whose source and fields a log has."""
    return sum(_there(log, entry) for entry in mapping.signals.values())


def _there(log: Log, entry: Entry) -> bool:
    found = find_sources(log, sources_of(entry))
    return any(all(column_of(source, name) for name in fields_of(entry)) for source in found)


def _of_entry(log, mapping, name, entry, found, ready, out) -> list[Signal]:
    """Signals of one entry, of all its sources in order of time."""
    where = f"{log.path}: signals.{name}"
    times, rows = [], []
    assumed: list[str] = []
    dimension = dimension_of(word_of(name, entry))
    kept_sources = []
    found, beside = one_after_another(found, fields_of(entry))
    if beside:
        out.said.append(
            f"{where}: {listed(s.name for s in beside)} left out beside {listed(s.name for s in found)}; "
            f"name another one with `source`"
        )
    for source in found:
        columns = []
        for wanted in fields_of(entry):
            column = column_of(source, wanted)
            if column is None:
                text = f"{where}.field = {wanted}: {source.name} has no such field"
                if entry.optional:
                    out.missing.append(f"{text}; it is left out")
                    break
                raise LogError(f"{text}; nothing was used. {near(wanted, [*source.columns, *source.left])}")
            columns.append(column)
        if len(columns) < len(fields_of(entry)):
            continue
        assumed += [f"{name}: {line}" for line in source.doubts]
        unit = _unit(where, entry, source, columns[0], dimension, ready, assumed)
        raw = np.stack([source.columns[column] for column in columns])
        time, usable = _times(log, where, entry, source, ready, assumed, out.said)
        there = np.isfinite(raw).all(axis=0)
        empty = int((~there).sum())
        if empty:
            out.said.append(f"{where}: {empty} of {len(source)} records of {source.name} have no number there")
            out.empty = max(out.empty, empty)
        good = usable & there & accepted_records(log, where, entry, source, raw, time, out.said)
        if not good.any():
            out.missing.append(f"{where}: no record of {source.name} is usable; it is left out")
            continue
        values = entry.sign * (UNITS[unit].factor * (entry.factor * raw + entry.offset) + UNITS[unit].offset)
        times.append(time[good])
        rows.append(values[:, good])
        kept_sources.append(source.name)
    if not times:
        return []
    time, values = np.concatenate(times), np.concatenate(rows, axis=1)
    if len(times) > 1:
        order = np.argsort(time, kind="stable")
        time, values = time[order], values[:, order]
        assumed.append(f"{name}: {listed(kept_sources)} taken as one source whose name changed")
        for label, part in zip(kept_sources, rows):
            if part.shape[1] >= CONSTANT and not np.ptp(part, axis=1).any():
                assumed.append(f"{name}: {label} has {part[0, 0]:.6g} throughout, which no sensor gives; it is kept")
    time, values = _ordered(where, entry, time, values, out.said)
    still = [one for one, row in zip(fields_of(entry), values) if len(row) >= CONSTANT and not np.ptp(row)]
    if still and len(times) == 1:
        assumed.append(f"{name}: {listed(still)} the same in all {values.shape[1]} records: constant, or no sensor")
    if ready:
        assumed.append(f"{name}: sign, unit and axes by the ready mapping {mapping.mapping}, not told for this device")
    if word_of(name, entry) == "payout" and values.max() < 0.0:
        assumed.append(
            f"{name}: negative throughout, {values.min():.6g} to {values.max():.6g} m, where paid out counts positive: "
            f"another sign or zero of the counter? `sign: -1` or `offset` in a mapping of your own turns it"
        )
    label = f"{log.path}: {listed(kept_sources)}.{','.join(fields_of(entry))}"
    made = _words(name, entry, mapping, time, values, assumed)
    if word_of(name, entry) == "velocity":
        out.velocities[id(entry)] = _upward(entry.frame or Frame.ENU, time, values)
    return [Signal(q, t, v, label, list(dict.fromkeys([*assumed, *more]))) for q, t, v, more in made]


def _unit(where, entry, source, column, dimension, ready, assumed) -> str:
    told = source.units.get(column, "")
    if entry.unit:
        unit = named(entry.unit)
        assert unit is not None  # checked with the file
        return unit
    unit = named(told) if told else None
    if unit is not None and UNITS[unit].dimension == dimension:
        return unit
    if unit is not None:
        raise LogError(
            f"{where}: {source.name}.{column} is in {told} by the log, which does not fit {dimension}; nothing was "
            f"used. Map it to another quantity, or give its unit"
        )
    if told.strip().lower() in AMBIGUOUS:
        raise LogError(
            f"{where}: {source.name}.{column} is in {told} by the log; nothing was used. {nearest(told, dimension)}"
        )
    if dimension != "1":
        assumed.append(f"{where.rpartition('.')[2]}: the log tells no unit of {column}, taken as {dimension}")
    return "1" if dimension == "1" else dimension if dimension in UNITS else "1"


def _times(log, where, entry, source, ready, assumed, said) -> tuple[np.ndarray, np.ndarray]:
    """Stamps [ns] of each record of a source, and which are there."""
    name = where.rpartition(".")[2]
    chosen = entry.time
    every_one = np.ones(len(source), bool)
    stamps = next(iter(find_sources(log, [entry.stamped_by])), None) if entry.stamped_by else None
    if entry.stamped_by and (stamps is not None or not ready):
        if stamps is None:
            raise LogError(
                f"{where}.stamped_by = {entry.stamped_by}: there is no such source; nothing was used. "
                f"{near(entry.stamped_by, [*log.sources, *log.left])}"
            )
        device, there = device_of(source, stamps, where)
        device = dated(device, source.logged)
        spare = int((~there).sum())
        if spare:
            said.append(f"{where}: {spare} records have no {entry.stamped_by} within 5 s before them and were left out")
        assumed.append(f"{name}: holds at the time of the last {stamps.name}; the log does not say so")
        return device + round(entry.clock_offset * SECOND), there
    if chosen is None:
        chosen = Clock.LOGGED if source.logged is not None else Clock.DEVICE
        if chosen is Clock.LOGGED:
            assumed.append(f"{name}: stamps of the logger; the delay from sensor to logger is taken as 0 s")
    if chosen is Clock.LOGGED:
        if source.logged is None:
            raise LogError(f"{where}.time = logged: the logger left no stamps; nothing was used. Take time: device")
        return source.logged + round(entry.clock_offset * SECOND), every_one
    if source.device is None:
        raise LogError(
            f"{where}.time = {chosen.value}: {source.name} tells no clock of its own; nothing was used. "
            f"Take time: logged{', or stamped_by another source' if source.logged is not None else ''}"
        )
    device = dated(source.device, source.logged)
    if chosen is Clock.ALIGNED:
        if source.logged is None:
            raise LogError(
                f"{where}.time = aligned: the logger left no stamps to align with; nothing was used. "
                f"Take time: device and clock_offset"
            )
        shift = least_delay(device, source.logged)
        spread = float(np.ptp(np.percentile(source.logged - device, (5, 95)))) / SECOND
        said.append(
            f"{where}: device clock moved by {shift / SECOND:.6g} s onto the logger's (delays spread {spread:.3g} s)"
        )
        device = device + shift
    return device + round(entry.clock_offset * SECOND), every_one


def _ordered(where, entry, time, values, said) -> tuple[np.ndarray, np.ndarray]:
    """Times that ascend strictly, values with them."""
    stamps = ascending(time, where)
    said += stamps.said
    time, values = stamps.time[stamps.kept], values[:, stamps.kept]
    rows = [thinned(time, row, entry.duplicates.value) for row in values]
    if rows[0][2]:
        said.append(f"{where}: {rows[0][2]} records stood at the time of another: the {entry.duplicates.value} counts")
    time, values = rows[0][0], np.stack([row[1] for row in rows])
    if entry.fresh_only and len(time):
        new = np.concatenate(([True], (np.diff(values, axis=1) != 0.0).any(axis=0)))
        if not new.all():
            said.append(f"{where}: {int((~new).sum())} values that repeat the one before were left out (fresh_only)")
        time, values = time[new], values[:, new]
    if entry.every > 0.0:
        kept = every(time, round(entry.every * SECOND))
        time, values = time[kept], values[:, kept]
    return time, values


Made = tuple[str, np.ndarray, np.ndarray, list[str]]  # quantity, time, value, what was assumed of it


def _words(name, entry: Entry, mapping: Mapping, time, values, assumed) -> list[Made]:
    word = word_of(name, entry)
    if word in WORDS:
        return [_scalar(word, mapping, time, values[0])]
    vector = VECTORS[word]
    frame = entry.frame
    if frame is None:
        frame = Frame(next(iter(vector.words)))
        if len(vector.words) > 1:
            assumed.append(f"{name}: no frame given, axes taken as {frame.value}")
    if word == "velocity":
        return _velocity(frame, time, values)
    if word == "pull":
        return [("tension", time, np.sqrt((values**2).sum(axis=0)), ["tension: the norm of the pull, never negative"])]
    if word == "quaternion":
        time, values = _angles(name, time, values)
    return [_scalar(w, mapping, time, row) for w, row in zip(vector.words[frame.value], values)]


def _scalar(word: str, mapping: Mapping, time, value) -> Made:
    known, more = WORDS[word], []
    value = known.factor * value + known.offset
    if known.pressure:
        value = value / (mapping.density * mapping.gravity)
        more.append(
            f"{known.quantity}: from pressure with {mapping.density:g} kg/m^3 and {mapping.gravity:g} m/s^2, constant"
        )
    if QUANTITIES[known.quantity].unit == "rad" and known.quantity in ("yaw", "body_yaw", "course"):
        value = np.unwrap(value)
    return known.quantity, time, value + 0.0, more


def _upward(frame: Frame, time: np.ndarray, values: np.ndarray) -> Vector:
    """A velocity in east, north, up, or along x, y, z of the ship."""
    one, two, three = values
    if frame in (Frame.NED, Frame.FRD):
        one, two, three = (two, one, -three) if frame is Frame.NED else (one, -two, -three)
    return frame, time, np.stack([one, two, three])


def _of_velocity(vector: Vector) -> dict[str, np.ndarray]:
    """Signals of a velocity."""
    frame, _, (east, north, up) = vector
    out = {"speed": np.hypot(east, north), "heave_rate": up}
    return out if frame in SHIP else out | {"course": np.unwrap(np.arctan2(north, east))}


def _velocity(frame: Frame, time, values) -> list[Made]:
    mast = ["heave_rate: along the ship's mast, taken for the vertical"] if frame in SHIP else []
    found = _of_velocity(_upward(frame, time, values))
    return [(name, time, value, mast if name == "heave_rate" else []) for name, value in found.items()]


def _angles(name: str, time, rotors) -> tuple[np.ndarray, np.ndarray]:
    norm = np.sqrt((rotors**2).sum(axis=0))
    good = np.abs(norm - 1.0) < 0.01
    if not good.any():
        raise LogError(
            f"signals.{name}: no quaternion has norm 1 within 0.01 (median {float(np.median(norm)):.3g}): there is no "
            f"orientation in it; nothing was used. Leave the entry out: attitude comes from rates and acceleration"
        )
    turned = np.array([angles_of(*row) for row in (rotors[:, good] / norm[good]).T])
    return time[good], np.unwrap(turned, axis=0).T


def _check_overlap(log: Log, whole: list[tuple[Signal, Entry]]) -> None:
    """LogError where signals of different clocks have no time in common."""
    spans = [(int(s.time[0]), int(s.time[-1]), s, e) for s, e in whole if len(s.time)]
    for begin, end, signal, entry in spans[1:]:
        first_begin, first_end, first, other = spans[0]
        apart = max(begin - first_end, first_begin - end) / SECOND
        clocks = {(e.time or Clock.LOGGED).value + e.stamped_by for e in (entry, other)}
        if apart > 0.0 and len(clocks) > 1:
            raise LogError(
                f"{log.path}: the clocks cannot be aligned: {first.quantity} and {signal.quantity} are {apart:.6g} s "
                f"apart and were stamped by different clocks; nothing was used. Take the same `time:` for both, "
                f"`time: aligned`, or give clock_offset"
            )


def accepted_records(log, where, entry, source, raw, time, said) -> np.ndarray:
    """Which records the mapping accepts; counts of the others are said."""
    good = np.ones(len(source), bool)

    def drop(kept: np.ndarray, why: str) -> None:
        nonlocal good
        lost = int((good & ~kept).sum())
        if lost:
            said.append(f"{where}: {lost} of {len(source)} records of {source.name} left out: {why}")
        good &= kept

    if entry.range is not None:
        low, high = entry.range
        with np.errstate(invalid="ignore"):
            drop(((raw >= low) & (raw <= high)).all(axis=0), f"outside [{low:g}, {high:g}]")
    if entry.quality_field:
        drop(_quality(log, where, entry, source), f"{entry.quality_field} is none of the accepted values")
    if entry.after is not None or entry.until is not None:
        begin = _begin(log)
        since = (time - begin) / SECOND
        inside = np.ones(len(source), bool)
        if entry.after is not None:
            inside &= since >= entry.after
        if entry.until is not None:
            inside &= since <= entry.until
        drop(inside, "outside the interval of `after` and `until`")
    return good


def _begin(log: Log) -> int:
    if log.begin is not None:
        return log.begin
    stamps = [s.stamps for s in log.sources.values()]
    return min((begin_of(t) for t in stamps if t is not None and len(t)), default=0)


def _quality(log, where, entry, source) -> np.ndarray:
    told = source
    if entry.quality_source:
        found = find_sources(log, [entry.quality_source])
        if not found:
            raise LogError(
                f"{where}.quality_source = {entry.quality_source}: there is no such source; nothing was used. "
                f"{near(entry.quality_source, [*log.sources, *log.left])}"
            )
        told = found[0]
    column = column_of(told, entry.quality_field)
    if column is None:
        raise LogError(
            f"{where}.quality_field = {entry.quality_field}: {told.name} has no such field; nothing was used. "
            f"{near(entry.quality_field, [*told.columns, *told.left])}"
        )
    accepted = np.isin(told.columns[column], entry.quality_refused, invert=True)
    if entry.quality_accepted:
        accepted &= np.isin(told.columns[column], entry.quality_accepted)
    if told is source:
        return accepted
    at = last_before(source, told)
    if at is None:
        raise LogError(
            f"{where}.quality_source = {told.name} has no clock in common with {source.name}; nothing was used"
        )
    return (at >= 0) & accepted[np.maximum(at, 0)]
