"""Health of the solver, the energy balance, and every figure of the run."""

from __future__ import annotations

import numpy as np

from ...physics.tick_output import Flag
from ...plots.strips import WIDTH, Line, Strip, bars, strips, svg
from ...runs.metrics import METRICS
from ...runs.summary import OUTSIDE, SUMMARY, format_value
from ...sim.flag_rules import RULES
from .subject import Figure, Section, Subject, Table, Text, number, share, unit

TERMS = (  # field, name, what it is
    ("work_supplied", "work of winch and ship", "work of winch and hull on the end of the cable"),
    ("work_water", "work of the water", "drag, buoyancy, added mass, lift"),
    ("work_contact", "work of the contacts", "of drum, sheave and seabed, less the heat of their friction"),
    ("kinetic_energy", "change of kinetic energy", "of cable, bodies and terminations"),
    ("strain_energy", "change of strain energy", "axial and bending"),
    ("potential_energy", "change of potential energy", "of weight less buoyancy"),
    ("dissipated", "lost in the cable", "energy lost in the material of the cable"),
    ("energy_residual", "residual of the balance", "stored plus lost, less work: the error of the integration"),
)


def solver(subject: Subject) -> Section:
    """Flags, steps and iterations."""
    metrics, frames = subject.metrics, subject.frames
    found = Section("health", "Health of the solver")
    state = {rule.flag: rule.state for rule in RULES}
    flags = []
    for name, count in (metrics.get("flags") or {}).items():
        if name in Flag.__members__:
            often = str(count), number(count * subject.tick, 4), share(count / len(frames))
            flags.append((name, *often, state.get(name, "ok"), Flag[name].text))
    if flags:
        head = ("flag", "ticks", "time [s]", "share", "too much of it is", "meaning")
        found.parts.append(Table("Ticks in which something was flagged", head, flags, right=(1, 2, 3)))
    else:
        found.parts.append(Text(["No tick was flagged."]))
    rows = [
        ("time steps of the integrator", number(metrics.get("steps"))),
        ("Newton iterations", number(metrics.get("iterations"))),
        ("iterations a step", number(_ratio(metrics.get("iterations"), metrics.get("steps")), 3)),
        ("largest residual left by a step [N]", number(float(np.nanmax(frames["residual"])), 3)),
        ("deepest penetration of drum and sheave [mm]", number(1e3 * float(np.nanmax(frames["penetration"])), 3)),
    ]
    for name, what in (
        ("steps_refused", "steps taken back for their error"),
        ("steps_unsolved", "steps taken back without a solution"),
    ):
        if name in metrics:
            rows.append((what, number(metrics[name])))
    if subject.live:
        known = {name: (unit_, text) for name, unit_, text in SUMMARY}
        for name in OUTSIDE:
            if metrics.get(name) is not None:
                unit_, text = known[name]
                rows.append((f"{text} [{unit_}]" if unit(unit_) else text, number(metrics[name])))
    found.parts.append(Table("Solver", ("what", "value"), rows, right=(1,)))
    return found


def _ratio(one: float | None, other: float | None) -> float | None:
    return None if one is None or other is None else one / max(other, 1)


def energy(subject: Subject) -> Section | None:
    """The account of energy over the run; None where the recording has none."""
    frames = subject.frames
    changes = [float(frames[name][-1] - frames[name][0]) for name, *_ in TERMS]
    if len(frames) < 2 or not np.isfinite(changes).all():
        return None
    through = max(abs(changes[k]) for k in range(3))
    error = float(np.abs(frames["energy_residual"] - frames["energy_residual"][0]).max())
    size = f"{share(error / through)} of the largest work" if through > 0.0 else "nothing else was done"
    words = f"The balance misses at most {number(error, 3)} J in the run, {size}."
    scale, name = (1e-3, "kJ") if through >= 1e3 else (1.0, "J") if through >= 1.0 else (1e3, "mJ")

    span, labels = "end of the run less its begin", [label for _, label, _ in TERMS]

    def draw(figure):
        bars(figure.subplots(), labels, [scale * value for value in changes], f"energy [{name}], {span}")

    drawn = Figure(svg("energy", (WIDTH, 3.0), draw), f"Where the energy came from and went. {words}", words)
    rows = [(label, number(value, 4), what) for (_, label, what), value in zip(TERMS, changes)]
    terms = Table(f"Terms of the balance, {span}", ("term", "energy [J]", "meaning"), rows, right=(1,))
    return Section("energy", "Energy balance", [drawn, terms])


def figures(subject: Subject) -> Section:
    """Every figure of the summary by its name in the JSON."""
    metrics = subject.metrics
    left_out = () if subject.live else OUTSIDE
    rows, names = [], []
    for name, what, meaning in (*SUMMARY, *METRICS[:2]):
        value = metrics.get(name)
        if value is None or name in left_out:
            continue
        rows.append((meaning.replace("`", ""), format_value(value), unit(what), name))
        names.append(name)
    head = ("figure", "value", "unit", "name in the JSON")
    return Section("figures", "All figures", [Table("Figures of the run", head, rows, right=(1,), names=names)])


def halted(subject: Subject) -> Section:
    """The last seconds before a run that ended early."""
    found = Section("end", "The last seconds before the end")
    frames = subject.frames[-max(2, round(10.0 / (subject.tick or 0.1))) :]
    time = (frames["time"] - subject.frames["time"][0]) * 1e-9
    rows = (
        Strip(
            "Largest and least tension along the cable",
            "tension [N]",
            (Line(frames["tension_most"], "largest"), Line(frames["tension_least"], "least")),
        ),
        Strip("Time steps of a tick", "steps", (Line(frames["substeps"].astype(float)),), 1.0),
    )

    def draw(figure):
        strips(figure, time, rows, 0.0)
        figure.axes[-1].set_xlim(float(time[0]), max(float(time[-1]), float(time[0]) + 1e-3))

    words = f"The last tick output is at {number(float(time[-1]), 5)} s."
    found.parts.append(Figure(svg("end", (WIDTH, 3.4), draw), words, words))
    return found
