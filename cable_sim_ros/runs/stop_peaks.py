"""The peak after a drum came to rest under way, by brake, friction or an end stop, and that of a snap as slack cable
comes tight: what the step may miss of it; and where a drum goes that its motor renders.

A stop has two parts. A drum that comes to rest with the deceleration a has a kink in its speed, and a step h cannot
tell more of when it came than h: its speed is known to a h, and with it the tension to Z a h, Z = sqrt(EA mu) (wave
theory). And the time t in which it stops is t/h steps long: measured, 2 (h/t)^2 of the rise of the tension. The larger
counts.

So has a snap. As a quarter of a sine of the peak P, the tension rises by at most D = P w h in a step: P (w h)^2, which
is D^2/P; measured, 0.3 to 0.7 of it. And the step cannot tell more of when the cable came tight than h, of the time t
in which what hangs on it gained its speed: P h/t.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..physics.winch_drive import AT_REST, RENDER, DriveModel
from ..sim.scene import Scene
from ..sim.tables.material import extreme
from ..sim.verdict import Reason, check
from .passage import SNAPS
from .summary import tick_length

MAY_MISS = 0.02  # of the peak, as two runs of --check may differ
RINGS = 5.0  # s after a stop, in which its peak comes
PER_STEP = 2.0
NICE = (1.0, 2.0, 5.0)
MIN_TICK = 1e-4  # s, of solver.tick
LED = 1e-3  # s, of steps that lost less than 10 mm of a drum that its motor let go and took again


def nice_step(longest: float) -> float:
    """The longest of 1, 2 and 5 times a power of ten s that is no longer, and MIN_TICK or more."""
    longest = max(longest, MIN_TICK)
    decade = 10.0 ** np.floor(np.log10(longest))
    return float(max(digit * decade for digit in NICE if digit * decade <= longest * (1.0 + 1e-9)))


def stop_missed(frames: np.recarray, scene: Scene) -> tuple[Reason, ...]:
    """Reason where the largest tension of a run is that of a stop of its drum and the steps may miss more of it than
    MAY_MISS; frames: tick outputs."""
    tick, rate = tick_length(frames), frames["payout_rate"]
    if scene.drive.model is not DriveModel.MOTOR or not tick:
        return ()
    stopped = np.flatnonzero((rate[1:] == 0.0) & (np.abs(rate[:-1]) > AT_REST)) + 1
    most = int(np.argmax(frames["tension_drum_tick_max"]))
    before = stopped[(stopped <= most) & (most - stopped <= RINGS / tick)]
    if not len(before):
        return ()
    at = int(before[-1])
    free = np.diff(np.abs(rate[: at + 1])) > 0.0 if frames["brake_set"][at] == 0.0 else frames["brake_set"][:at] == 0.0
    began = int(np.flatnonzero(free)[-1]) if free.any() else 0  # the last that nothing slowed
    peak, step = float(frames["tension_drum_tick_max"][most]), tick / max(int(frames["substeps"][at]), 1)
    cable = scene.cable
    impedance = sqrt(extreme(cable, "axial_stiffness", max)[1] * extreme(cable, "mass_per_length", max)[1])
    kink = impedance * float(frames["payout_acceleration_tick_max"][at])
    rise = abs(peak - float(frames["tension_drum"][began]))
    part = step / max((at - began) * tick, step)
    missed = max(kink * step, PER_STEP * rise * part**2)
    if missed <= MAY_MISS * peak:
        return ()
    good = nice_step(step * MAY_MISS * peak / missed)
    return (
        check(
            "STOP_STEP",
            f"the drum came to rest {1e-9 * float(frames['time'][at] - frames['time'][0]) + tick:.4g} s after the "
            f"start, and steps of {1e3 * step:.3g} ms may miss {missed:.3g} N of the peak of {peak:.4g} N at the drum, "
            f"{100.0 * missed / peak:.2g} % (limit {100.0 * MAY_MISS:g} %). Steps of {good:g} s keep it: --step fixed "
            f"--every {good:g}, or solver.tick: {good:g}",
        ),
    )


def snap_missed(frames: np.recarray) -> tuple[Reason, ...]:
    """Reason where the largest tension of a run is that of a snap and the steps may miss more of it than MAY_MISS."""
    tick, high = tick_length(frames), np.fmax(frames["tension"], frames["tension_tick_max"])
    most = int(np.argmax(high))
    peak, slack = float(high[most]), np.flatnonzero(frames["tension_least"][: most + 1] < 0.0)
    if not tick or not len(slack) or (most - slack[-1]) * tick > SNAPS:
        return ()
    tight, loose = int(slack[-1]), frames["tension_least"][: int(slack[-1]) + 1] < MAY_MISS * peak
    began = 0 if loose.all() else len(loose) - int(np.argmin(loose[::-1]))
    step = tick / max(int(frames["substeps"][most]), 1)
    rise = float(np.diff(frames["tension"][tight : most + 1]).max(initial=0.0)) * step / tick
    by_rise, by_start = rise**2 / peak, peak * step / max((tight + 1 - began) * tick, step)
    if max(by_rise, by_start) <= MAY_MISS * peak:
        return ()
    good = nice_step(step * min(sqrt(MAY_MISS * peak / max(by_rise, 1e-300)), MAY_MISS * peak / by_start))
    return (
        check(
            "SNAP_STEP",
            f"the largest tension, {peak:.4g} N {1e-9 * float(frames['time'][most] - frames['time'][0]) + tick:.4g} s "
            f"after the start, is that of a snap, and steps of {1e3 * step:.3g} ms may miss "
            f"{max(by_rise, by_start):.3g} N of it, {100.0 * max(by_rise, by_start) / peak:.2g} % (limit "
            f"{100.0 * MAY_MISS:g} %). Steps of {good:g} s keep it: --step fixed --every {good:g}, or solver.tick: "
            f"{good:g}",
        ),
    )


def rendered(frames: np.recarray, scene: Scene) -> tuple[Reason, ...]:
    """Reason where the motor of a winch that renders left its largest pull and came back to it: the drum goes on with
    the speed that it has by then, so that what rings in drum and cable, and with it the step, decides on its way."""
    tick = tick_length(frames)
    if scene.drive.model is not DriveModel.MOTOR or not tick:
        return ()
    step = tick * len(frames) / max(int(frames["substeps"].sum()), 1)
    stays = (frames["winch_mode"] == RENDER) & (frames["payout_rate"] != 0.0)
    stays[1:] &= frames["motor_pull"][1:] == frames["motor_pull"][:-1]
    came = np.flatnonzero(stays[1:] & ~stays[:-1]) + 1
    if len(came) < 2 or step <= LED * (1.0 + 1e-9):
        return ()
    at = float(frames["time"][came[1]] - frames["time"][0]) * 1e-9 + tick
    text = (
        f"the motor came to drive.set_pull {len(came)} times, again {at:.4g} s after the start: where the drum goes "
        f"from then on depends on what rings in it and the cable. In tows that were measured steps chosen by "
        f"their error lost up to 0.04 m of the pay-out, fixed ones of 10 ms up to 0.3 m; these are of "
        f"{1e3 * step:.3g} ms. Take --step fixed --every {LED:g}, or compare with --check"
    )
    return (check("RENDER_PLACE", text),)
