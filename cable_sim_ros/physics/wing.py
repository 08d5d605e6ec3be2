"""Wings, fins and their flaps: lift and drag of a foil at any angle to the flow, with stall.

Attached, the lift goes with the angle of attack and the drag with its square; stalled, both are those of a plate; the
share of stall goes smoothly from one to the other (Beard and McLain 2012, 4.9-4.10).
"""

from __future__ import annotations

from math import acos, atan2, cos, exp, pi, radians, sin, sqrt

import numpy as np

from ..compiler.jit import inline
from .parameter import REQUIRED, Block, quantity
from .vec import axpy, dot, scale

WING = np.dtype(
    [
        ("place", "f8", 3),  # m, from the tow point
        ("chord", "f8", 3),  # unit vectors, ahead and normal
        ("normal", "f8", 3),
        ("size", "f8"),  # kg/m: rho/2 S
        ("slope", "f8"),  # dC_L/d angle of attack, 1/rad
        ("drag", "f8"),  # C_D0
        ("induced", "f8"),  # 1/(pi e a)
        ("stall", "f8"),  # rad
        ("lift_of_flap", "f8"),  # dC_L/d angle of the flap, 1/rad; 0: there is none
        ("range", "f8"),  # rad, of the flap, either way
        ("rate", "f8"),  # rad/s
        ("neutral", "f8"),  # rad
        ("timeout", "i8"),  # ns; 0: none
        ("begins", "f8"),  # rad, where the flap stands before any command
        ("half_height", "f8"),  # m, half of that over which it leaves the water
    ],
    align=True,
)
SHARP = 25.0  # of the transition to stall
CLIP = 60.0  # of its exponents
SPEED_FLOOR = 1e-3  # m/s
THICK = 0.1  # thickness over chord of a wing that lies flat in the surface


class Wing(Block):
    """A wing, fin or foil, a rectangle: span to port where it has no dihedral, chord ahead."""

    place: tuple[float, float, float] = quantity(
        REQUIRED, "m", -100.0, 100.0, "centre of its lift (a quarter of the chord), from the tow point"
    )
    span: float = quantity(REQUIRED, "m", None, 100.0, "extent across the flow", above=0.0)
    chord: float = quantity(REQUIRED, "m", None, 100.0, "extent along the flow", above=0.0)
    dihedral: float = quantity(0.0, "deg", -180.0, 180.0, "of the span, about x; 90: an upright fin")
    incidence: float = quantity(0.0, "deg", -45.0, 45.0, "leading edge up, of a fin to port where dihedral is -90")
    lift_slope: float | None = quantity(
        None, "1/rad", None, 7.0, "dC_L/d angle of attack; none: 2 pi a/(2 + sqrt(4 + a^2))", "Helmbold 1942", above=0.0
    )
    drag_coefficient: float = quantity(0.01, "1", 0.0, 2.0, "C_D without lift, of its area")
    span_efficiency: float = quantity(0.9, "1", None, 1.2, "e of the induced drag C_L^2/(pi e a)", above=0.0)
    stall_angle: float = quantity(
        18.0, "deg", 1.0, 60.0, "15 to 20 for a > 3, 25 to 35 for 1 to 2", "Whicker and Fehlner 1958"
    )
    flap_share: float = quantity(0.0, "1", 0.0, 0.9, "chord of the flap over that of the wing; 0: none")
    flap: float = quantity(
        0.0, "deg", -60.0, 60.0, "angle of the flap, trailing edge down; a change goes to it", configure=False
    )
    flap_range: float | None = quantity(
        None, "deg", None, 60.0, "largest angle of the flap either way; none: worth the angle of stall", above=0.0
    )
    flap_rate: float | None = quantity(None, "deg/s", None, 1e4, "of the flap; none: at once", above=0.0)
    flap_timeout: float | None = quantity(
        None, "s", None, 3600.0, "after a command, until the flap goes to flap_neutral; none: it stays", above=0.0
    )
    flap_neutral: float = quantity(0.0, "deg", -60.0, 60.0, "angle of the flap after flap_timeout")

    @property
    def area(self) -> float:
        """Plan area [m^2]."""
        return self.span * self.chord

    @property
    def aspect(self) -> float:
        """Aspect ratio."""
        return self.span / self.chord

    @property
    def slope(self) -> float:
        """Lift slope [1/rad]."""
        if self.lift_slope is not None:
            return self.lift_slope
        return 2.0 * pi * self.aspect / (2.0 + sqrt(4.0 + self.aspect**2))

    @property
    def lift_of_flap(self) -> float:
        """dC_L/d angle of the flap [1/rad]."""
        return self.slope * flap_effect(self.flap_share)

    @property
    def reach(self) -> float:
        """Largest angle of the flap either way [deg]."""
        worth = flap_effect(self.flap_share)
        return min(60.0, self.stall_angle / worth if worth else 60.0) if self.flap_range is None else self.flap_range

    def level(self) -> tuple[float, float]:
        """S C_L upward and S C_D [m^2] where its body is level and heads into the flow; C_L as at stall at most."""
        lift = self.slope * radians(self.incidence) + self.lift_of_flap * radians(self.flap)
        most = self.slope * radians(self.stall_angle)
        lift = min(max(lift, -most), most)
        drag = self.drag_coefficient + lift**2 / (pi * self.span_efficiency * self.aspect)
        return self.area * lift * cos(radians(self.dihedral)), self.area * drag


def flap_effect(share: float) -> float:
    """Angle of attack that a flap of this share of the chord is worth, over its angle."""
    t = acos(2.0 * share - 1.0)
    return 1.0 - (t - sin(t)) / pi if share > 0.0 else 0.0


def wing_record(wing: Wing, density: float) -> np.ndarray:
    """The wing as a WING record."""
    row = np.zeros((), WING)
    d, i = radians(wing.dihedral), radians(wing.incidence)
    normal = np.array([0.0, -sin(d), cos(d)])
    row["place"] = wing.place
    row["chord"] = cos(i) * np.array([1.0, 0.0, 0.0]) + sin(i) * normal
    row["normal"] = cos(i) * normal - sin(i) * np.array([1.0, 0.0, 0.0])
    row["size"], row["slope"], row["drag"] = 0.5 * density * wing.area, wing.slope, wing.drag_coefficient
    row["induced"], row["stall"] = 1.0 / (pi * wing.span_efficiency * wing.aspect), radians(wing.stall_angle)
    row["lift_of_flap"], row["range"] = wing.lift_of_flap, radians(wing.reach)
    row["rate"] = np.inf if wing.flap_rate is None else radians(wing.flap_rate)
    row["neutral"], row["timeout"] = radians(wing.flap_neutral), round((wing.flap_timeout or 0.0) * 1e9)
    row["begins"] = radians(wing.flap)
    row["half_height"] = 0.5 * (wing.span * abs(sin(d)) + THICK * wing.chord * abs(cos(d)))
    return row


@inline
def coefficients_of(wing, angle, flap):
    """C_L and C_D at an angle of attack [rad] and of the flap [rad], and their derivatives to the first."""
    one = 1.0 / (1.0 + exp(min(max(-SHARP * (angle - wing.stall), -CLIP), CLIP)))
    two = 1.0 / (1.0 + exp(min(max(SHARP * (angle + wing.stall), -CLIP), CLIP)))
    share = 1.0 - (1.0 - one) * (1.0 - two)
    by_angle = SHARP * ((1.0 - two) * one * (1.0 - one) - (1.0 - one) * two * (1.0 - two))
    lift = wing.slope * angle + wing.lift_of_flap * flap
    drag = wing.induced * lift * lift
    s, c = sin(angle), cos(angle)
    side = 1.0 if s >= 0.0 else -1.0
    plate, plate_drag = 2.0 * s * s * c * side, 2.0 * s * s * s * side
    plate_slope, plate_drag_slope = side * (4.0 * s * c * c - 2.0 * s * s * s), 6.0 * s * s * c * side
    return (
        (1.0 - share) * lift + share * plate,
        wing.drag + (1.0 - share) * drag + share * plate_drag,
        (1.0 - share) * wing.slope + share * plate_slope + by_angle * (plate - lift),
        (1.0 - share) * 2.0 * wing.induced * lift * wing.slope
        + share * plate_drag_slope
        + by_angle * (plate_drag - drag),
    )


@inline
def wing_force(wing, flap, w, tangent):
    """Force [N] of water that comes with the velocity w [m/s], body axes, rows of its derivative to w, angle of attack
    over that of stall, and the size of what it bears at a C_L of 1 [N]; flap: its angle [rad]."""
    c, n = (wing.chord[0], wing.chord[1], wing.chord[2]), (wing.normal[0], wing.normal[1], wing.normal[2])
    along, across = dot(w, c), dot(w, n)
    square = along * along + across * across + SPEED_FLOOR * SPEED_FLOOR
    speed = sqrt(square)
    angle = atan2(across, -along)
    lift, drag, lift_slope, drag_slope = coefficients_of(wing, angle, flap)
    fc, fn = lift * across + drag * along, drag * across - lift * along
    k = wing.size * speed
    force = axpy(k * fc, c, scale(k * fn, n))
    none, stall, size = (0.0, 0.0, 0.0), abs(angle) / wing.stall, wing.size * square
    if not tangent:
        return force, (none, none, none), stall, size
    ac, an = across / square, -along / square  # of the angle, to along and across
    gc, gn = lift_slope * across + drag_slope * along, drag_slope * across - lift_slope * along
    by_c = axpy(k * (drag + gc * ac + fc * along / square), c, scale(k * (-lift + gn * ac + fn * along / square), n))
    by_n = axpy(k * (lift + gc * an + fc * across / square), c, scale(k * (drag + gn * an + fn * across / square), n))
    rows = (
        axpy(by_c[0], c, scale(by_n[0], n)),
        axpy(by_c[1], c, scale(by_n[1], n)),
        axpy(by_c[2], c, scale(by_n[2], n)),
    )
    return force, rows, stall, size
