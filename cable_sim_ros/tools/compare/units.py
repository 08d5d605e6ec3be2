"""Signs and units that a log may have been in: what the gain of two signals says of them, in words."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .pairing import Pair
from .spectra import Interval

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
ALIKE = 1.5  # of a gain either way: no unit of FACTORS is within it
CLEAR = 0.7  # correlation, from which on a gain says something of signs and units
FAR = 3.0  # deviations of a mean from 0, from which on it has a sign and a size of its own
STEADY = {"m": 0.01, "m/s": 0.01, "rad": 1e-3, "rad/s": 1e-3, "m/s^2": 0.01}  # deviation below which nothing moves
STEADY_SHARE = 1e-3  # the same of a force, of the mean
STEP = 2.0  # of B over A from part to part of a record
PART, PARTS = 60.0, 10  # s at least, parts at most; two of a shorter record
ACTIVE = 0.3  # of the usual rms, that a part must have


class Finding(NamedTuple):
    """A mistake that is probable: kind (sign, unit, still, step), of "A" or "B", words, factor that A is to be
    multiplied by, can it be taken back (one explanation alone)."""

    kind: str
    side: str
    text: str
    factor: float
    clear: bool


def floor_of(unit: str, means: tuple[float, float]) -> float:
    """Deviation below which a signal stands still."""
    return STEADY.get(unit, STEADY_SHARE * max(map(abs, means)))


def findings(
    unit: str, gain: float | None, interval: Interval | None, correlation: float,
    means: tuple[float, float], spreads: tuple[float, float], rivals: bool = False,
) -> list[Finding]:  # fmt: skip
    """What gain of B over A, means and standard deviations of A and B say. rivals: lags that fit as well, one of them
    half a wave away: the sign of a correlation is then none of the instrument."""
    floor = floor_of(unit, means)
    moves = [spread > floor for spread in spreads]
    known = gain is not None and abs(correlation) >= CLEAR
    far = all(abs(mean) > FAR * max(spread, floor) for mean, spread in zip(means, spreads))
    for k, (side, other) in enumerate((("A", "B"), ("B", "A"))):
        dead = not any(moves) and not spreads[k] and not means[k] and abs(means[1 - k]) > floor
        if not known and (dead or (not moves[k] and moves[1 - k])):
            text = (
                f"{side} stands still at {means[k]:.5g} {unit} while {other} has a mean of {means[1 - k]:.5g} and a "
                f"deviation of {spreads[1 - k]:.3g} {unit}: a sensor that is dead or stuck, or another tow"
            )
            return [Finding("still", side, text, 1.0, False)]
    if not known and not any(moves) and abs(means[1] - means[0]) <= floor:
        return []
    return [*_sign(gain, correlation, means, known, far, any(moves), rivals),
            *_size(unit, gain, interval, means, spreads, known, far)]  # fmt: skip


def _sign(
    gain: float | None,
    correlation: float,
    means: tuple[float, float],
    known: bool,
    far: bool,
    moves: bool,
    rivals: bool,
) -> list[Finding]:
    reversed_mean = means[0] * means[1] < 0.0
    if known and gain is not None and gain < 0.0 and not (rivals and far and not reversed_mean):
        text = f"sign reversed: B is A times {gain:.4g} (correlation {correlation:.2f})"
        clear = not rivals and reversed_mean if far else not rivals
        text += "" if clear else ", or it lags by half a wave" if rivals else ", though the means have one sign"
        return [Finding("sign", "A", text, -1.0, clear)]
    if far and reversed_mean:
        text = f"sign reversed: the mean of A is {means[0]:.5g}, that of B {means[1]:.5g}"
        return [Finding("sign", "A", text, -1.0, False)]
    if not far and moves and not known:
        text = f"sign not found: the correlation is {correlation:.2f}, below {CLEAR:g}, and no mean has a sign"
        return [Finding("sign", "A", text, 1.0, False)]
    return []


def _size(
    unit: str, gain: float | None, interval: Interval | None, means: tuple[float, float],
    spreads: tuple[float, float], known: bool, far: bool,
) -> list[Finding]:  # fmt: skip
    if known and gain is not None:
        low, high = sorted(map(abs, interval)) if interval is not None else (abs(gain), abs(gain))
        return _units(unit, abs(gain), low, high, "times", True)
    a, b = means if far else spreads
    ratio = abs(b / a) if a else 0.0
    return _units(unit, ratio, ratio, ratio, "in the mean times" if far else "in its deviation times", False)


def _units(unit: str, gain: float, low: float, high: float, words: str, clear: bool) -> list[Finding]:
    if low * (1.0 - NEAR) <= 1.0 <= high * (1.0 + NEAR) or 1.0 / ALIKE < gain < ALIKE:
        return []
    fits = []
    for name, factor in FACTORS.get(unit, {}).items():
        for side, value in (("A", factor), ("B", 1.0 / factor)):
            if abs(gain / value - 1.0) <= NEAR or low <= value <= high:
                fits.append((abs(gain / value - 1.0), side, name, value))
    fits.sort()
    size = f"B is A {words} {gain:.4g} [{low:.4g}, {high:.4g}]"
    if not fits:
        return [Finding("unit", "A", f"{size}: no unit of {unit} is that; instrument, model or tow differ", 1.0, False)]
    inside = [fit for fit in fits if low <= fit[3] <= high]
    alone = clear and (len(fits) == 1 or len(inside) == 1)
    chosen = inside if alone and inside else fits
    told = " or ".join(f"{side} is in {name} ({value:.4g})" for _, side, name, value in chosen)
    text = f"{size}: probably {told}, where {unit} was taken"
    return [Finding("unit", chosen[0][1], text, chosen[0][3], alone)]


def step_of(unit: str, pair: Pair) -> list[Finding]:
    """A size of B over A that changes within the record, by the rms about 0 of parts in which either is active."""
    count = int(np.clip(len(pair.a) * pair.step / PART, 2, PARTS))
    edges = np.linspace(0, len(pair.a), count + 1).astype(int)
    parts = [slice(i, j) for i, j in zip(edges, edges[1:]) if pair.good[i:j].any()]
    a, b = (np.array([float(np.sqrt(np.nanmean(x[part] ** 2))) for part in parts]) for x in (pair.a, pair.b))
    floor = floor_of(unit, (float(np.nanmean(pair.a)), float(np.nanmean(pair.b))))
    active = (a > ACTIVE * np.median(a)) | (b > ACTIVE * np.median(b))
    ratio = np.where(active, np.maximum(b, floor) / np.maximum(a, floor), np.nan)
    if not active.any() or not np.nanmax(ratio) > STEP * np.nanmin(ratio):
        return []
    told = " and ".join(
        f"{ratio[k]:.3g} from {pair.time[parts[k].start]:.4g} to {pair.time[parts[k].stop - 1]:.4g} s"
        for k in sorted((int(np.nanargmin(ratio)), int(np.nanargmax(ratio))))
    )
    text = f"B over A changes within the record: {told}: a step of unit or range, spikes, or a sensor that died"
    return [Finding("step", "A", text, 1.0, False)]
