"""Figures of a run that are not statistics of its tick outputs (those: runs/summary.py): one row each, for JSON and
pages."""

from .summary import DEPARTURE, OF_BODIES

# JSON names beside those of runs/summary.py: name, unit, meaning
METRICS = (
    DEPARTURE,
    ("contact_resultant_n", "N", "mean resultant of the cable on the sheave, whole run"),
    (
        "bodies",
        "",
        "by the name of each body on the line: "
        + "; ".join(f"`{name}` [{unit}], {meaning}" for name, unit, meaning in OF_BODIES),
    ),
    ("ticks", "1", "ticks simulated"),
    ("steps_taken", "1", "steps taken since the static start; `steps` counts those of this run"),
    ("step_least_s", "s", "shortest step taken"),
    ("step_median_s", "s", "median of the steps taken: half of the steps are no longer"),
    ("step_largest_s", "s", "longest step taken"),
    ("steps_refused", "1", "steps taken back and halved because of their error"),
    ("steps_unsolved", "1", "steps taken back and halved because they had no solution or none that can be trusted"),
    ("step_tension_error", "1", "`solver.tension_error` that the steps were chosen to; null: a tick is one step"),
    ("step_position_error_m", "m", "`solver.position_error` that the steps were chosen to; null: a tick is one step"),
    ("compile_s", "s", "wall time of compiling, or of loading the compiled kernels"),
    ("start_s", "s", "wall time of the static start"),
    ("stepping_s", "s", "wall time of the stepping alone; `realtime_factor` is made from it"),
    ("scene", "", "name of the scene"),
    ("motion", "", "name of the bag or table, the heave, or none"),
    ("setpoint", "", "set-point algorithm"),
    ("winch_modes", "s", "time in each [mode of the winch](drive.md#modes) that was in force"),
    ("imu_only", "", "true: odometry was left out"),
    ("winch", "", "winch plan"),
    ("ship", "", "ship plan"),
    (
        "phases",
        "",
        "of a [ship plan](turns.md#plan): list of `begin_s`, `end_s`, `phase`, least, mean and largest "
        "`tension_min_n`, `tension_mean_n`, `tension_max_n`, likewise `body_depth_min_m` and `layback_min_m`, "
        "`lead_min_deg` and `lead_max_deg` (departing cable from straight astern, to port), `groove_margin_min_m`",
    ),
    ("changes", "", "live keys that `changes` of `run` gave other values, as `SECONDS KEY VALUE`"),
    ("scenario", "", "name of the scenario of faults"),
    (
        "faults",
        "",
        "`--faults`: list of `name`, `function`, `failure_mode`, `at_s`, `until_s`, `expected`, and figures `found` "
        "from then to 30 s after the fault is mended, `before` in the 30 s before it",
    ),
    ("controller", "", "controller given to `run` in Python: `period_s`, `calls`, `commands`, `limited` (counts)"),
    ("motion_refused", "1", "motion messages refused or bridged, by cause"),
    ("vehicle_refused", "1", "poses of a vehicle refused, by cause"),
    ("commands_refused", "1", "winch commands refused, by cause"),
    ("commands_limited", "1", "winch commands that asked for more than the winch can do, by what was limited"),
    ("clock_jumps", "1", "jumps of the clock of the motion, over which the tow was carried"),
    (
        "motion_rounded",
        "",
        "rounded columns of a table, or coordinates of a bag, that were smoothed: list of `column`, `resolution` and "
        "`unit`, `cutoff_hz`, and the rms accelerations in m/s^2 or rad/s^2 `acceleration_rounded` as rounded, "
        "`acceleration_left` wrong, `acceleration_motion`",
    ),
    (
        "rao",
        "",
        "motion by `--rao`: `source`, its `period_s` and `heading_deg` (or the numbers of the simple hull, with "
        "`chosen`), `notes`, `outside`, `overtaken` (shares of the energy of the sea outside the table, and of waves "
        "that the ship overtakes), `deviations` (standard deviations in the grown sea, m and deg)",
    ),
    (
        "imported",
        "",
        "motion of an [imported](mapping.md) bag: `files`, `records`, `lost`, `mappings`, `motion` (odometry, imu), "
        "`given` (signals it is of), `track`, `notes` (what was assumed, is missing, was lost)",
    ),
    (
        "rules",
        "",
        "rules on watch: `set`, `broken` (names), `rules` (list of `rule`, `unit`, `sense`, `limit`, `broken`, "
        "`first_s`, `first_ns`, `seconds`, `times`, `worst`, `worst_s`), `not_watched` (`rule`, `why`), "
        "`cycles` of tension and bending; see [rules](rules.md)",
    ),
    ("notices", "", "what is odd about the bag and its motion, as texts"),
    ("journal", "", "`replay`: true: the bag says what the run took and when, so that this is the same run"),
    ("replay_faults", "", "`replay`: why this may not be the run that was recorded, as texts"),
    ("residuals", "", "`replay`: list of channel, quantity, unit, mean, rms, largest, count; ours less recorded"),
    ("largest_difference", "", "`replay`: largest difference of any field of `sim/health` over the common ticks"),
    ("comparison", "", "`replay --limits`: what the bag recorded against the replay, as of [compare](#compare)"),
    ("recorded_ticks", "1", "`replay`: ticks that the bag has in `sim/health`; `ticks` were simulated again"),
    ("node", "", "`live`: figures of the node, as in its statistics file"),
    ("saved", "", "file with the state at the end"),
    ("resumed", "", "`--from`: `file`, `time_s` of its state, `motion`: goes on, or taken up anew"),
    (
        "check",
        "",
        "`--check`: `agreed`, of tension and its peaks [this run, with half the step and twice the elements], and how "
        "far apart the two are at most, `body_moved_m` and `payout_moved_m`",
    ),
    ("problem", "", "why the run ended early"),
    (
        "verdict",
        "",
        "`state` (ok, doubtful, failed) and `reasons`: list of `flag`, `seconds` in all, `share` of the run, `figures` "
        "concerned, `text`; see [flags](flags.md#verdict); `notes` of motion by `--rao` and of imports. Of a replay "
        "with a journal: whether it is the run that was recorded",
    ),
    ("run_verdict", "", "`replay`: the verdict on that run itself, of the same form"),
)
