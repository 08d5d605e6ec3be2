"""Checks of a run by means and deviations over it: a run has them from its tick outputs, a node from running sums."""

from __future__ import annotations

import numpy as np

from ...physics.heave_compensation import SetpointLaw
from ...physics.water import WaveKind
from ..flag_rules import RULES
from ..layout import layout_of
from ..scene import Scene
from ..verdict import Reason, check
from .mesh_motion_checks import WAVES_BEYOND

SKIP = 20.0  # s at the start, which figures leave out: the motion is taken up there
# correlation of surge and pitch; of any half minute of the two records it is +0.30 or more, of two minutes +0.46
AGAINST = -0.4
PITCHED_OVER = 30.0  # s, at least
LONG_ENOUGH, DRIFT, SWINGS = 300.0, 0.05, 0.5  # s of a run; m of a drift, and of the deviation of the pay-out, at least
# deg, and m/s^2: less pitch or surge than that says nothing, as of a table without one of them
MIN_PITCH, MIN_SURGE = 0.05, 0.003
# of the deviation, and of the mean tension: ringing that the steps damped away below that is no reason
DAMPED, SEEN = 0.02, 1e-3


def pitch_against(pitch: float, surge: float, agree: float) -> tuple[Reason, ...]:
    """Reason where the pitch goes against the surge. pitch, surge: standard deviations, deg and m/s^2; agree: their
    correlation."""
    if not (pitch > MIN_PITCH and surge > MIN_SURGE and agree < AGAINST):
        return ()
    return (
        check(
            "PITCH_SIGN",
            f"the ship is drawn ahead as its bow goes up: acceleration ahead and pitch have a correlation of "
            f"{agree:.2f}, recorded ships +0.6 to +0.9. Pitch is positive bow down here (x forward, y to port, z "
            "up); most sensors count bow up. Change the sign of the pitch, or leave it where the motion is made up",
        ),
    )


def deviation_damped(mean: float, there: float, lost: float) -> tuple[Reason, ...]:
    """Reason where the ringing that the steps damped away would show in the deviation, though in no peak.

    mean: of the tension, N; there, lost: variances of the tension and of that ringing, N^2.
    """
    minimum = SEEN * abs(mean)
    if not (lost > ((1.0 + DAMPED) ** 2 - 1.0) * there and lost > minimum * minimum):
        return ()
    rule = next(rule for rule in RULES if rule.flag == "RINGING_DAMPED")
    return (Reason(rule.flag, 0.0, 0.0, rule.metrics, rule.text),)


def drifting(scene: Scene, seconds: float, payout: np.ndarray) -> tuple[Reason, ...]:
    """Reason where constant_tension pays out, or hauls in, more and more; seconds: of the run, payout [ticks], m."""
    if scene.setpoint.algorithm is not SetpointLaw.CONSTANT_TENSION or seconds < LONG_ENOUGH:
        return ()
    _, *quarters = np.array_split(payout, 4)
    before, after = np.diff([quarter.mean() for quarter in quarters])
    place = np.linspace(-1.0, 1.0, len(quarters[-1]))
    swings = np.std(quarters[-1] - place * ((place * quarters[-1]).sum() / (place * place).sum()))
    if before * after <= 0.0 or abs(after) < abs(before) or abs(after) <= max(DRIFT, SWINGS * swings):
        return ()
    way = "paid out" if after > 0.0 else "hauled in"
    return (
        check(
            "SETPOINT_DRIFT",
            f"constant_tension {way} {abs(before):.3g} m and then {abs(after):.3g} m in quarters of the run, of "
            f"{0.25 * seconds:.4g} s each: it does not come to a length, and the mean tension goes with it. Give a "
            "shorter setpoint.tension_return_time, or less setpoint.tension_gain",
        ),
    )


def hauled_into_waves(scene: Scene, minimum: float) -> tuple[Reason, ...]:
    """Reason where cable was hauled in to a scope of ``minimum`` [m] at which the elements are too long for the waves
    of the water: the mesh is made for them from the scope of the start on."""
    layout = layout_of(scene)
    start = layout.route.scope
    plan = layout.plan if scene.water.waves.kind is not WaveKind.OFF and minimum < start else None
    rows = () if plan is None else sorted((row.scope, row.tension) for row in plan.expected if np.isfinite(row.tension))
    if not rows:
        return ()
    worst = max((error for scope, error in rows if minimum <= scope < start), default=0.0)
    worst = max(worst, float(np.interp(minimum, *np.array(rows).T)))
    if worst <= WAVES_BEYOND * scene.accuracy.tension:
        return ()
    return (
        check(
            "MESH_WAVES",
            f"cable was hauled in from a scope of {start:.4g} m to {minimum:.4g} m, where the elements are too long "
            f"for waves of {scene.water.waves.period:g} s: the deviation of the tension is expected to err by "
            f"{100.0 * worst:.2g} % of itself there, accuracy.tension = {scene.accuracy.tension:g} is not kept. Start "
            f"with the shorter scope, or run with --check",
        ),
    )
