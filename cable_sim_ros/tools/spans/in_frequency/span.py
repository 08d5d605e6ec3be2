"""What a span is: a cable held at both ends, its tension, the flow across it, and how it is computed.

Arc s [m] runs from the end s = 0 (Capozucca's lower end) to the end s = length. SI units throughout.

The string of a span: tension, mass, diameter and flow along it, travel time of its waves.

Between two places of a table tension and mass are linear. With the root of the tension as variable the travel time
is 2 ds / (sqrt T_a + sqrt T_b) times a mean of sqrt m: exact for constant mass, without a limit to take at w = 0.
"""

from __future__ import annotations

from enum import Enum
from functools import cached_property
from math import pi

import numpy as np
from scipy.integrate import trapezoid

from ....physics.parameter import REQUIRED, Block, choice, quantity

SOURCE = "Capozucca (1988)"
MAX_SEGMENTS = 5000

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
NODES, WEIGHTS = 0.5 * (NODES + 1.0), 0.5 * WEIGHTS


class Shape(str, Enum):
    """Mode shape in the integral of the damping."""

    WKB = "wkb"  # amplitude (T_c/T)^1/4 and the modal mass that belongs to it
    SINE = "sine"  # plain sine and m L / 2, as printed in (3.24), (4.20)


class Region(str, Enum):
    """Part of the cable that feeds power into a mode and does not damp it."""

    OFF = "off"  # none: the whole cable damps every mode
    HALF_SPACING = "half_spacing"  # |f_s(s) - f_n| < f_1 / 2
    CORRELATION_LENGTH = "correlation_length"  # |s - s_n| < L_c, f_s(s_n) = f_n, as printed in (4.17)


class Reading(str, Enum):
    """Reading of a lift spectrum that the source does not print (docs/viv.md)."""

    A = "A"  # the words of the source, nothing fitted
    B = "B"  # lift at 0.15/0.17 of the shedding frequency: a fit to the printed responses
    C = "C"  # 0.145/0.17, correlation length times sqrt 2: likewise


class Correlation(str, Enum):
    """Correlation of the lift at two places a distance d apart."""

    GAUSSIAN = "gaussian"  # exp(-d^2 / (2 L_c^2)): L_c is the standard deviation
    EXPONENTIAL = "exponential"  # exp(-|d| / L_c)


class Method(str, Enum):
    """How the response to a force is computed."""

    WKB = "wkb"  # Green's function in closed form
    EXACT = "exact"  # finite differences: no assumption of slowly varying tension


class CableBlock(Block):
    """The cable. Along it constant, where `profile` says nothing else."""

    length: float = quantity(REQUIRED, "m", 0.01, 2e4, "length L between the two held ends", SOURCE)
    diameter: float = quantity(REQUIRED, "m", 1e-5, 10.0, "outer diameter D", SOURCE)
    mass_per_length: float = quantity(
        REQUIRED, "kg/m", None, 1e5, "mass per length in air, with what is inside, without added mass", above=0.0
    )
    added_mass_coefficient: float = quantity(
        1.0, "1", 0.0, 10.0, "added mass C_a over the mass of displaced water", "(3.8)"
    )
    bending_stiffness: float = quantity(
        0.0, "N m^2", 0.0, 1e12, "E I; ends pinned; 0: a string", "(5.21), with the mean tension"
    )


class TensionBlock(Block):
    """Tension T(s) = start + gradient s, effective (buoyancy taken off); a table stands in `profile` instead."""

    start: float | None = quantity(
        None, "N", None, 1e9, "tension T_c at s = 0; none: profile.tension says it", "(3.4)", above=0.0
    )
    gradient: float = quantity(0.0, "N/m", -1e5, 1e5, "growth w of the tension along s: net weight per length", "(3.4)")


class WaterBlock(Block):
    """The fluid."""

    density: float = quantity(1025.0, "kg/m^3", 0.01, 2000.0, "density of the fluid")


class FlowBlock(Block):
    """Flow across the cable: the component normal to it, linear between the places of the table."""

    arc: tuple[float, ...] = quantity(REQUIRED, "m", 0.0, 2e4, "places s of the table, from 0 to cable.length")
    speed: tuple[float, ...] = quantity(REQUIRED, "m/s", 0.0, 100.0, "mean speed V normal to the cable at them")
    turbulence: float = quantity(
        REQUIRED, "m/s", None, 100.0, "standard deviation of the speed: width of the lift spectrum", SOURCE, above=0.0
    )
    strouhal: float = quantity(0.17, "1", 0.01, 1.0, "Strouhal number: shedding frequency f_s = St V / D", SOURCE)


class ProfileBlock(Block):
    """Tables along the cable in place of single numbers; a column left out keeps the single number."""

    arc: tuple[float, ...] = quantity((), "m", 0.0, 2e4, "places s of the table, from 0 to cable.length")
    tension: tuple[float, ...] = quantity((), "N", None, 1e9, "tension at them, in place of `tension`", above=0.0)
    mass_per_length: tuple[float, ...] = quantity(
        (), "kg/m", None, 1e5, "mass per length in air at them, in place of cable.mass_per_length", above=0.0
    )
    diameter: tuple[float, ...] = quantity((), "m", 1e-5, 10.0, "diameter at them, in place of cable.diameter")


class DampingBlock(Block):
    """Damping ratios: computed from the drag of the parts that are not driven, or given."""

    ratios: tuple[float, ...] = quantity(
        (), "1", None, 5.0, "damping ratios of modes 1, 2, ... in place of the computed ones, structural part included",
        above=0.0,
    )  # fmt: skip
    structural: float = quantity(0.003, "1", None, 1.0, "structural damping ratio zeta_s of each mode", SOURCE, above=0)
    drag_coefficient: float = quantity(1.0, "1", 0.0, 5.0, "drag coefficient C_D of the cable at rest", SOURCE)
    drag_amplification: float = quantity(1.0, "1", 1.0, 5.0, "factor on C_D due to vibration", SOURCE)
    motion_factor: float = quantity(1.0, "1", 1.0, 2.5, "gamma: 1 + 3/8 (ydot/V)^2 for |ydot| <= V/2", "(4.8), mended")
    region: Region = choice(Region.HALF_SPACING, "part of the cable that drives a mode and does not damp it", "(4.17)")
    mode_shape: Shape = choice(Shape.WKB, "mode shape in the integral of the damping", "(3.24)")
    segments: int = quantity(
        4000, "1", 4, 100_000, "parts of the cable in that integral; the source: response.segments"
    )


class LiftBlock(Block):
    """Lift spectrum."""

    reading: Reading = choice(Reading.A, "reading of the lift spectrum")
    mean_squares: tuple[float, ...] = quantity(
        (0.631, 0.1, 0.15, 0.0025, 0.025), "1", 0.0, 10.0, "mean square of C_L at 1, 2, ... times the shedding rate",
        SOURCE + " fig. 5.5",
    )  # fmt: skip
    correlation: Correlation = choice(Correlation.GAUSSIAN, "correlation of the lift along the cable", SOURCE)
    correlation_length: float | None = quantity(
        None,
        "m",
        None,
        2e4,
        "correlation length L_c; none: length / (2 modes), of those up to the top shedding frequency",
        "(4.19)",
        above=0.0,
    )


class ResponseBlock(Block):
    """Grids and method of the response."""

    method: Method = choice(Method.WKB, "how the response to a force is computed")
    modes: int | None = quantity(
        None, "1", 1, 2000, "modes with a damping ratio; none: those up to the top shedding frequency, rounded"
    )
    segments: int = quantity(200, "1", 4, MAX_SEGMENTS, "parts of the cable that the lift acts on")
    points: int = quantity(200, "1", 4, 5000, "parts between the places where the response is reported")
    place: float | None = quantity(
        None, "m", 0.0, 2e4, "place s whose spectrum is reported; none: where the rms displacement is largest"
    )
    frequency_step: float | None = quantity(
        None, "Hz", None, 100.0, "equal step of the spectra; none: chosen, fine about the resonances", above=0.0
    )
    steps_per_half_width: float = quantity(
        3.0, "1", 0.5, 50.0, "steps in half the width of a resonance or lift peak, where frequency_step is not given"
    )
    frequencies: int | None = quantity(
        None, "1", 10, 20_000, "number of equal steps; none: up to all harmonics of the top shedding frequency"
    )


class Span(Block):
    """Everything a vibration is computed from. `load_span` reads it from a file, `span_from_dict` from plain data."""

    name: str = choice("span", "name in reports")
    cable: CableBlock = choice(REQUIRED, "the cable")
    tension: TensionBlock = choice(TensionBlock(), "its tension, linear along it")
    profile: ProfileBlock = choice(ProfileBlock(), "tables along it")
    water: WaterBlock = choice(WaterBlock(), "the fluid")
    flow: FlowBlock = choice(REQUIRED, "the flow across it")
    damping: DampingBlock = choice(DampingBlock(), "damping ratios")
    lift: LiftBlock = choice(LiftBlock(), "lift spectrum")
    response: ResponseBlock = choice(ResponseBlock(), "grids and method")


class Line:
    """A span as functions of arc s [m]; arrays in, arrays of the same shape out."""

    def __init__(self, span: Span):
        cable, table = span.cable, span.profile
        self.length = cable.length
        self.added = span.water.density * cable.added_mass_coefficient * 0.25 * pi  # kg/m^3, of D^2
        self.density = span.water.density
        self.stiffness = cable.bending_stiffness
        self.knots = np.array(table.arc or (0.0, cable.length))
        ends = np.full(len(self.knots), 1.0)
        start = span.tension.start or 0.0
        self._tension = np.array(table.tension or start + span.tension.gradient * self.knots)
        self._mass = np.array(table.mass_per_length or cable.mass_per_length * ends)
        self._diameter = np.array(table.diameter or cable.diameter * ends)
        self._flow = np.array(span.flow.arc), np.array(span.flow.speed)
        self.strouhal = span.flow.strouhal

    def tension(self, s):
        """T(s) [N]."""
        return np.interp(s, self.knots, self._tension)

    def diameter(self, s):
        """D(s) [m]."""
        return np.interp(s, self.knots, self._diameter)

    def mass(self, s):
        """Mass per length with added mass m_t(s) [kg/m]."""
        return np.interp(s, self.knots, self._mass) + self.added * self.diameter(s) ** 2

    def flow(self, s):
        """Speed normal to the cable V(s) [m/s]."""
        return np.interp(s, *self._flow)

    def shedding(self, s):
        """Shedding frequency f_s(s) = St V / D [Hz]."""
        return self.strouhal * self.flow(s) / self.diameter(s)

    def impedance(self, s):
        """sqrt(m_t T) [kg/s]: the amplitude of a wave goes as its inverse root."""
        return np.sqrt(self.mass(s) * self.tension(s))

    def travel_time(self, s):
        """tau(s) [s]: time of a wave from s = 0 to s, (3.15)."""
        s = np.asarray(s, float)
        at = np.unique(np.concatenate((self.knots, s.ravel(), (0.0, self.length))))
        root, step = np.sqrt(self.tension(at)), np.diff(at)
        both = root[1:] + root[:-1]
        fraction = NODES * (2.0 * root[:-1, None] + NODES * np.diff(root)[:, None]) / both[:, None]
        mean = np.sqrt(self.mass(at[:-1, None] + step[:, None] * fraction)) @ WEIGHTS
        tau = np.concatenate(((0.0,), np.cumsum(2.0 * step / both * mean)))
        return np.interp(s, at, tau)

    def time_left(self, s):
        """tau(L) - tau(s) [s]; nothing at the end, without a rounding error."""
        return np.where(np.asarray(s) == self.length, 0.0, self.crossing - self.travel_time(s))

    @cached_property
    def crossing(self) -> float:
        """tau(L) [s]."""
        return float(self.travel_time(self.length))

    @cached_property
    def mean_tension(self) -> float:
        """Mean of T along the cable [N]."""
        return float(trapezoid(self._tension, self.knots) / self.length)

    @cached_property
    def bend(self) -> float:
        """kappa [s^2] of omega^2 = omega_string^2 (1 + kappa omega_string^2): (5.21) with the mean tension."""
        return self.stiffness * self.crossing**2 / (self.mean_tension * self.length**2)

    @cached_property
    def shedding_range(self) -> tuple[float, float]:
        """Least and largest shedding frequency along the cable [Hz]."""
        at = np.linspace(0.0, self.length, 2001)
        f = self.shedding(np.unique(np.concatenate((at, self.knots, self._flow[0]))))
        return float(f.min()), float(f.max())
