"""Formulas of strumming against printed values; what bounds them."""

from math import pi

import pytest

from cable_sim_ros.physics import viv_amplification
from cable_sim_ros.physics.viv_amplification import FORMULAS, LAWS, StrumDrag, StrumLaw
from verification.experiments.viv_tow import facchinetti

pytestmark = pytest.mark.check


def plain(function):
    return getattr(function, "py_func", function)


amplitude, amplification, onset, strouhal = map(
    plain,
    (viv_amplification.amplitude, viv_amplification.amplification, viv_amplification.onset, viv_amplification.strouhal),
)
FLUME, FULL = (0.2e-3, 0.45e-3), (0.389, 0.010)  # mass per length [kg/m], diameter [m]
# cable, damping ratio, normal speed; A/d of Skop-Griffin, Sarpkaya, Govardhan-Williamson, Facchinetti; G of Vandiver
# with the mean for S-G, G-W, Facchinetti, with the antinode for S-G, G-W; Blevins for G-W
TABLE = [
    (FLUME, 0.02, 0.20, (1.37, 1.46, 0.32, 0.33), (2.28, 1.50, 1.50), (2.60, 1.62), 1.67),
    (FLUME, 0.02, 0.25, (1.35, 1.45, 0.36, 0.29), (2.27, 1.54, 1.47), (2.59, 1.67), 1.75),
    (FLUME, 0.02, 0.30, (1.34, 1.44, 0.39, 0.27), (2.26, 1.57, 1.45), (2.58, 1.71), 1.82),
    (FLUME, 0.061, 0.25, (1.11, 1.14, 0.32, 0.25), (2.12, 1.50, 1.43), (2.40, 1.63), 1.68),
    (FULL, 0.01, 0.60, (1.22, 1.30, 1.03, 0.20), (2.19, 2.06, 1.36), (2.48, 2.33), 3.15),
    (FULL, 0.01, 0.75, (1.22, 1.30, 1.06, 0.20), (2.19, 2.09, 1.36), (2.48, 2.36), 3.23),
    (FULL, 0.01, 1.10, (1.22, 1.30, 1.13, 0.20), (2.19, 2.13, 1.36), (2.48, 2.41), 3.37),
]
PRINT = 0.0071  # half of the last digit printed, and what a rounded Strouhal number leaves open
LAW = {law: LAWS.index(law) for law in StrumLaw}
VANDIVER, BLEVINS = FORMULAS.index(StrumDrag.VANDIVER), FORMULAS.index(StrumDrag.BLEVINS)


def alpha_and_re(cable, zeta, speed):
    mass, d = cable
    return (mass / (1026.0 * 0.25 * pi * d**2) + 1.0) * zeta, 1026.0 * d * speed / 1.2e-3


@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"{row[0][1]:g} m, {row[1]:g}, {row[2]:g} m/s")
def test_the_printed_table(row):
    cable, zeta, speed, (sg, sarpkaya, gw, wake), means, antinodes, blevins = row
    alpha, re = alpha_and_re(cable, zeta, speed)
    a = {law: amplitude(place, alpha, re) for law, place in LAW.items() if law is not StrumLaw.OFF}
    assert a[StrumLaw.SKOP_GRIFFIN] == pytest.approx(sg, abs=PRINT)
    assert a[StrumLaw.SARPKAYA] == pytest.approx(sarpkaya, abs=PRINT)
    assert a[StrumLaw.GOVARDHAN_WILLIAMSON] == pytest.approx(gw, abs=PRINT)
    own = facchinetti(alpha, zeta, strouhal(re))
    assert own == pytest.approx(wake, abs=PRINT)
    ours = (a[StrumLaw.SKOP_GRIFFIN], a[StrumLaw.GOVARDHAN_WILLIAMSON], own)
    assert [amplification(VANDIVER, 0, x) for x in ours] == pytest.approx(means, abs=PRINT)
    assert [amplification(VANDIVER, 1, x) for x in ours[:2]] == pytest.approx(antinodes, abs=PRINT)
    assert amplification(BLEVINS, 0, ours[1]) == pytest.approx(blevins, abs=PRINT)


@pytest.mark.parametrize("cable, zeta, speed, factor", [(FLUME, 0.02, 0.25, 1.536), (FULL, 0.01, 0.75, 2.09)])
def test_the_two_cases(cable, zeta, speed, factor):
    a = amplitude(LAW[StrumLaw.GOVARDHAN_WILLIAMSON], *alpha_and_re(cable, zeta, speed))
    assert amplification(VANDIVER, 0, a) == pytest.approx(factor, abs=0.005)


def test_an_amplitude_sets_in_smoothly_past_47():
    assert onset(20.0) == onset(47.0) == 0.0 and onset(60.0) == onset(1e4) == 1.0
    assert 0.0 < onset(47.1) < 1e-3 and onset(53.5) == pytest.approx(0.5)


def test_much_damping_stops_the_fall_of_the_fit():
    """The parabola in alpha rises again past 1.87; it is taken at 1.8 from there on, above 0."""
    law = LAW[StrumLaw.GOVARDHAN_WILLIAMSON]
    assert amplitude(law, 5.0, 5000.0) == amplitude(law, 1.8, 5000.0) < 0.1 * amplitude(law, 0.05, 5000.0)
