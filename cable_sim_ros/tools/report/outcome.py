"""What came of it: time series, contact along the sheave, drive and instruments where they are on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...physics.tick_output import Flag
from ...physics.winch_drive import MODES, DriveModel
from ...plots.heading import force_unit
from ...plots.run import contact, contact_bands
from ...plots.strips import WIDTH, Line, Strip, strips, svg
from ...runs.passage import events
from ...runs.summary import WINCH_LIMITS, WINCH_PEAKS, pitch_and_roll
from .subject import Figure, Section, Subject, Table, Text, number, unit

FORCE_SPAN = 0.02  # of the mean: what hardly moves shall look so


def series(subject: Subject) -> Section:
    """Tension, pay-out, depth and heave over time."""
    frames = subject.frames
    factor, name = force_unit(frames["tension"])
    heave = frames["sheave_position"][:, 2]
    kept = subject.kept["sheave_position"][:, 2]
    rows = (
        Strip(
            "Tension where the cable leaves the sheave",
            f"tension [{name}]",
            (Line(factor * frames["tension"]),),
            FORCE_SPAN * factor * abs(float(frames["tension"].mean())),
        ),
        Strip("Pay-out: cable off the drum", "pay-out [m]", (Line(frames["payout"]),), 0.1),
        Strip("Depth of the towbody, downward", "depth [m]", (Line(-frames["body_position"][:, 2]),), 0.2, True),
        Strip("Heave of the sheave about its mean", "heave [m]", (Line(heave - kept.mean()),), 0.2),
    )
    metrics = subject.metrics

    def span(name: str, digits: int) -> str:
        low, high = (name.format(end) for end in ("min", "max"))
        return f"{number(metrics.get(low), digits)} to {number(metrics.get(high), digits)}"

    words = (
        f"Tension {span('tension_{}_n', 4)} N after the start-up; pay-out {span('payout_{}_m', 5)} m; depth "
        f"{span('body_depth_{}_m', 4)} m."
    )
    skip = (
        f" Grey: the start-up of {number(subject.skip_s, 3)} s, which the statistics leave out."
        if subject.skip_s
        else ""
    )
    many = (
        " Of long series the least and the largest value of each piece are drawn: no peak is lost."
        if len(frames) > 4000
        else ""
    )
    drawn = svg("series", (WIDTH, 7.6), lambda figure: strips(figure, subject.time, rows, subject.skip_s))
    return Section("series", "Time series", [Figure(drawn, f"{words}{skip}{many}", words)])


def contacts(subject: Subject) -> Section:
    """Line load of both flanks along the sheave."""
    found = Section("contact", "Contact along the sheave")
    if contact_bands(subject.recorded, subject.skip_s) is None:
        found.parts.append(Text(["No contact with the sheave was recorded."]))
        return found

    def draw(figure):
        contact(figure.subplots(), subject.recorded, subject.skip_s)

    metrics = subject.metrics
    words = (
        f"The cable presses on the sheave with {number(metrics['contact_resultant_mean_n'], 4)} N in the mean and "
        f"{number(metrics['contact_resultant_max_n'], 4)} N at most, over {number(metrics['wrap_angle_mean_deg'], 3)}° "
        "of it in the mean."
    )
    caption = (
        f"Force per metre of cable on each flank of the groove. {words} Line: mean over time; band: least to largest."
    )
    found.parts.append(Figure(svg("contact", (WIDTH, 3.2), draw), caption, words))
    return found


def passage(subject: Subject) -> Section | None:
    """Slam, splash zone, slack, snap and landing, where there was one of them."""
    found, frames = events(subject.frames), subject.frames
    slack = float(np.sum(frames["status"] & Flag.SLACK != 0)) * subject.tick
    if not found and not slack:
        return None
    rows = [
        (event.name, number(event.value, 4), event.unit, number(event.at_s, 5), event.meaning)
        for event in found.values()
    ]
    if slack:
        at = int(np.nanargmin(frames["tension_least"]))
        least = number(float(frames["tension_least"][at]), 4)
        meaning = f"cable without tension; the least was {least} N"
        rows.append(("slack", number(slack, 3), "s", number(float(subject.time[at]), 5), meaning))
    words = []
    if "splash_tension_least" in found:
        low, high = found["splash_tension_least"].value, found["splash_tension"].value
        words.append(
            f"While a body was in the water surface the tension went from {number(low, 4)} to {number(high, 4)} N."
        )
        words.append("The first blow of a slam and water that drains are not modelled: see the verdict.")
    if "snap" in found:
        words.append(f"Cable went slack, and came tight with {number(found['snap'].value, 4)} N.")
    if "landing_speed" in found:
        words.append(f"The towbody landed with {number(found['landing_speed'].value, 3)} m/s.")
    table = Table("Peaks, each with its time", ("what", "value", "unit", "at [s]", "meaning"), rows, right=(1, 3))
    return Section("passage", "Surface, slack and seabed", [Text(words or ["Cable was slack."]), table])


def drive(subject: Subject) -> Section | None:
    """The drive, where it is not the ideal servo, or where the winch was hauled."""
    scene, frames = subject.scene, subject.frames
    if scene is None or (scene.drive.model is DriveModel.SERVO and not subject.hauled):
        return None
    found = Section("drive", "Winch and drive")
    motor = scene.drive.model is DriveModel.MOTOR
    pull: tuple[Line, ...] = (Line(1e-3 * frames["tension_drum"], "cable" if motor else ""),)
    power: tuple[Line, ...] = (
        Line(1e-3 * frames["winch_power_tick_max"], "cable, largest of a tick" if motor else ""),
    )
    if motor:
        pull += (Line(1e-3 * frames["motor_pull"], "motor"), Line(1e-3 * frames["brake_pull"], "brake and friction"))
        power += (Line(1e-3 * frames["motor_power"], "motor on the drum"),)
    rows = [
        Strip("Speed of the cable at the drum, out positive", "speed [m/s]", (Line(frames["payout_rate"]),), 0.1),
        Strip("Pull at the drum", "pull [kN]", pull),
        Strip("Power into the cable (negative: it pays out and brakes)", "power [kW]", power),
    ]
    metrics = subject.metrics
    words = (
        f"The winch moved the cable with at most {number(metrics['winch_rate_max_m_s'], 3)} m/s, against at most "
        f"{number(metrics['winch_pull_max_n'], 4)} N, and put at most {number(metrics['winch_power_max_w'], 4)} W into "
        "it."
    )
    drawn = svg("drive", (WIDTH, 6.0), lambda figure: strips(figure, subject.time, rows, subject.skip_s))
    found.parts.append(Figure(drawn, words, words))
    known = [(name, unit_, text) for name, unit_, text, *_ in WINCH_PEAKS] + [
        (f"winch_{name}_share", "", f"share of the run in which {text}".replace("`", "")) for name, text in WINCH_LIMITS
    ]
    known = [row for row in known if metrics.get(row[0]) is not None]
    table, names = [(text, number(metrics[name]), unit(what)) for name, what, text in known], [row[0] for row in known]
    head = ("figure", "value", "unit")
    found.parts.append(Table("The winch at work, whole run", head, table, right=(1,), names=names))
    mode = np.unique(frames["winch_mode"].astype(int))
    said = ", ".join(MODES[k].value for k in mode if 0 <= k < len(MODES))
    found.parts.append(Text([f"Modes of the winch in the run: {said}."]))
    return found


class Reading(NamedTuple):
    """What an instrument shows beside the truth: device, quantity, unit, bit of readings_new, both series."""

    device: str
    quantity: str
    unit: str
    bit: int
    shown: np.ndarray
    true: np.ndarray


def readings(subject: Subject) -> Iterator[Reading]:
    """Of the devices that are aboard."""
    scene, f = subject.scene, subject.frames
    aboard = scene.instruments if scene is not None else None
    if aboard is None:
        return
    if aboard.mru.on:
        shown, true = f["mru_sheave_position"], f["sheave_position"]
        yield Reading("MRU", "height of the sheave", "m", 1, shown[:, 2], true[:, 2])
    if aboard.encoder.on:
        yield Reading("encoder", "pay-out", "m", 2, f["encoder_payout"], f["payout"])
    if aboard.metering_sheave.on:
        yield Reading("metering sheave", "pay-out", "m", 4, f["metering_payout"], f["payout"])
    if aboard.load_pin.on:
        yield Reading("load pin", "tension", "N", 8, f["load_pin_tension"], f["tension"])
    if aboard.usbl.on:
        apart = np.linalg.norm(f["usbl_position"] - f["body_position"], axis=1)
        yield Reading("acoustic fix", "distance from the towbody", "m", 16, apart, np.zeros(len(f)))
    if aboard.depth.on:
        yield Reading("depth sensor", "depth of the towbody", "m", 32, f["depth_reading"], -f["body_position"][:, 2])
    if aboard.fish_attitude.on:
        pitch, _ = pitch_and_roll(f)
        yield Reading("attitude sensor", "pitch of the towbody", "deg", 64, -np.degrees(f["fish_pitch"]), pitch)
    if aboard.altimeter.on and scene is not None and scene.seabed.depth is not None:
        height = f["body_position"][:, 2] + scene.seabed.depth
        yield Reading("altimeter", "height above the seabed", "m", 128, f["altitude_reading"], height)


def instruments(subject: Subject) -> Section | None:
    """What the instruments showed beside the truth."""
    every = list(readings(subject))
    if not every:
        return None
    found = Section("instruments", "Instruments aboard")
    table: list[tuple[str, ...]] = []
    rows = []
    after = subject.time >= subject.skip_s
    for one in every:
        new = (subject.frames["readings_new"].astype(int) & one.bit != 0) & after
        gap = (one.shown - one.true)[new]
        if not len(gap):
            table.append((one.device, one.quantity, "0", "-", "-", "-", one.unit))
            continue
        figures = float(gap.mean()), float(np.sqrt(np.mean(gap**2))), float(gap[int(np.abs(gap).argmax())])
        table.append((one.device, one.quantity, str(len(gap)), *(number(value, 4) for value in figures), one.unit))
        held = np.flatnonzero(subject.frames["readings_new"].astype(int) & one.bit)
        values = np.full(len(subject.frames), np.nan)
        values[held[0] :] = (one.shown - one.true)[held][
            np.searchsorted(held, np.arange(held[0], len(values)), side="right") - 1
        ]
        title = f"{one.device[0].upper()}{one.device[1:]}: {one.quantity}, shown less true"
        rows.append(Strip(title, f"[{one.unit}]", (Line(values),)))
    words = "Difference between what each instrument shows and the truth of the same moment, at its readings."
    if any(one.device == "load pin" for one in every):
        words += (
            " The load pin feels both legs of the cable and is calibrated at the angle of the start: where the "
            "departure angle swings, its tension is wrong, the more the less the cable wraps the sheave."
        )
    if rows:
        height = 0.9 + 1.5 * len(rows)
        drawn = svg("instruments", (WIDTH, height), lambda figure: strips(figure, subject.time, rows, subject.skip_s))
        found.parts.append(Figure(drawn, words, words))
    head = ("device", "quantity", "readings", "mean", "rms", "largest", "unit")
    caption = "Shown less true at the readings after the start-up: a latency is part of it"
    found.parts.append(Table(caption, head, table, right=(2, 3, 4, 5)))
    scene = subject.scene
    if scene is not None:
        fed = scene.instruments.feed.value
        found.parts.append(Text([f"Set-point laws and controllers get: {fed}."]))
    return found
