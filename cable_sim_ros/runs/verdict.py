"""Verdict on the tick outputs of a run, and on a replay beside its recording. States and bounds: sim/verdict.py.

The peak after a drum came to rest under way, by brake, friction or an end stop, and that of a snap as slack cable
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

from collections.abc import Iterable, Sequence
from math import sqrt

import numpy as np

from ..io.sources.recorded_tow import Residual, SameTicks
from ..physics.tick_output import Flag
from ..physics.winch_drive import AT_REST, RENDER, DriveModel
from ..sim.checks.deviation_checks import SKIP, deviation_damped, drifting, hauled_into_waves
from ..sim.checks.friction_checks import in_part, slow
from ..sim.flag_rules import WITHIN, WITHIN_JOURNAL, WITHIN_M
from ..sim.layout import layout_of
from ..sim.scene import Scene
from ..sim.statics.route import DRUM_RESERVE
from ..sim.tables.material import extreme
from ..sim.verdict import Reason, Verdict, check, judge_counts, overload, strength, verdict_of
from .passage import SNAPS
from .summary import after_start, tick_length

MAY_MISS = 0.02  # of the peak, as two runs of --check may differ
RINGS = 5.0  # s after a stop, in which its peak comes
PER_STEP = 2.0
NICE = (1.0, 2.0, 5.0)
MIN_TICK = 1e-4  # s, of solver.tick
LED = 1e-3  # s, of steps that lost less than 10 mm of a drum that its motor let go and took again

ENDING = 5.0  # s
KEPT = 0.02  # of its energy, what steps that keep a ringing may take of it
AT_END = 1e-3  # m, of the cable that stays on the drum


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


def judge(frames: np.recarray, scene: Scene | None = None, others: Iterable[Reason] = (), problem: str = "") -> Verdict:
    """Verdict on the tick outputs of a run; scene: None where it is not known; problem: why it ended early."""
    if not len(frames):
        return verdict_of([*([check("HALTED", problem)] if problem else []), *others])
    status, counts = np.unique(frames["status"], return_counts=True)
    tick = tick_length(frames) or (0.0 if scene is None else scene.solver.tick)
    maximum = frames["tension_most"]
    over: tuple[Reason, ...] = ()
    if scene is not None:
        fraction = float(np.mean(maximum > strength(scene)))
        over = overload(scene, float(maximum.max()), fraction * len(maximum) * tick, fraction)
        over += hauled_into_waves(scene, float(frames["scope"].min()))
        if (frames["command_age"] < 0.0).all():
            over += drifting(scene, len(frames) * tick, frames["payout"])
        over += stop_missed(frames, scene) + snap_missed(frames) + rendered(frames, scene)
        over += in_part(scene, float(np.mean(np.abs(frames["payout_rate"]) < slow(scene))))
    found = judge_counts(
        dict(zip(map(int, status), map(int, counts))),
        tick,
        int(frames["status"][-1]),
        scene=scene,
        others=(*over, *others),
        problem=problem,
        slam=float(np.nanmax(frames["slam_estimate"], initial=0.0)),
    )
    if not any(reason.flag == "RINGING_DAMPED" for reason in found.reasons):
        found = verdict_of([*found.reasons, *_deviation_damped(frames)])
    return found._replace(reasons=tuple(_with_numbers(reason, frames, scene) for reason in found.reasons))


def began(frames: np.recarray, scene: Scene | None) -> tuple[str, ...]:
    """Notes on a run that began with something on the seabed, or in the water surface."""
    if scene is None or not len(frames):
        return ()
    first, found = frames[0], list[str]()
    height = float(first["body_position"][2])
    if first["status"] & Flag.SEABED and scene.seabed.depth is not None:
        found.append(
            f"the run began on the seabed, with {first['seabed_length']:.3g} m of cable on it and the towbody "
            f"{scene.seabed.depth + height:.3g} m over seabed.depth = {scene.seabed.depth:g} m"
        )
    if first["status"] & Flag.SURFACE_CROSSED:
        found.append(
            f"the run began with a body in the water surface, the towbody {abs(height):.3g} m "
            f"{'over' if height > 0.0 else 'under'} its mean: what it weighs there, and so the tension, hangs on "
            f"winch.scope = {scene.winch.scope:g} m to the centimetre"
        )
    return tuple(found)


def played(frames: np.recarray) -> np.recarray:
    """Tick outputs of a live run without those at its end, ENDING at most, that had no motion as the player had
    ended."""
    stale = frames["status"] & Flag.MOTION_STALE != 0
    maximum = round(ENDING / (tick_length(frames) or 1.0))
    trailing = len(stale) if stale.all() else int(np.argmin(stale[::-1]))
    if not 0 < trailing <= maximum or trailing == len(frames):
        return frames
    return frames[: len(frames) - trailing].view(np.recarray)


def differences(rows: Sequence[Residual], tension: float, journal: bool = False) -> tuple[Reason, ...]:
    """Reasons where a replay is too far from its recording; tension: the recorded mean, or ours [N]; journal: the bag
    says what every tick saw."""
    fraction, metres = (WITHIN_JOURNAL, WITHIN_JOURNAL) if journal else (WITHIN, WITHIN_M)
    limits, found = {"N": fraction * abs(tension), "m": metres}, []
    for row in rows:
        limit = limits.get(row.unit)
        if limit is not None and row.largest > limit:
            found.append(
                f"{row.quantity} of {row.channel} by up to {row.largest:.3g} {row.unit} (limit {limit:.3g} {row.unit})"
            )
    if not found:
        return ()
    return (check("RESIDUAL", f"this replay is not the recorded run: it differs in {'; '.join(found)}"),)


def uncompared(ours: np.recarray, theirs: np.recarray | None, same: SameTicks) -> list[str]:
    """What of a run and its replay could not be compared tick by tick, as a text; ours: simulated, theirs: recorded."""
    if theirs is None:
        return []
    at = same.of("sim_health", theirs["time"])
    compared = len(np.unique(at[at >= 0]))
    if compared == len(theirs) == len(ours):
        return []
    return [
        f"{len(theirs)} ticks are in the bag and {len(ours)} were simulated, of which {compared} are the same and "
        f"could be compared"
    ]


def _with_numbers(reason: Reason, frames: np.recarray, scene: Scene | None) -> Reason:
    """The reason with what the tick outputs say of it."""
    if reason.flag == "SLACK" and frames["tension"].min() < 0.0:
        text = f"tension at the sheave went down to {frames['tension'].min():.4g} N, a push. "
        return reason._replace(text=f"{reason.text}; {text}".rstrip(". "))
    if reason.flag == "WINCH_SATURATED":
        return reason._replace(text=f"{reason.text}; {_saturated(frames)}")
    if reason.flag == "RINGING_DAMPED":
        return reason._replace(text=f"{reason.text}; {_damped(frames)}")
    if reason.flag == "DRUM_END" and scene is not None:
        return reason._replace(text=f"{reason.text}; {_which_end(frames, scene)}")
    return reason


def _saturated(frames: np.recarray) -> str:
    """How much of the time which limit held the winch, and how far it was behind."""
    fractions = [float(np.nanmean(frames[f"{name}_limited"])) for name in ("rate", "acceleration")]
    behind = float(np.abs(frames["payout_setpoint"] - frames["payout"]).max())
    return (
        f"winch.max_rate held it {100.0 * fractions[0]:.3g} % of the run and winch.max_acceleration "
        f"{100.0 * fractions[1]:.3g} %, it was up to {behind:.3g} m behind"
    )


def _ringing(frames: np.recarray) -> tuple[np.recarray, float, float]:
    """Tick outputs after the start-up, variance of their tension and of the ringing that the steps damped away
    [N^2]."""
    kept, _ = after_start(frames, SKIP)
    lost = np.nan_to_num(kept["tension_damped"])
    return kept, float(kept["tension"].var()), 0.5 * float(np.mean(lost**2))


def _deviation_damped(frames: np.recarray) -> tuple[Reason, ...]:
    """Reason where the ringing that the steps damped away would show in the deviation, though in no peak."""
    kept, there, lost = _ringing(frames)
    return deviation_damped(float(kept["tension"].mean()), there, lost)


def _damped(frames: np.recarray) -> str:
    """What is missing, and the step that would keep it: numerical damping goes with the third power of the step."""
    kept, there, lost = _ringing(frames)
    lengths = kept["tension_damped"] ** 2
    step = tick_length(frames) * float(np.sum(lengths / np.maximum(kept["substeps"], 1)) / max(lengths.sum(), 1e-300))
    good = step * min((KEPT * there / max(lost, 1e-300)) ** (1.0 / 3.0), KEPT ** (1.0 / 3.0))
    nice = nice_step(good)
    return (
        f"{np.sqrt(lost):.3g} N rms or more beside a deviation of {np.sqrt(there):.4g} N, up to "
        f"{np.nanmax(frames['tension_damped']):.3g} N of a peak, by steps of {step:.2g} s. Steps of {nice:g} s keep "
        f"it: --step fixed --every {nice:g}, or solver.tick: {nice:g}"
    )


def _which_end(frames: np.recarray, scene: Scene) -> str:
    """Which end stop it was: at one end only what always stays is on the drum."""
    stays = scene.winch.dead_length + DRUM_RESERVE * layout_of(scene).route.drum
    left = frames["cable_on_drum"][frames["status"] & Flag.DRUM_END != 0]
    out = bool(np.any(left < stays + AT_END))
    back = bool(np.any(left >= stays + AT_END))
    ends = ["paying out, the drum was empty but for what stays on it"] * out
    ends += ["hauling in, what hangs on the line had come to the sheave"] * back
    return " and ".join(ends)
