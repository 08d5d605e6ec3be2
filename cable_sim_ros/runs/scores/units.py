"""Signs and units that a log may have been in: what the gain of two signals says of them, in words."""

from __future__ import annotations

from typing import NamedTuple

from .intervals import Interval

G = 9.80665
FACTORS: dict[str, dict[str, float]] = {  # SI unit -> other unit: SI units that one of it is
    "N": {"lbf": 4.4482216, "kgf": G, "daN": 10.0, "kN": 1e3, "klbf": 4448.2216, "tf": 1e3 * G},
    "m": {"ft": 0.3048, "cm": 0.01, "fathoms": 1.8288, "km": 1e3},
    "m/s": {"knots": 1852.0 / 3600.0, "m/min": 1.0 / 60.0, "ft/s": 0.3048, "ft/min": 0.00508, "km/h": 1.0 / 3.6},
    "rad": {"degrees": 0.017453292519943295},
    "rad/s": {"deg/s": 0.017453292519943295, "rpm": 0.10471975511965977},
    "m/s^2": {"g": G},
}
NEAR = 0.06  # of a factor, and that the interval of the gain reaches it
CLEAR = 0.7  # correlation, from which on a gain says something of units


class Finding(NamedTuple):
    """A mistake that is probable: kind (sign, unit), of "A" or "B", words, factor that A is to be multiplied by, can
    it be taken back (one explanation alone)."""

    kind: str
    side: str
    text: str
    factor: float
    clear: bool

    def as_dict(self) -> dict:
        """For the JSON."""
        return self._asdict()


def findings(
    unit: str, gain: float | None, interval: Interval | None, correlation: float, means: tuple[float, float]
) -> list[Finding]:
    """What the gain of B over A says. means: of A and B, for what does not change."""
    found: list[Finding] = []
    if gain is not None and abs(correlation) >= CLEAR:
        if gain < 0.0:
            text = f"sign reversed: B is A times {gain:.4g} (correlation {correlation:.2f})"
            found.append(Finding("sign", "A", text, -1.0, True))
        low, high = sorted(map(abs, interval)) if interval is not None else (abs(gain), abs(gain))
        found += _units(unit, abs(gain), low, high, "times", True)
    elif gain is None and means[0] and means[1]:
        ratio = means[1] / means[0]
        found += _units(unit, abs(ratio), abs(ratio), abs(ratio), "in the mean times", False)
    return found


def _units(unit: str, gain: float, low: float, high: float, words: str, clear: bool) -> list[Finding]:
    if low * (1.0 - NEAR) <= 1.0 <= high * (1.0 + NEAR) or 1.0 / 1.5 < gain < 1.5:
        return []
    fits = []
    for name, factor in FACTORS.get(unit, {}).items():
        for side, value in (("A", factor), ("B", 1.0 / factor)):
            if abs(gain / value - 1.0) <= NEAR or low <= value <= high:
                fits.append((abs(gain / value - 1.0), side, name, value))
    fits.sort()
    if not fits:
        return []
    inside = [fit for fit in fits if low <= fit[3] <= high]
    alone = clear and (len(fits) == 1 or len(inside) == 1)
    chosen = inside if alone and inside else fits
    told = " or ".join(f"{side} is in {name} ({value:.4g})" for _, side, name, value in chosen)
    return [
        Finding(
            "unit",
            chosen[0][1],
            f"B is A {words} {gain:.4g} [{low:.4g}, {high:.4g}]: probably {told}, where {unit} was taken",
            chosen[0][3],
            alone,
        )
    ]
