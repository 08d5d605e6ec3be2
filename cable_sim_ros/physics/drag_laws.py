"""Drag laws of a section by name: loading functions of the angle to the flow, C_N and C_T of the Reynolds numbers.

f = rho d/2 (C_N(Re_n) q^2 [f_n w/v_n + f_t sign(v_t) u] + C_T(Re_t) |v_t| v_t u), Re_n of the flow across the cable,
Re_t of that along it. f_n and f_t are trigonometric polynomials in eta = atan(v_n/|v_t|): f_n up to 2 eta, f_t up to
5 eta. The quintic of Westin (60b) is fitted by the latter to 1e-7 of its unit (test), so that no law needs an arc
tangent. f_t below zero counts as zero. A law has f_t or C_T.

C_D of f_t is C_N(Re_n) too from 5.7 deg up, as Westin has it; nearer to the cable's own direction it goes over to that
of the whole speed (drag.py).

C_N is constant, Choo & Casarella's C_D(Re), or a fit: pieces a + b Re^n + c log10 Re, blended over ``BLEND`` decades at
their bounds, so that C_N has a continuous derivative also where the print jumps. Formulas, misprints, ranges and what
to take when: docs/drag.md.
"""

from __future__ import annotations

from enum import Enum
from math import inf, log, log10, sqrt
from typing import NamedTuple

import numpy as np

from ..compiler.jit import driver, inline
from .ancf import (
    ADDED_MASS,
    BUOYANCY,
    CD_FIXED,
    CN_FIT,
    CT_FIXED,
    CT_OF_RE,
    DISPLACED,
    EXTRA_ALONG,
    EXTRA_DRAG,
    EXTRA_NOW,
    FN,
    FT,
    HALF_RHO_D,
    RE_FACTOR,
)

MIN_RE, RE_BLEND_1, RE_BLEND_2, MAX_RE = 1e-3, (0.8, 1.25), (25.0, 36.0), 1e5
RE_TOP = RE_BLEND_2[1]
BLEND = 0.05  # decades of Re, full width
GRAZING = 0.1  # tan eta, 5.7 deg: below it the C_D of f_t goes over from that of V_n to that of the whole speed
LN10 = log(10.0)


class DragLaw(str, Enum):
    """Drag law of a section."""

    OFF = "off"
    DRISCOLL_NAHON = "driscoll_nahon"  # 0.011 on sin(2 eta): our default, a judgement
    DRISCOLL_NAHON_PRINTED = "driscoll_nahon_printed"  # 0.11 as printed by Westin (60a); f_n < 0 below 8 deg
    RIBBON = "ribbon"  # ribbon fairing, Westin (145)
    CROSSFLOW = "crossflow"  # f_n = sin^2 eta, C_t |v_t| v_t
    PODE = "pode"  # f_n = sin^2 eta, f_t = C_t / C_D at every angle
    CHOO_CASARELLA = "choo_casarella"  # crossflow with their C_D(Re_n)
    HUSTON_KAMMAN_6 = "huston_kamman_6"  # crossflow with C_N of equation 6, C_T of 7
    HUSTON_KAMMAN_10 = "huston_kamman_10"  # C_N of equation 10 mended, 1.1 in its row 2
    HUSTON_KAMMAN_10_ROW_2_PRINTED = "huston_kamman_10_row_2_printed"  # 1.0 there
    DYMORE = "dymore"  # crossflow with given constants c_d, c_f
    CAPOZUCCA = "capozucca"  # crossflow with C_dn = 1.0


class AmplifiedDrag(str, Enum):
    """What a drag factor found by hand multiplies."""

    NORMAL = "normal"  # the drag across the cable: a measured C_D, Vandiver, Blevins
    BOTH = "both"  # that along it too, Westin (64)


# C_N(Re) of a law: what it is of Choo & Casarella, or a row of FITS
CHOO_CASARELLA, HK_6, HK_10, HK_10_PRINTED, FRICTION = range(5)


def _pieces(*rows) -> list[tuple[float, ...]]:
    """Pieces (upper bound in Re, a, b, n, c) with log10 of the bound, the last repeated to seven."""
    pieces = [(log10(maximum) if maximum < inf else inf, *rest) for maximum, *rest in rows]
    return pieces + [pieces[-1]] * (7 - len(pieces))


def _huston_kamman_10(second: float):
    """Equation 10 of Huston & Kamman with Re^-0.90 in row 1 (printed -0.40) and -1.05 in row 5 (printed +1.05)."""
    return _pieces(
        (30.0, 1.45, 8.55, -0.9, 0.0),
        (100.0, second, 4.0, -0.5, 0.0),
        (1000.0, 2.25, 0.0, 0.0, -0.45),
        (4000.0, 0.9, 0.0, 0.0, 0.0),
        (15000.0, -1.05, 0.0, 0.0, 0.54),
        (150000.0, 1.21, 0.0, 0.0, 0.0),
        (inf, 0.3, 0.0, 0.0, 0.0),
    )


FITS = np.array(
    [
        _pieces((inf, 0.0, 0.0, 0.0, 0.0)),  # Choo & Casarella have their own function
        _pieces((400.0, 0.45, 5.93, -0.33, 0.0), (1e5, 1.27, 0.0, 0.0, 0.0), (inf, 0.3, 0.0, 0.0, 0.0)),
        _huston_kamman_10(1.1),
        _huston_kamman_10(1.0),
        # C_T of equation 7, held below 0.1
        _pieces((0.1, 1.88 * 0.1**-0.74, 0.0, 0.0, 0.0), (100.55, 0.0, 1.88, -0.74, 0.0), (inf, 0.062, 0.0, 0.0, 0.0)),
    ]
)

# fit of (60b) on [0, pi/2], cos 0..5 and sin 1..5, largest difference 7e-8; checked by a test
_FT_BARE = (
    -0.154069822042428,
    0.32370195471209123,
    -0.19768199976246204,
    0.04699662080294466,
    0.0025192226692795916,
    -0.0013760002668004867,
    0.024658849723673076,
    -0.0890678193267043,
    0.07196180416171502,
    -0.017956738489678433,
    0.0011127654967487688,
)
_FT_RIBBON = (-0.2255, 0.3417, 0.0, 0.0, 0.0, 0.0, 0.255, -0.0811, 0.0, 0.0, 0.0)
_NONE = (0.0,) * 11
_SQUARE = (0.5, 0.0, 0.0, -0.5, 0.0)  # sin^2 eta
_COSINE, EVERY_ANGLE = (0.5, 0.0, 0.5), (1.0, 0.0, 0.0)  # f_t of C_t: cos^2 eta, 1
BARE, RIBBON, ANY = ("none",), ("none", "ribbon", "hair"), ("none", "ribbon", "airfoil", "hair")


class Law(NamedTuple):
    """Numbers of a drag law, and for what its source gives them."""

    normal: tuple[float, ...]  # f_n: 1, cos, sin, cos 2, sin 2
    tangential: tuple[float, ...] = _NONE  # f_t: 1, cos .. cos 5, sin .. sin 5
    per_ct: tuple[float, ...] | None = None  # f_t of C_t/C_D; none: the law takes no C_t
    fit: int = CHOO_CASARELLA  # C_N(Re) where the section has no constant C_D
    own_fit: bool = False  # is the law named after its C_N(Re)? Then no constant may replace it
    own_friction: bool = False  # C_T(Re_t) where the section has no C_t
    drag_coefficient: float | None = None  # its own constant C_D
    min_drag: float = 0.0  # constant C_D that the source gives, from
    max_drag: float = inf  # to
    min_re: float = 0.0  # Re_n for which the source gives C_N, from
    max_re: float = inf  # to
    min_angle: float = 0.0  # deg, least eta
    fairing: tuple[str, ...] = ANY  # kinds of cable it was measured on or is meant for
    source: str = ""
    outside: str = ""  # what is used outside the range


_BARE = Law(
    (0.5, -0.1, 0.1, -0.4, -0.011),
    _FT_BARE,
    fairing=BARE,
    max_re=1e5,
    source="Westin (2018), (60)-(61)",
    outside="C_D is held at its value at Re = 1e5, and a cylinder loses most of its drag in the drag crisis beyond",
)
_CROSS = _BARE._replace(
    normal=_SQUARE, tangential=_NONE, per_ct=_COSINE, fairing=ANY, source="Choo and Casarella (1971)"
)
_HK = Law(
    _SQUARE,
    per_ct=_COSINE,
    own_fit=True,
    own_friction=True,
    fairing=BARE,
    min_re=1.0,
    source="Huston and Kamman (1980), equation 10",
    outside="the lowest branch is extended below its bound",
)
LAWS: dict[DragLaw, Law] = {
    DragLaw.OFF: Law((0.0,) * 5, source="no drag"),
    DragLaw.DRISCOLL_NAHON: _BARE,
    DragLaw.DRISCOLL_NAHON_PRINTED: _BARE._replace(
        normal=(0.5, -0.1, 0.1, -0.4, -0.11),
        min_angle=8.0,
        outside="f_n is negative below 8 deg, C_D held beyond Re = 1e5",
    ),
    DragLaw.RIBBON: _BARE._replace(
        normal=(0.498609, -0.2499, 0.2527, -0.2487, 0.0),
        tangential=_FT_RIBBON,
        fairing=RIBBON,
        source="Westin (2018), (145)",
    ),
    DragLaw.CROSSFLOW: _CROSS,
    DragLaw.PODE: _CROSS._replace(per_ct=EVERY_ANGLE),
    DragLaw.CHOO_CASARELLA: _CROSS._replace(own_fit=True, fairing=BARE),
    DragLaw.HUSTON_KAMMAN_6: _HK._replace(fit=HK_6, min_re=0.1, source="Huston and Kamman (1980), equation 6"),
    DragLaw.HUSTON_KAMMAN_10: _HK._replace(fit=HK_10),
    DragLaw.HUSTON_KAMMAN_10_ROW_2_PRINTED: _HK._replace(fit=HK_10_PRINTED),
    DragLaw.DYMORE: Law(
        _SQUARE,
        per_ct=_COSINE,
        min_drag=0.5,
        max_drag=2.0,
        source="the Dymore manual, equation 10",
        outside="the manual says no more of such a cable",
    ),
    DragLaw.CAPOZUCCA: Law(
        _SQUARE,
        per_ct=_COSINE,
        drag_coefficient=1.0,
        max_re=3e5,
        min_angle=85.0,
        fairing=BARE,
        source="Capozucca (1988), equation 3.6",
        outside="its cases are vertical cables in a horizontal current; C_dn is the same number",
    ),
}


def of_components(law: DragLaw) -> bool:
    """Is the drag C_N |V_n| V_n + C_T |V_t| V_t, so that a rigid link has closed forms of it?"""
    return LAWS[law].normal == _SQUARE and LAWS[law].per_ct == _COSINE


@inline
def coefficient_along(across, d_across, whole, d_whole, vn, at, free):
    """C_D of f_t and its derivatives to V_n and |v_t|: ``across``, that of V_n, from the angle of GRAZING up, and
    ``whole``, that of |V|, along the cable. d_across, d_whole: derivatives to these speeds; free: 0 of a constant."""
    ratio = vn / at
    x = min(ratio * ratio * (1.0 / (GRAZING * GRAZING)), 1.0)
    rest = free * (1.0 - x * x * (3.0 - 2.0 * x))
    turn = (across - whole) * free * 12.0 * x * x * (1.0 - x)  # derivative to ln V_n at a constant |v_t|
    q = sqrt(vn * vn + at * at)
    return (
        across + rest * (whole - across),
        d_across + rest * (d_whole * vn / q - d_across) + turn / vn,
        rest * d_whole * at / q - turn / at,
    )


@inline
def smooth(x, low, high):
    """Smoothstep from 0 at low to 1 at high and its derivative."""
    t = min(max((x - low) / (high - low), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / (high - low)


@inline
def choo_casarella(re):
    """C_D(Re) of (61) and dC_D/dRe, blended over Re 0.8-1.25 and 25-36, held outside 1e-3..1e5."""
    if re >= MAX_RE:
        return 1.1 + 4.0 / sqrt(MAX_RE), 0.0
    if re >= RE_TOP:
        return 1.1 + 4.0 / sqrt(re), -2.0 / (re * sqrt(re))
    x = max(re, MIN_RE)
    mid = 8.55 * x**-0.9
    cd, dcd = 1.45 + mid, -0.9 * mid / x
    if x > RE_BLEND_2[0]:
        t, dt = smooth(x, RE_BLEND_2[0], RE_BLEND_2[1])
        top, dtop = 1.1 + 4.0 / sqrt(x), -2.0 / (x * sqrt(x))
        return cd + t * (top - cd), dcd + t * (dtop - dcd) + dt * (top - cd)
    if x < RE_BLEND_1[1]:
        s = -0.077215665 + log(8.0 / x)
        g = 8.0 * np.pi / (x * s)
        low = g * (1.0 - 0.87 / (s * s))
        dlow = g / x * (-1.0 + 1.0 / s + 0.87 / (s * s) - 2.61 / (s * s * s))
        t, dt = smooth(x, RE_BLEND_1[0], RE_BLEND_1[1])
        cd, dcd = low + t * (cd - low), dlow + t * (dcd - dlow) + dt * (cd - low)
    return cd, (dcd if re > MIN_RE else 0.0)


@inline
def piece(fit, i, re, x):
    """Piece i of a fit at Re = 10^x and its derivative to x."""
    power = FITS[fit, i, 2] * re ** FITS[fit, i, 3]
    return FITS[fit, i, 1] + power + FITS[fit, i, 4] * x, LN10 * FITS[fit, i, 3] * power + FITS[fit, i, 4]


@driver
def fitted(fit, re):
    """C(Re) of row ``fit`` of FITS and its derivative, held below 1e-3."""
    held = max(re, MIN_RE)
    x, i = log10(held), 0
    while x > FITS[fit, i, 0] + 0.5 * BLEND:
        i += 1
    c, dc = piece(fit, i, held, x)
    bound = FITS[fit, i, 0]
    if x > bound - 0.5 * BLEND:
        t, dt = smooth(x, bound - 0.5 * BLEND, bound + 0.5 * BLEND)
        after, dafter = piece(fit, i + 1, held, x)
        c, dc = c + t * (after - c), dc + t * (dafter - dc) + dt * (after - c)
    return c, (dc / (LN10 * held) if re > MIN_RE else 0.0)


@inline
def loading(c, s, p, e):
    """f_n, df_n/deta, f_t, df_t/deta for cos eta = c, sin eta = s with the coefficients of lane e."""
    c2, s2 = c * c - s * s, 2.0 * s * c
    fn = p[FN, e] + p[FN + 1, e] * c + p[FN + 2, e] * s + p[FN + 3, e] * c2 + p[FN + 4, e] * s2
    dn = p[FN + 2, e] * c - p[FN + 1, e] * s + 2.0 * (p[FN + 4, e] * c2 - p[FN + 3, e] * s2)
    c3, s3 = c2 * c - s2 * s, s2 * c + c2 * s
    c4, s4 = c2 * c2 - s2 * s2, 2.0 * s2 * c2
    c5, s5 = c4 * c - s4 * s, s4 * c + c4 * s
    ft = (
        p[FT, e]
        + p[FT + 1, e] * c
        + p[FT + 2, e] * c2
        + p[FT + 3, e] * c3
        + p[FT + 4, e] * c4
        + p[FT + 5, e] * c5
        + p[FT + 6, e] * s
        + p[FT + 7, e] * s2
        + p[FT + 8, e] * s3
        + p[FT + 9, e] * s4
        + p[FT + 10, e] * s5
    )
    dt = (
        p[FT + 6, e] * c
        - p[FT + 1, e] * s
        + 2.0 * (p[FT + 7, e] * c2 - p[FT + 2, e] * s2)
        + 3.0 * (p[FT + 8, e] * c3 - p[FT + 3, e] * s3)
        + 4.0 * (p[FT + 9, e] * c4 - p[FT + 4, e] * s4)
        + 5.0 * (p[FT + 10, e] * c5 - p[FT + 5, e] * s5)
    )
    return fn, dn, (ft if ft > 0.0 else 0.0), (dt if ft > 0.0 else 0.0)


def element_rows(section, cable, water, gravity: float) -> dict[int, float]:
    """Hydrodynamic rows of the element table for one section: blocks Section, Cable and Water; gravity [m/s^2].

    Raises ValueError where the law needs a constant C_D and the section has none.
    """
    d, density, law = cable.diameter, water.density, LAWS[section.drag_law]
    area = 0.25 * np.pi * d**2
    constant = law.drag_coefficient if section.drag_coefficient is None else section.drag_coefficient
    tangential, extra = section.tangential_coefficient, section.drag_amplification - 1.0
    if not constant and (law.min_drag > 0.0 or (tangential and law.per_ct is EVERY_ANGLE)):
        raise ValueError(
            f"the law {section.drag_law.value} needs a constant C_D above 0, and the section has none; nothing was "
            "built. Give drag_coefficient"
        )
    rows = {
        HALF_RHO_D: 0.5 * density * d,
        RE_FACTOR: density * d / water.viscosity,
        ADDED_MASS: density * area * cable.added_mass_coefficient,
        BUOYANCY: density * area * gravity,
        DISPLACED: density * area,
        EXTRA_DRAG: extra,
        EXTRA_NOW: extra,
        EXTRA_ALONG: 0.0 if section.drag_amplification_of is AmplifiedDrag.NORMAL else extra,
        CD_FIXED: -1.0 if constant is None else constant,
        CN_FIT: float(law.fit),
    }
    rows.update({FN + i: value for i, value in enumerate(law.normal)})
    rows.update({FT + i: value for i, value in enumerate(law.tangential)})
    if tangential and law.per_ct is not None:
        if constant:
            rows.update({FT + i: tangential / constant * value for i, value in enumerate(law.per_ct)})
        else:
            rows[CT_FIXED] = tangential
    rows[CT_OF_RE] = 1.0 if law.own_friction and tangential is None else 0.0
    return rows
