"""Ship motion from the waves of a scene by response amplitude operators, as odometry messages. docs/sea_motion.md.

The waves are those that act on cable and bodies (sim/tables/sea_tables.py), component by component. At the mean place
of base_link, which goes with ship.tow_speed U along ship.heading_deg, a component has the elevation
    A cos(W t - phase),   W = w - k U cos b,   b its direction from ahead
and the ship the motion Re(R A e^(i (W t - phase))), its rates by differentiation. Both grow alike over water.ramp.

Responses of a box-shaped hull in closed form, for a ship whose table is not at hand. docs/sea_motion.md.

Heave and pitch after Jensen, Mansour and Olsen (2004), box of length L, beam B, draught T; k wave number, w frequency,
W of encounter, a = W/w, ke = k |cos b|, b direction of the wave from ahead:
    D = 1 - 2 k T a^2 + i s A^2/(k B a^2),          A = 2 sin(k B a^2/2) e^(-k T a^2),   s: sign of W
    E = e^(-ke T) (1 - k T + i s A^2/(k B |a|^3))
    heave = E/D 2/(ke L) sin(ke L/2)
    pitch = i sign(cos b) E/D 24/((ke L)^2 L) (sin(ke L/2) - ke L/2 cos(ke L/2))
Amplitudes are the paper's; the phase of E is ours (the paper has its magnitude), so that in long waves the hull rides
on the surface. Roll is simpler than in the paper: an oscillator of one natural period and damping ratio, driven by the
slope across, averaged over length and beam, times e^(-k T). Surge, sway and yaw are left out.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from math import cos, degrees, exp, pi, radians, remainder, sin, sqrt

import numpy as np

from ...physics.heave_filter import Heave
from ...physics.sea import AMPLITUDE, FREQUENCY, NUMBER, PHASE, TOWARDS
from ...physics.water import CurrentFrame, WaveKind
from ...sim.flag_rules import OUTSIDE_TABLE
from ...sim.inputs import MAX_PITCH
from ...sim.scene import Scene
from ...sim.tables.sea_tables import wave_table
from ...sim.verdict import check
from .csv_table import CONSEQUENCE, MotionError
from .motion_table import made, mean_track, times_of
from .rao_table import FREEDOMS, RaoTable, Wave
from .recorded_tow import RecordedTow

NAME = "simple"
# key: least, most, unit
KEYS = {
    "length": (1.0, 500.0, "m"),
    "beam": (0.3, 100.0, "m"),
    "draft": (0.05, 40.0, "m"),
    "roll_period": (0.5, 60.0, "s"),
    "roll_damping": (0.01, 2.0, "1"),
}
SLENDER, FLAT = 5.0, 3.0  # length over beam, beam over draught, where they are not given
ROLL_OF_HULL = 3.0  # s/sqrt(m): natural period of roll over the root of the beam, of a metacentric height of 0.07 beams
DAMPING = 0.1
SMALL = 1e-4  # rad: below it the series of a quotient

MOST_OUTSIDE = 0.5  # share of the energy of the sea outside the table, above which there is no motion to speak of
ROLL = 3


def sinc(x: float) -> float:
    """sin(x)/x."""
    return 1.0 - x * x / 6.0 if abs(x) < SMALL else sin(x) / x


def tilt(x: float) -> float:
    """Slope of the straight line through a wave over a length, over the largest slope; x: half the length in rad."""
    return 1.0 - x * x / 10.0 if abs(x) < 100.0 * SMALL else 3.0 * (sin(x) - x * cos(x)) / x**3


class SimpleHull:
    """Responses of a box; ``given``: its numbers by the names of KEYS; stern: distance of the sheave from base_link
    [m], aft positive, half the length where that is not given. Raises MotionError."""

    title = NAME  # what responds

    def __init__(self, given: dict[str, float], stern: float) -> None:
        self.given = dict(given)
        found, self.chosen = dict(given), list[str]()

        def choose(key: str, value: float, why: str) -> None:
            if key not in found:
                found[key] = value
                unit = KEYS[key][2].replace("1", "")
                self.chosen.append(" ".join(filter(None, (key, f"{value:.4g}", unit, f"({why})"))))

        if "length" not in found and 2.0 * stern < KEYS["length"][0]:
            raise MotionError(
                f"--rao {NAME}: the length of the ship is not known, as the sheave is {stern:g} m aft of base_link "
                f"(sheave.position), no stern; {CONSEQUENCE}. Give it in m: --rao {NAME}:length=60"
            )
        choose("length", 2.0 * stern, "twice the distance of the sheave aft of base_link")
        choose("beam", found["length"] / SLENDER, f"length/{SLENDER:g}")
        choose("draft", found["beam"] / FLAT, f"beam/{FLAT:g}")
        choose("roll_period", ROLL_OF_HULL * sqrt(found["beam"]), f"{ROLL_OF_HULL:g} s times the root of the beam in m")
        choose("roll_damping", DAMPING, "a choice")
        for key, value in found.items():
            low, high, unit = KEYS[key]
            if not low <= value <= high:
                raise MotionError(
                    f"--rao {NAME}: {key} = {value:g} {unit} is outside [{low:g}, {high:g}] {unit}; {CONSEQUENCE}. "
                    f"Give --rao {NAME}:{key}=VALUE"
                )
        self.numbers = found

    def about(self) -> dict[str, object]:
        """For the JSON."""
        return {"source": NAME, **{key: self.numbers[key] for key in KEYS}, "chosen": self.chosen}

    def notes(self) -> list[str]:
        """What was taken without being given."""
        size = "chosen: " + ", ".join(self.chosen) if self.chosen else "nothing chosen"
        given = ", ".join(f"{key} {self.given[key]:g}" for key in KEYS if key in self.given) or "nothing"
        return [
            f"rao {NAME}: a box, not your ship; given: {given}; {size}. Heave and pitch after "
            f"Jensen, Mansour and Olsen (2004) about base_link as midships, roll one oscillator, no surge, sway and "
            f"yaw, deep water. Take a table of the ship (--rao FILE) for figures to rely on"
        ]

    def covers(self, wave: Wave) -> bool:
        """Formulas have no end."""
        return True

    def response(self, wave: Wave) -> list[complex]:
        """Six responses, m and rad for a metre of amplitude."""
        length, beam, draft, period, damping = (self.numbers[key] for key in KEYS)
        k, along, across = wave.number, cos(wave.heading), sin(wave.heading)
        ratio = abs(wave.encounter / wave.omega)
        sign = 1.0 if wave.encounter >= 0.0 else -1.0
        kr = k * ratio * ratio
        # A = kr B sinc(kr B/2) e^(-kr T), so that A^2/(k B a^2) = kr B wave^2 and nothing is divided by a
        radiated = (sinc(0.5 * kr * beam) * exp(-kr * draft)) ** 2
        d = complex(1.0 - 2.0 * kr * draft, sign * kr * beam * radiated)
        e = exp(-k * abs(along) * draft) * complex(1.0 - k * draft, sign * k * ratio * beam * radiated)
        half = 0.5 * k * along * length
        heave = e / d * sinc(half)
        pitch = 1j * k * along * e / d * tilt(half)
        slope = -1j * k * across * tilt(0.5 * k * across * beam) * sinc(half) * exp(-k * draft)
        r = wave.encounter * period / (2.0 * pi)
        return [0j, 0j, heave, slope / complex(1.0 - r * r, 2.0 * damping * r), pitch, 0j]


def numbers_of_text(text: str) -> dict[str, float]:
    """Numbers by key of what stands behind ``simple:``, as in length=60,beam=12. Raises MotionError."""
    found: dict[str, float] = {}
    for pair in text.split(",") if text else ():
        key, sign, value = (part.strip() for part in pair.partition("="))
        if key not in KEYS:
            _refuse(pair, "is no number of the hull", tuple(KEYS))
        if key in found:
            _refuse(pair, f"gives {key} twice", ())
        try:
            found[key] = float(value)
        except ValueError:
            _refuse(pair, "is no number", ())
        if found[key] != found[key]:
            _refuse(pair, "is no number", ())
    return found


def _refuse(pair: str, why: str, known: Sequence[str]) -> None:
    hint = f"Known: {', '.join(known)}" if known else f"Give for example --rao {NAME}:length=60,beam=12"
    raise MotionError(f"--rao {NAME}: '{pair.strip():.80}' {why}; {CONSEQUENCE}. {hint}")


Response = RaoTable | SimpleHull  # what answers to a wave


def response_of(rao: str | os.PathLike, scene: Scene) -> Response:
    """A table in a CSV file, or the simple hull: ``simple``, ``simple:length=60,beam=12``. Raises MotionError."""
    name, _, text = os.fspath(rao).partition(":")
    if name == NAME:
        return SimpleHull(numbers_of_text(text), -scene.sheave.position[0])
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
    t = times_of(duration, where)
    energy = sum(amplitude * amplitude for _, amplitude, _ in met)
    outside = sum(amplitude * amplitude for wave, amplitude, _ in met if not answer.covers(wave)) / energy
    if outside > MOST_OUTSIDE:
        raise MotionError(
            f"{where}: {100.0 * outside:.3g} % of the energy of the sea ({_span(met)}) is outside the table, above "
            f"{100.0 * MOST_OUTSIDE:g} %; {CONSEQUENCE}. Give a table that reaches so far, or other water.waves"
        )
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
    tow = made(where, value, going)
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
