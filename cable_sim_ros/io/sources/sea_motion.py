"""Ship motion from the waves of a scene by response amplitude operators, as odometry messages. docs/sea_motion.md.

The waves are those that act on cable and bodies (sim/tables/sea_tables.py), component by component. At the mean place
of base_link, which goes with ship.tow_speed U along ship.heading_deg, a component has the elevation
    A cos(W t - phase),   W = w - k U cos b,   b its direction from ahead
and the ship the motion Re(R A e^(i (W t - phase))), its rates by differentiation. Both grow alike over water.ramp.
"""

from __future__ import annotations

import os
from math import cos, degrees, pi, radians, remainder, sin
from typing import Protocol

import numpy as np

from ...physics.heave_filter import Heave
from ...physics.sea import AMPLITUDE, FREQUENCY, NUMBER, PHASE, TOWARDS
from ...physics.water import CurrentFrame, WaveKind
from ...sim.flag_rules import OUTSIDE_TABLE
from ...sim.inputs import MAX_PITCH
from ...sim.scene import Scene
from ...sim.tables.sea_tables import wave_table
from ...sim.verdict import check
from . import simple_hull
from .csv_table import CONSEQUENCE, MotionError
from .motion_table import LONGEST, SECOND, STEP, Samples, mean_track, odometry_events
from .rao_table import FREEDOMS, RaoTable, Wave
from .recorded_tow import RecordedTow

MOST_OUTSIDE = 0.5  # share of the energy of the sea outside the table, above which there is no motion to speak of
ROLL = 3


class Response(Protocol):
    """What answers to a wave: a table or a hull."""

    @property
    def title(self) -> str: ...
    def about(self) -> dict[str, object]: ...
    def notes(self) -> list[str]: ...
    def covers(self, wave: Wave) -> bool: ...
    def response(self, wave: Wave) -> list[complex]: ...


def response_of(rao: str | os.PathLike, scene: Scene) -> Response:
    """A table in a CSV file, or the simple hull: ``simple``, ``simple:length=60,beam=12``. Raises MotionError."""
    name, _, text = os.fspath(rao).partition(":")
    if name == simple_hull.NAME:
        return simple_hull.SimpleHull(simple_hull.numbers_of_text(text), -scene.sheave.position[0])
    return RaoTable(rao)


def waves_met(scene: Scene) -> list[tuple[Wave, float, float]]:
    """Components of the sea of a scene as its ship meets them on its mean track, with amplitude [m] and phase [rad].

    The elevation is that over odom (0, 0) at the start of the run. Raises MotionError without waves.
    """
    waves = scene.water.waves
    if waves.kind is WaveKind.OFF:
        raise MotionError(
            f"{scene.name}: --rao moves the ship in the waves of the scene, but water.waves.kind = off; {CONSEQUENCE}. "
            f"Give water.waves, for example --set water.waves.kind=jonswap --set water.waves.height=2"
        )
    depth = np.inf if scene.seabed.depth is None else scene.seabed.depth
    yaw = radians(scene.ship.heading_deg)
    turned = yaw if waves.frame is CurrentFrame.HEADING else 0.0
    found = []
    for row in wave_table(waves, scene.gravity, depth).tolist():
        heading = remainder(row[TOWARDS] + turned - yaw, 2.0 * pi)
        encounter = row[FREQUENCY] - row[NUMBER] * scene.ship.tow_speed * cos(heading)
        found.append((Wave(row[FREQUENCY], row[NUMBER], heading, encounter), row[AMPLITUDE], row[PHASE]))
    return found


def sea_motion(rao: str | os.PathLike, scene: Scene, duration: float) -> RecordedTow:
    """The ship of a scene in its waves, as odometry messages; duration: of the run, s. Raises MotionError.

    `sea_motion` of the answer is for the JSON, with notes of what was chosen for the verdict.
    """
    answer = response_of(rao, scene)
    met = waves_met(scene)
    where = f"{answer.title} in the waves of {scene.name}"
    if not 0.0 < duration <= LONGEST:
        raise MotionError(
            f"{where}: a duration of {duration:g} s is outside (0, {LONGEST:g}] s; {CONSEQUENCE}. Give a shorter "
            f"--duration"
        )
    energy = sum(amplitude * amplitude for _, amplitude, _ in met)
    outside = sum(amplitude * amplitude for wave, amplitude, _ in met if not answer.covers(wave)) / energy
    if outside > MOST_OUTSIDE:
        raise MotionError(
            f"{where}: {100.0 * outside:.3g} % of the energy of the sea ({_span(met)}) is outside the table, above "
            f"{100.0 * MOST_OUTSIDE:g} %; {CONSEQUENCE}. Give a table that reaches so far, or other water.waves"
        )
    steps = np.arange(-(-round(duration * SECOND) // STEP) + SECOND // STEP)  # a second more than is run
    t = steps * (STEP / SECOND)
    answers = [answer.response(wave) for wave, _, _ in met]
    moved, rate = summed(t, met, answers)
    moved, rate = _grown(t, scene.water.ramp, moved, rate)
    _within(where, t, moved)
    value, going = mean_track(t, scene.ship)
    yaw = radians(scene.ship.heading_deg)
    for to, of in ((value, moved), (going, rate)):
        to[:, 0] += cos(yaw) * of[:, 0] - sin(yaw) * of[:, 1]
        to[:, 1] += sin(yaw) * of[:, 0] + cos(yaw) * of[:, 1]
        to[:, 2:] += of[:, 2:]
    tow = RecordedTow(where, odometry_events(Samples(SECOND + steps * STEP, value, going), where))
    tow.heading = yaw
    notes = answer.notes()
    if outside > 0.0:
        text = (
            f"{100.0 * outside:.2g} % of the energy of the sea ({_span(met)}) is outside {answer.title}, whose ends "
            f"are held there"
        )
        if outside > OUTSIDE_TABLE:
            tow.doubts = [check("RAO_OUTSIDE", f"{text}: more than {100.0 * OUTSIDE_TABLE:g} %. Give a wider table")]
        else:
            notes.append(text)
    tow.sea_motion = {
        **answer.about(),
        "notes": notes,
        "outside": outside,
        "overtaken": sum(a * a for wave, a, _ in met if wave.encounter < 0.0) / energy,
        "deviations": dict(zip(FREEDOMS, _deviations(met, answers))),
    }
    return tow


def summed(
    t: np.ndarray, met: list[tuple[Wave, float, float]], answers: list[list[complex]]
) -> tuple[np.ndarray, np.ndarray]:
    """Six motions [n, 6] m and rad at times t [s], and their rates; summed in order, so that bits stay the same."""
    value, rate = np.zeros((len(t), 6)), np.zeros((len(t), 6))
    for (wave, amplitude, phase), answer in zip(met, answers):
        angle = wave.encounter * t - phase
        c, s = np.cos(angle), np.sin(angle)
        for k, x in enumerate(answer):
            if x != 0.0:
                re, im = amplitude * x.real, amplitude * x.imag
                value[:, k] += re * c - im * s
                rate[:, k] -= wave.encounter * (re * s + im * c)
    return value, rate


def _grown(t: np.ndarray, ramp: float, value: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Motion that grows as the waves do (physics/water_kinematics.py)."""
    if ramp == 0.0:
        return value, rate
    x = np.minimum(t / ramp, 1.0)
    size, slope = x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) / ramp
    return size[:, None] * value, size[:, None] * rate + slope[:, None] * value


def _deviations(met: list[tuple[Wave, float, float]], answers: list[list[complex]]) -> list[float]:
    """Standard deviations of six motions in the grown sea, m and deg."""
    variance = [0.0] * 6
    for (_, amplitude, _), answer in zip(met, answers):
        for k, x in enumerate(answer):
            variance[k] += 0.5 * amplitude * amplitude * (x.real * x.real + x.imag * x.imag)
    return [v**0.5 if k < ROLL else degrees(v**0.5) for k, v in enumerate(variance)]


def _span(met: list[tuple[Wave, float, float]]) -> str:
    """Periods and headings of a sea in words."""
    periods = [2.0 * pi / wave.omega for wave, _, _ in met]
    bearings = [degrees(wave.heading) % 360.0 for wave, _, _ in met]
    return f"{min(periods):.3g} to {max(periods):.3g} s, {min(bearings):.4g} to {max(bearings):.4g} deg"


def _within(where: str, t: np.ndarray, moved: np.ndarray) -> None:
    """Raise MotionError for motion beyond what is taken of a ship."""
    for k, maximum, scale, unit in (
        (2, Heave().max_displacement, 1.0, "m"),
        (3, MAX_PITCH, degrees(1.0), "deg"),
        (4, MAX_PITCH, degrees(1.0), "deg"),
    ):
        worst = np.abs(moved[:, k])
        i = int(worst.argmax())
        if worst[i] > maximum:
            raise MotionError(
                f"{where}: {FREEDOMS[k]} reaches {scale * worst[i]:.4g} {unit} after {t[i]:.4g} s, above "
                f"{scale * maximum:g} {unit}; {CONSEQUENCE}. Check the units of the table (m/m, deg/m), or lower "
                f"water.waves.height"
            )
