"""Heave of the ship to heave and pitch of both bodies of `two_part`, beside an own linear calculation by frequency.

verification/linear_tow.py, written from the equations, with a rest of its own: nothing of the product's kernels is in
it. Several periods at once, a centimetre each: three times as much moves no magnitude by 1.5 %.
"""

import numpy as np
import pytest
from courses import level

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.state import NOW, Q
from verification.linear_tow import LinearTow
from verification.shipped import started

ALLOWED = 0.03  # of a magnitude; of the phase [rad] the same
RAMP = 10.0  # s
DRIFTS = 4  # powers of the time
SENT = 0.02  # s between messages of the ship
AHEAD = 0.2  # s of them that lie ahead


def product(scene, periods, amplitude, window):
    """Heave and pitch (nose up, rad) of the bodies over the heave of the ship, [periods, bodies, 2], complex, in a
    window [s] after as long a time; and x, z and pitch of each at rest."""
    sim = started(scene)
    w, speed, tick, sent = 2.0 * np.pi / periods, scene.ship.tow_speed, scene.solver.tick, 0

    def ship(t):
        share = min(t / RAMP, 1.0)
        heave, rate = amplitude * np.sin(w * t).sum(), amplitude * (w * np.cos(w * t)).sum()
        ramp, rise = share * share * (3.0 - 2.0 * share), 6.0 * share * (1.0 - share) / RAMP
        return ramp * heave, ramp * rate + rise * heave

    def stand():
        pitch = -2.0 * np.arcsin(sim.state.attitude[NOW]["quaternion"][order, 1])
        return np.column_stack((sim.state.nodes[NOW, Q][bodies[order]][:, [0, 2]], pitch))

    bodies = sim.model.line.rigid.bodies["node"]
    order, rows = np.argsort(bodies), []
    rest = stand()
    for k in range(1, round(2.0 * window / tick) + 1):
        while SENT * sent < tick * k + AHEAD:
            sent += 1
            t = SENT * sent
            z, rate = ship(t)
            sim.push(level(sent * round(SENT * 1e9), (speed * t, 0.0, z), (speed, 0.0, rate)))
        frame = sim.tick()
        rows.append([frame.ship_position[2], *stand()[:, 1:].ravel()])
    found = np.array(rows)[-round(window / tick) :]
    t = tick * np.arange(len(found))[:, None]
    drift = (t / window) ** np.arange(DRIFTS)  # the umbilical comes to rest slowly, and the heave of the fish is small
    fitted = np.linalg.lstsq(np.hstack((np.cos(w * t), np.sin(w * t), drift)), found, rcond=None)[0]
    waves = fitted[: len(w)] - 1j * fitted[len(w) : 2 * len(w)]
    return (waves[:, 1:] / waves[:, :1]).reshape(len(w), len(bodies), 2), rest


PERIODS = [4.0, 5.0, 6.0, 7.5, 10.0, 12.0, 15.0]


@pytest.mark.parametrize(
    "size, changes, periods, window",
    [
        (2.0, {}, [4.0, 5.0, 20.0 / 3.0], 20.0),
        pytest.param(0.5, {}, PERIODS, 60.0, marks=pytest.mark.nightly),
        pytest.param(0.5, {"accuracy.position": 0.003}, PERIODS, 60.0, marks=pytest.mark.nightly),
    ],
)
def test_heave_goes_from_the_ship_to_the_fish_as_a_linear_calculation_says(size, changes, periods, window):
    """And its rest is that of the product: the trim of the bodies, which the cable does not move, and their places."""
    scene, periods = load_scene("two_part"), np.array(periods)
    tow = LinearTow(scene, size)
    own = tow.transfer(periods)
    found, rest = product(override(scene, changes), periods, 0.01, window)
    for body, pitch, (x, z, trim) in zip(tow.bodies, tow.pitches, rest, strict=True):
        assert pitch == pytest.approx(trim, abs=1e-6)
        np.testing.assert_allclose(tow.places[body.node], (x, z), atol=0.1)
    size, phase = abs(found / own) - 1.0, np.angle(found / own)
    said = [f"{p:.3g} s: {abs(f).ravel()}, off {s.ravel()}" for p, f, s in zip(periods, found, size, strict=True)]
    print("\n".join(said), "\nphase, deg", np.degrees(phase).reshape(len(periods), -1).round(2))
    assert abs(size).max() < ALLOWED and abs(phase).max() < ALLOWED, said
