"""What makes a run doubtful: for every health flag how long it may be set, and causes that are no flags.

The verdict (sim/verdict.py), its texts and the tables of docs/flags.md are made from RULES and CHECKS. A rule is found
by the name of its flag; one whose flag a version does not have counts for nothing.
"""

from __future__ import annotations

from typing import NamedTuple

OK, DOUBTFUL, FAILED = "ok", "doubtful", "failed"
DAMAGE = "DAMAGE"
# N/m^2 on the full circle of the diameter: steel ropes break at 800 to 1150 MPa of it (1960 MPa wire, fill 0.4 to 0.6),
# aramid and HMPE ropes at 1000 to 1250 MPa, so that beyond it no cable of that diameter is whole
MAX_STRESS = 1.2e9
WITHIN = 1e-3  # of the recorded mean tension, for a replay
WITHIN_M = 0.01  # m, for a replay
# chosen steps taken back, of those tried, and how many at least: one that fails each time it is tried again after
# step.WAIT others is 1/11 of them, events of a seaway took back up to 1/100
REFUSED_FRACTION, MIN_REFUSED = 0.05, 20
REFUSED_S, REFUSED = 2.0, 0.01  # s and share of the run for which a refused source of motion is borne
OUTSIDE_TABLE = 0.05  # share of the energy of the sea that may lie outside a table of response amplitude operators
ROUNDED = 0.08  # of the rms acceleration at the sheave, that rounded motion may leave wrong
MIN_ROUNDED = 5e-4  # m/s^2, and more than this: a tenth of a newton on a tow of 200 kg
LAYBACK_WITHIN = 0.5  # share of the time in which a measured depth is to be within the interval of the simulated one
WITHIN_JOURNAL = 1e-6  # of the tension, and m, for one that knows what every tick saw: another machine rounds otherwise

TENSION = ("tension_mean_n", "tension_std_n", "tension_min_n", "tension_max_n")
PEAKS = ("tension_std_n", "tension_min_n", "tension_max_n")
CONTACT = ("contact_resultant_mean_n", "contact_resultant_max_n", "wrap_angle_mean_deg")
PLACE = ("body_depth_m", "body_depth_std_m", "body_position_m")
ELLIPSOIDS = ("ellipsoid_volume_m3", "ellipsoid_volume_points_m3")
ATTITUDE = ("body_pitch_mean_deg", "body_pitch_std_deg", "body_roll_mean_deg", "body_roll_std_deg")
BODY = (*PLACE, "body_depth_min_m", "body_depth_max_m", "layback_min_m", "layback_max_m", *ELLIPSOIDS)
SEAWAY = ("tension_std_n", "tension_min_n", "tension_max_n", "body_depth_std_m", "sheave_heave_std_m", *ELLIPSOIDS)
WINCH = ("payout_min_m", "payout_max_m", "scope_min_m", "scope_max_m")
COMPENSATED = (*PEAKS, "body_depth_std_m", *ELLIPSOIDS, *WINCH)


class Rule(NamedTuple):
    """How much of a flag a run bears: up to ``seconds`` in all, or ``fraction`` of the run where that is longer.

    state: of a run with more of it, OK: any amount is harmless; at_end: a run that ends with it is not ok either;
    compensating: it only counts where a set-point law drives the winch; alarm: a tick with it is a warning in
    /diagnostics.
    """

    flag: str
    metrics: tuple[str, ...]
    text: str
    why: str  # these bounds
    state: str = DOUBTFUL
    seconds: float = 0.0
    fraction: float = 0.0
    at_end: bool = False
    compensating: bool = False
    alarm: bool = False


def _harmless(flag: str, text: str, why: str) -> Rule:
    return Rule(flag, (), text, why, OK, alarm=True)


RULES = (
    Rule(
        "NEWTON_FAILED",
        TENSION + BODY,
        "no solution was found and the run halted; what came shortly before is suspect too",
        "nothing was simulated after it",
        state=FAILED,
    ),
    Rule(
        "NOT_FINITE",
        TENSION + BODY,
        "a number that is not finite was found and the run halted",
        "nothing was simulated after it",
        state=FAILED,
    ),
    _harmless("HALVED", "shorter steps were needed", "they are solved to the same tolerance"),
    Rule(
        "SLACK",
        PEAKS,
        "part of the cable carried less than no tension: the least tension is that of a rod, and the snap as it comes "
        "tight depends on mesh and step. Do not design for these peaks without a finer step",
        "one snap makes the peak of a run of any length; a touch of less than 0.1 s makes none",
        seconds=0.1,
        alarm=True,
    ),
    Rule(
        "DETACHED",
        (*CONTACT, *TENSION, *BODY),
        "the cable was off its sheave or out of its groove: contact, wrap angle and line loads are not those of one in "
        "its groove, tension is that of a cable without its sheave, and the towbody hangs on another length outboard; "
        "in a turn a block that swivels keeps it (sheave.swivel)",
        "a snap lifts it for some tenths of a second; longer, it lies beside the sheave",
        seconds=0.5,
        at_end=True,
        alarm=True,
    ),
    Rule(
        "PENETRATION",
        CONTACT,
        "the cable was pressed deeper into the sheave than contact.penetration_limit: line loads are spread too wide. "
        "Tension and towbody hardly notice. Give contact.working_tension the highest tension expected",
        "1 % of the run does not show in means",
        seconds=1.0,
        fraction=0.01,
        alarm=True,
    ),
    Rule(
        "COARSE_AT_SURFACE",
        (*TENSION, *CONTACT),
        "an element too long for sheave or drum lay on it: tension ripples or jumps, contact and wrap angle are wrong. "
        "Give a finer mesh there",
        "each coming on is a jump of the tension: a peak in a run of any length",
        seconds=0.1,
        alarm=True,
    ),
    Rule(
        "MOTION_STALE",
        SEAWAY,
        "there was no motion: the ship was returned to its mean track, heave and what follows from it are too small",
        "a drop-out of 2 s, and the end of the motion before that of the node, are bridged",
        seconds=2.0,
        fraction=0.01,
    ),
    Rule(
        "MOTION_BLENDING",
        SEAWAY,
        "motion was being taken up again and again: a mixture, not that of the sea. See which source comes and goes, "
        "and whether samples come later than input_delay (sample_age_p99_ms in statistics_file): a busy machine",
        "each start, in the 20 s that the statistics leave out",
        seconds=20.0,
        fraction=0.1,
    ),
    Rule(
        "COMMAND_STALE",
        WINCH,
        "winch commands stopped: the winch held its length in place of going on as last commanded",
        "the gap of a controller that goes on is a late command",
        seconds=2.0,
        fraction=0.01,
    ),
    Rule(
        "DRUM_END",
        COMPENSATED,
        "the winch stood at an end stop: it did not go where commands and set-point sent it",
        "one heave at the end stop makes the peak of a run of any length",
        seconds=1.0,
        alarm=True,
    ),
    Rule(
        "WINCH_LIMIT",
        COMPENSATED,
        "the winch stood at a soft limit of the scene: that way there was no compensation and tension took the motion",
        "as DRUM_END; without compensation that is what the scene asks for",
        seconds=1.0,
        compensating=True,
        alarm=True,
    ),
    _harmless("SEABED", "cable or towbody lay on the seabed", "the seabed of the scene carries it"),
    Rule(
        "SLACK_ENERGY",
        (*PEAKS, *BODY),
        "slack cable gained energy that nothing gave it: what it does when it comes tight is too strong",
        "the flag has its own share of the work",
        alarm=True,
    ),
    Rule(
        "SETPOINT_LIMITED",
        COMPENSATED,
        "the set-point law asked for more than there is and was limited: this is not its compensation",
        "one heave without compensation makes the peak; 1 % of the run does not show in the rest",
        seconds=1.0,
        fraction=0.01,
        alarm=True,
    ),
    Rule(
        "COMMAND_LIMITED",
        WINCH,
        "winch commands asked for more than rate or travel allow: the winch did less than it was told",
        "a length far away is approached at the largest rate for some seconds",
        seconds=5.0,
        fraction=0.05,
    ),
    _harmless(
        "LOW_FLOW", "hardly any water flowed past the towbody: its heading was held", "no figure depends on the heading"
    ),
    Rule(
        "WINCH_SATURATED",
        COMPENSATED,
        "the winch was held to its largest rate or acceleration: it did not follow the set-point",
        "as SETPOINT_LIMITED; without compensation there is only the ramp to follow",
        seconds=1.0,
        fraction=0.01,
        compensating=True,
        alarm=True,
    ),
    Rule(
        "RINGING_DAMPED",
        PEAKS,
        "the time steps damped ringing of the tension away: deviation and peaks are too small",
        "the flag has its own share of the working tension; or once the deviation misses 2 %",
        alarm=True,
    ),
    _harmless(
        "MOTOR_LIMITED", "the motor gave all that its curve and power allow", "the drum does what such a motor does"
    ),
    _harmless("BRAKE_SLIPPED", "the drum turned against its brake", "a brake slips above what it holds"),
    Rule(
        "SURFACE_CROSSED",
        (*PEAKS, *BODY),
        "towbody or a body on the line crossed the water surface: the first blow, and water that it carries out, are "
        "left out",
        "one slam, and the snap after it, makes the peak of a run of any length",
        alarm=True,
    ),
    Rule(
        "STALLED",
        (*BODY, *ATTITUDE),
        "a wing or fin was stalled: what it bears then is known to a third at best",
        "1 % of the run does not show in the rest",
        seconds=1.0,
        fraction=0.01,
        alarm=True,
    ),
    Rule(
        "FLAP_STALE",
        (*BODY, *ATTITUDE),
        "flaps ran into their flap_timeout, and stood at flap_neutral instead of where they were commanded",
        "as COMMAND_STALE",
        seconds=2.0,
        fraction=0.01,
    ),
    Rule(
        "FLAP_LIMITED",
        (*BODY, *ATTITUDE),
        "flaps were commanded beyond their flap_range, and stood at its end",
        "a controller far from what it keeps is at the end of its range",
        seconds=5.0,
        fraction=0.05,
    ),
    Rule(
        "VEHICLE_STALE",
        (*PEAKS, *BODY),
        "no pose of the vehicle came: it went on at its mean speed, at its depth and attitude",
        "as MOTION_STALE",
        seconds=2.0,
        fraction=0.01,
        alarm=True,
    ),
    Rule(
        "VEHICLE_BLENDING",
        (*PEAKS, *BODY),
        "poses of the vehicle that jumped were taken up again and again: a mixture, not its motion. See whether its "
        "samples jump, or come later than input_delay",
        "as MOTION_BLENDING",
        seconds=20.0,
        fraction=0.1,
    ),
    Rule(
        "VEHICLE_LIMITED",
        (*TENSION, *BODY),
        "the vehicle was beyond the cable's reach or in the seabed, where the cable's end stayed behind, or pulled "
        "harder than vehicle.max_tension: no vehicle does what was asked of it",
        "one such pull makes the peak of a run of any length",
        alarm=True,
    ),
)


class Check(NamedTuple):
    """A cause that is no flag: its name, the figures concerned, what is looked at, state of a run with it."""

    name: str
    metrics: tuple[str, ...]
    text: str
    state: str = DOUBTFUL


CHECKS = (
    Check("NO_START", TENSION + BODY, "no static start was found", FAILED),
    Check("HALTED", TENSION + BODY, "the run ended early; the figures are of the part before it", FAILED),
    Check(
        "OVERLOAD",
        TENSION + CONTACT + BODY,
        f"tension above `breaking_load` of the strongest section; without it {MAX_STRESS / 1e6:g} MPa on the full "
        "circle of its diameter, which no steel or fibre rope carries",
    ),
    Check(
        "MEAN_TRACK",
        TENSION + BODY,
        "over 30 s or more the mean speed of the motion is more than 10 % and 0.2 m/s from `ship.tow_speed`, or its "
        "heading more than 10 deg from that of the start: not the tow of the scene; half of it is a warning",
    ),
    Check(
        "PITCH_SIGN",
        TENSION + BODY,
        "over 30 s or more the ship is drawn ahead as its bow goes up (correlation of acceleration and pitch below "
        "-0.4)",
    ),
    Check(
        "MESH_WAVES",
        SEAWAY,
        "cable was hauled in to a scope at which the elements are too long for the waves of the water: 1.5 times "
        "`accuracy.tension` or more",
    ),
    Check(
        "FRICTION_SLIP",
        ("winch_pull_max_n", "winch_power_max_w", "winch_power_min_w"),
        "with friction on sheave or drum the winch ran slower than 3 times `contact.slip_speed` for more than 5 % of "
        "the run: there friction acts in part, by more than 0.1 % of `contact.working_tension`",
    ),
    Check("SETPOINT_DRIFT", TENSION + WINCH, "`constant_tension`, 300 s or more: its mean pay-out drifts"),
    Check(
        "LAYBACK_DEPTH",
        ("body_depth_m", "body_position_m"),
        "`cable-sim layback`: the measured depth is within the 95 % interval of the simulated one for less than "
        f"{100.0 * LAYBACK_WITHIN:g} % of the time",
    ),
    Check(
        "MOTION_REFUSED",
        TENSION + BODY,
        f"IMU or odometry were refused for more than {REFUSED_S:g} s and {100.0 * REFUSED:g} % of the run, as their "
        "parts do not fit; not where the odometry that was used moves as the refused IMU",
    ),
    Check(
        "MOTION_ROUNDED",
        SEAWAY,
        f"rounding leaves more than {100.0 * ROUNDED:g} % of the acceleration at the sheave wrong, and "
        f"{MIN_ROUNDED:g} m/s^2",
    ),
    Check(
        "RAO_OUTSIDE",
        SEAWAY,
        f"more than {100.0 * OUTSIDE_TABLE:g} % of the energy of the sea is outside periods or headings of the table "
        "of `--rao`, whose ends are held there",
    ),
    Check(
        "RESIDUAL",
        TENSION + BODY,
        f"a replay in the recorded scene is further than {100.0 * WITHIN:g} % of the tension, or {WITHIN_M:g} m, from "
        f"what the bag recorded; with a journal {WITHIN_JOURNAL:g} of the tension, or {WITHIN_JOURNAL:g} m",
    ),
    Check("NOT_COMPARED", TENSION + BODY, "a replay of a bag that recorded nothing of the tow at its times"),
    Check(
        "SEA_GROWING",
        TENSION + BODY,
        "the figures begin before waves and turbulence have grown: the run is shorter than twice `water.ramp`",
    ),
    Check(
        "CHECK",
        (*PEAKS, *BODY, *WINCH),
        "`run --check`: with half the step and twice the elements a peak or the deviation of the tension differs by "
        "more than 2 %, or towbody or pay-out by more than accuracy.position; where they agree, `SLACK`, "
        "`SNAP_STEP`, `RINGING_DAMPED` and `RENDER_PLACE` are taken back",
    ),
    Check(
        "STEP_CONTROL",
        PEAKS + BODY,
        f"more than {100.0 * REFUSED_FRACTION:g} % of the chosen steps tried, and more than {MIN_REFUSED}, were taken "
        "back, for their error or without a solution",
    ),
    Check("STOP_STEP", PEAKS, "the peak came within 5 s of a stop of the drum: the steps may miss 2 % of it"),
    Check("SNAP_STEP", PEAKS, "the peak is that of a snap as slack cable came tight: the steps may miss 2 % of it"),
    Check(
        "RENDER_PLACE",
        (*BODY, *WINCH),
        "the motor of a winch that renders left drive.set_pull and came back to it, in steps longer than 1 ms: from "
        "then on they lose pay-out, measured 0.04 m in chosen steps, 0.3 m in steps of 10 ms",
    ),
    Check("JOURNAL", TENSION + BODY, "a replay could not do all that the journal of the recording says"),
    Check(
        "WINCH",
        WINCH,
        "`cable-sim plan`: a margin of the winch or its cable is negative, its rate or torque was saturated, or the "
        "cable went slack",
    ),
    Check("BEHIND", TENSION + BODY, "the node did not hold real time and was taken to the present"),
    Check("NOT_RECORDED", TENSION + BODY, "messages were lost on the way to the disk"),
    Check(DAMAGE, TENSION + BODY, "the bag was damaged and read in part; exit code 3"),
)
