"""Responses of a box-shaped hull in closed form, for a ship whose table is not at hand. docs/sea_motion.md.

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

from collections.abc import Sequence
from math import cos, exp, pi, sin, sqrt

from .csv_table import CONSEQUENCE, MotionError
from .rao_table import Wave

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
ROLL = 3.0  # s/sqrt(m): natural period of roll over the root of the beam, of a metacentric height of 0.07 beams
DAMPING = 0.1
SMALL = 1e-4  # rad: below it the series of a quotient


def sinc(x: float) -> float:
    """sin(x)/x."""
    return 1.0 - x * x / 6.0 if abs(x) < SMALL else sin(x) / x


def tilt(x: float) -> float:
    """Slope of the straight line through a wave over a length, over the largest slope; x: half the length in rad."""
    return 1.0 - x * x / 10.0 if abs(x) < 100.0 * SMALL else 3.0 * (sin(x) - x * cos(x)) / x**3


class SimpleHull:
    """Responses of a box; ``given``: its numbers by the names of KEYS; stern: distance of the sheave from base_link
    [m], aft positive, half the length where that is not given. Raises MotionError."""

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
        choose("roll_period", ROLL * sqrt(found["beam"]), f"{ROLL:g} s times the root of the beam in m")
        choose("roll_damping", DAMPING, "a choice")
        for key, value in found.items():
            low, high, unit = KEYS[key]
            if not low <= value <= high:
                raise MotionError(
                    f"--rao {NAME}: {key} = {value:g} {unit} is outside [{low:g}, {high:g}] {unit}; {CONSEQUENCE}. "
                    f"Give --rao {NAME}:{key}=VALUE"
                )
        self.numbers = found

    @property
    def title(self) -> str:
        """What responds."""
        return NAME

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
