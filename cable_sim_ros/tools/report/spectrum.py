"""Spectra of a run: power spectral densities by Welch's method, the band of the waves, and figures from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.signal import welch

from ...plots.heading import force_unit
from ...plots.strips import WIDTH, Spectrum, spectra, svg
from .subject import Figure, Section, Subject, Table, Text, counted, number

LEAST_S, LEAST = 20.0, 64  # s and samples, below which there is no spectrum
PIECE_S, PIECES = (40.0, 120.0), 4  # s of a piece at least (or the run) and at most; of a run, where it is long enough
HELD = 0.05, 0.95  # of the variance of the heave, between which the band of the waves lies
SMALL = 0.3  # m
STILL = 1e-9  # of a quantity: a deviation below is round-off


class Density(NamedTuple):
    """Density [unit^2/Hz] over frequency [Hz]; piece: seconds that each piece has, pieces: how many."""

    frequency: np.ndarray
    density: np.ndarray
    piece: float
    pieces: int

    @property
    def width(self) -> float:
        """Of a step of the frequency [Hz]."""
        return float(self.frequency[1] - self.frequency[0])

    def moment(self, order: int) -> float:
        """Spectral moment."""
        return float(np.sum(self.frequency**order * self.density) * self.width)

    @property
    def peak(self) -> float:
        """Frequency of the largest density [Hz]."""
        return float(self.frequency[int(self.density.argmax())])

    def share(self, band: tuple[float, float]) -> float:
        """Of the variance in a band."""
        inside = (self.frequency >= band[0]) & (self.frequency <= band[1])
        return float(self.density[inside].sum() / self.density.sum())


def density(values: np.ndarray, tick: float) -> Density | None:
    """Hann windows that overlap by half, the line of least squares taken off each; None where it is too short or
    still."""
    if tick <= 0.0 or len(values) < LEAST or len(values) * tick < LEAST_S or not np.isfinite(values).all():
        return None
    if float(values.std()) <= STILL * max(float(np.abs(values).max()), 1e-9):
        return None
    whole = len(values) * tick
    seconds = min(PIECE_S[1], max(whole / PIECES, PIECE_S[0]), whole)
    frequency, found = welch(values, 1.0 / tick, nperseg=round(seconds / tick), detrend="linear")
    return Density(frequency[1:], found[1:], seconds, max(1, int(2.0 * whole / seconds + 1e-9) - 1))


def band_of(heave: Density) -> tuple[float, float]:
    """Frequencies [Hz] between which most of the variance of the heave lies, see HELD."""
    sums = np.cumsum(heave.density) / heave.density.sum()
    low, high = (int(np.searchsorted(sums, one)) for one in HELD)
    return float(heave.frequency[low]), float(heave.frequency[min(high, len(sums) - 1)])


def in_metres(values: np.ndarray) -> tuple[str, np.ndarray]:
    """Unit in which the swing of a length [m] reads well, and the values in it."""
    return ("m", values) if float(np.ptp(values)) >= SMALL else ("cm", 100.0 * values)


def section(subject: Subject) -> Section:
    """The section; it says why where there are no spectra."""
    found = Section("spectra", "Spectra")
    kept, tick = subject.kept, subject.tick
    force, name = force_unit(kept["tension"] - kept["tension"].mean())
    rows = (
        ("heave of the sheave", *in_metres(kept["sheave_position"][:, 2])),
        ("tension at the sheave", name, force * kept["tension"]),
        ("depth of the towbody", *in_metres(-kept["body_position"][:, 2])),
    )
    every = [(title, unit, values, density(values, tick)) for title, unit, values in rows]
    heave = every[0][3]
    if heave is None:
        why = "the sheave does not heave, or what is left after the start-up is shorter than"
        found.parts.append(Text([f"No spectra: {why} {LEAST_S:g} s."]))
        return found
    band = band_of(heave)
    end = min(float(heave.frequency[-1]), max(3.0 * band[1], 4.0 * heave.peak))
    drawn = [
        Spectrum(title[0].upper() + title[1:], f"{unit}²/Hz", one.frequency, one.density)
        for title, unit, _, one in every
        if one is not None
    ]
    words = (
        f"Peak of the heave at {number(heave.peak, 3)} Hz, a period of {number(1.0 / heave.peak, 3)} s. Grey: the band "
        f"of the waves, {number(band[0], 3)} to {number(band[1], 3)} Hz, which holds 90 % of the variance of the heave."
    )
    caption = (
        f"Power spectral densities, one-sided, of the run without its start-up. {words} Welch's method: "
        f"{counted(heave.pieces, 'piece')} of {number(heave.piece, 3)} s, Hann window, "
        f"overlap of half, linear trend off; a step is {number(heave.width, 2)} Hz."
    )
    found.parts.append(Figure(svg("spectra", (WIDTH, 2.7), lambda f: spectra(f, drawn, band, end)), caption, words))
    table = []
    for title, unit, values, one in every:
        spread, waves = float(values.std()), ["-"] * 3
        if one is not None:
            figures = 1.0 / one.peak, np.sqrt(one.moment(0) / one.moment(2)), 100.0 * one.share(band)
            waves = [number(value, 3) for value in figures]
        table.append((title, number(spread, 4), number(4.0 * spread, 4), unit, *waves))
    head = ("quantity", "deviation", "4 x deviation", "unit", "peak period [s]", "mean period [s]", "in the band [%]")
    caption = (
        "From the series and the spectra: four times the deviation is a significant height where the quantity is a "
        "wave; mean period sqrt(m0/m2)"
    )
    found.parts.append(Table(caption, head, table, right=(1, 2, 4, 5, 6)))
    return found
