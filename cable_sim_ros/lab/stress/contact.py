"""N3, N4, N18: the cable on its sheave: coming off, returning, climbing out, pressing in."""

from __future__ import annotations

import numpy as np

from ...physics.inputs import push_motion
from ...physics.surface import LATERAL, SLOPE_COS, SLOPE_SIN
from ...sim.frame import CONTACT_COLUMNS, Flag
from ...sim.simulator import SolverError
from ..bend import drum
from ..cases import Fidelity
from ..cases.slack import stride
from ..rig import FOLDING, Rig, cable_of
from ..stations import FORCE, POINTS, WEIGHT, touched
from .registry import IS, LEAST, WITHIN, Figure, Found, stress
from .snap import values
from .tows import Sea, held, sail, started

WINDOW = 0.020  # s after an event
WALL = 30.0  # deg, half of the shipped throat angle


def _momentum(rig: Rig, masses: float) -> float:
    """Vertical momentum of the cable and its two end masses [N s]."""
    size, u, w = np.diff(rig.arc), rig.line.v[:, 2], rig.line.v[:, 5]
    cable = 0.5 * (u[:-1] + u[1:]) * size + (w[:-1] - w[1:]) * size**2 / 12.0
    return float(rig.cable.mass_per_length * cable.sum() + masses * (u[0] + u[-1]))


@stress(
    "N3",
    "detach and return, 1000 random load reversals",
    "contact never pulls; <= 2 toggles within 20 ms of an event; impulse = momentum change within 2 %",
)
def reversals(quick: bool) -> Found:
    """A cable across a drum, its ends weighted and led upright, is pulled off and pressed on by random loads."""
    rng, step, mass, n = np.random.default_rng(3), 5e-4, 2.0, 6
    count = 60 if quick else 1000
    rig = Rig(
        cable_of(
            [{"length": 0.6, "elements": n}],
            mass_per_length=0.389,
            axial_stiffness=6.786e6,
            bending_stiffness=1.4,
            axial_damping=310.0,
            bending_damping=6.4e-5,
            compression_share=FOLDING,
        ),
        held={},
        tension=200.0,
        bodies={0: mass, n: mass},
        surfaces=[drum(0.255, 4000.0, penetration=1e-3 / 0.255)],
        loads=[np.zeros(7), np.eye(7)[0] * n],
    )
    guide = np.zeros((n + 1, 6))
    guide[[0, -1], :2] = 1.0  # ends run in upright guides
    guide.setflags(write=False)
    rig.line = rig.line._replace(held=guide)
    rig.place(
        np.column_stack((rig.arc - 0.3, 0.0 * rig.arc, 0.0 * rig.arc + 0.2549)), np.tile((1.0, 0.0, 0.0), (n + 1, 1))
    )
    rig.line.loads[:, 3] = -40.0
    rig.settle()
    weight = 9.81 * (2.0 * mass + 0.389 * 0.6)
    table = np.zeros((POINTS * n, 11))
    pulls, impulses, changes, finite = 0.0, [], [], True
    before = _momentum(rig, mass)
    for i in range(count):
        up = i % 2 == 0
        load = weight * rng.uniform(0.55, 0.9) if up else -weight * rng.uniform(0.1, 2.0)
        seconds = rng.uniform(0.02, 0.06) if up else rng.uniform(0.1, 0.3)
        rig.line.loads[:, 3] = load
        steps, force = round(seconds / step), 0.0
        for _ in range(steps):
            stride(rig, step)
            touched(rig.arc, rig.line.q, rig.line.v, rig.line.surfaces[0], table)
            press = float(table[:, WEIGHT] @ table[:, FORCE + 2])
            force += press
            pulls = min(pulls, float(table[:, 3:5].min()))
        # what the contact gave over the time of this load, against what the momentum wants
        after = _momentum(rig, mass)
        impulses.append(step * force)
        changes.append(after - before - (2.0 * load - weight) * step * steps)
        before = after
        finite = finite and bool(np.isfinite(rig.line.q).all() and np.isfinite(rig.line.tension).all())
    impulses, changes = np.array(impulses), np.array(changes)
    pressed = np.array([a + b for a, b in zip(impulses[::2], impulses[1::2])])  # one detachment and return
    wanted = np.array([a + b for a, b in zip(changes[::2], changes[1::2])])
    off = np.abs(pressed - wanted) / np.maximum(np.abs(wanted), 0.1 * np.median(np.abs(wanted)))
    worst, offs, back, told = _jerked(12 if quick else 200, rng)
    return Found(
        [
            Figure("bench, least line load of a flank", pulls, "N/m", 0.0, LEAST),
            Figure(
                "bench, impulse against momentum change, all",
                float(impulses.sum() / changes.sum() - 1.0),
                "",
                0.02,
                WITHIN,
            ),
            Figure(
                "bench, impulse against momentum change, worst of one detachment and return", float(off.max()), "", 0.02
            ),
            Figure("bench, numbers finite", finite, "", True, IS),
            Figure("tow, most toggles within 20 ms of an event", worst, "", 2),
            Figure("tow, back on the sheave at the end", back, "", True, IS),
            Figure("tow, detachments", offs),
        ],
        [
            f"bench: {count} reversals at {1e3 * step:g} ms on two masses of {mass:g} kg, drum of 0.25 m, the shipped "
            "contact (1 mm at 4 kN, D = 0.3)",
            "tow: the shipped one, 2 ms ticks, its ship thrown up and down with random accelerations up to 25 m/s^2; "
            "an event: a change of the flag DETACHED after 20 ms without one",
            *told,
        ],
    )


def _jerked(pairs: int, rng) -> tuple[int, int, bool, list[str]]:
    """A tow whose ship is thrown: (most toggles in a window, detachments, seated at the end, notes)."""
    scene = held(solver__tick=0.002)
    sim = started(scene)
    speed, up = scene.ship.tow_speed, scene.ship.reference_height

    def push(t: float, z: float, v: float) -> None:
        push_motion(sim.inputs, round(t * 1e9), [speed * t, 0, up + z, 0, 0, 0, speed, 0, v, 0, 0, 0, 1, 1])

    for t in range(13):
        push(float(t), 0.0, 0.0)
    frames, notes = [sim.run(5500)], []  # the start's blend is over after 10 s
    t, z, v = 12.0, 0.0, 0.0
    try:
        for i in range(2 * pairs):
            # constant acceleration between samples is what the ship's cubics follow exactly; each pair ends at rest
            first = i % 2 == 0
            seconds = rng.uniform(0.05, 0.2)
            a = -np.sign(z or 1.0) * rng.uniform(5.0, 25.0) if first else -v / seconds
            t, z, v = t + seconds, z + v * seconds + 0.5 * a * seconds**2, v + a * seconds
            push(t, z, v)
            frames.append(sim.run(max(int((t - 0.5) * 500) - int(sim.state.time[2]), 1)))
    except SolverError as error:
        notes.append(f"tow: {error}")
    flags = np.concatenate([f.status for f in frames]) & Flag.DETACHED > 0
    changed = 0.002 * (np.flatnonzero(flags[1:] != flags[:-1]) + 1)
    worst, event, within = 0, -1.0, 0
    for at in changed:
        if at - event > WINDOW:
            event, within = at, 0
        within += 1
        worst = max(worst, within)
    return worst, int(sim.frame.detachments), not bool(flags[-1]) and not notes, notes


@stress(
    "N4",
    "groove climb-out: fleet angle, heel +-70 deg",
    "threshold within 2 deg; latched flag in the next Frame; the cable never passes through the sheave",
)
def climb(quick: bool) -> Found:
    """A slack cable in a groove that heels; a tow whose ship slowly rolls to 70 deg and back, at rest and under way."""
    heel = "heel angle at climb-out, zero tension"
    got, notes = values(
        "climb",
        {
            "groove_half_angle_deg": WALL,
            "mass_per_length_kg_m": 0.389,
            "radius_to_centreline_m": 0.255,
            "tension_N": 0.0,
            "g": 9.81,
        },
        {heel: 0.01},
        Fidelity.REALTIME if quick else Fidelity.VERIFICATION,
    )
    figures = [
        Figure(
            "heel at climb-out of a slack cable against 90 deg less the half angle",
            None if got[heel] is None else got[heel] - (90.0 - WALL),
            "deg",
            2.0,
            WITHIN,
        )
    ]
    notes = notes[1:]
    roll, yaw, quick_roll = (
        {"roll": (np.radians(70.0), 80.0, 0.0)},
        {"yaw": (np.radians(60.0), 80.0, 0.0)},
        {"roll": (np.radians(-70.0), 16.0, 0.0)},
    )
    for name, speed, sea in (
        ("towed, heel to 70 deg in 20 s", 2.2, roll),
        ("hanging, heel to 70 deg in 20 s", 0.0, roll),
        ("towed, fleet angle to 60 deg in 20 s", 2.2, yaw),
        ("towed, heel to -70 deg in 4 s", 2.2, quick_roll),
    )[: 3 if quick else 4]:
        found, told = _heeled(speed, sea)
        figures += [f._replace(name=f"{name}: {f.name}") for f in found]
        notes += [f"{name}: {note}" for note in told]
    return Found(figures, notes)


def _heeled(speed: float, waves: dict) -> tuple[list[Figure], list[str]]:
    scene = held(ship__tow_speed=speed)
    sim, sea = started(scene), Sea(scene, **waves)
    surface, depth = sim.model.surfaces[sim.model.sheave], sim.model.groove_depth
    x, y, z, gap = (next(i for i, (n, _) in enumerate(CONTACT_COLUMNS) if n == c) for c in ("x", "y", "z", "gap"))
    missed, unlatched, through, out_at, last, notes = 0, 0, 0.0, None, 0, []
    try:
        for _ in range(80):  # 40 s: up and back, or more
            frames = sail(sim, sea, 0.5)
            tables = sim.chunk_tables[1]
            for i, f in enumerate(frames):
                rows = tables[i, : int(f.contact_stations)]
                flagged = bool(int(f.status) & Flag.DETACHED)
                out = f.groove_margin <= 0.0 or f.contact_total <= 0.0
                missed += bool(out and not flagged)
                unlatched += int(f.detachments) < last
                last = max(last, int(f.detachments))
                missed += bool(out and last == 0)
                if out and out_at is None:
                    angle = np.abs(2.0 * np.arcsin(f.ship_quaternion[:3])).max()
                    out_at = (f.time * 1e-9, float(np.degrees(angle)))
                # between the flanks, below where they fade: what is pressed into them
                inside = (np.abs(rows[:, y]) < surface[LATERAL]) & (rows[:, gap] < 0.5 * depth)
                rows = rows[inside]
                if len(rows):
                    into = np.abs(rows[:, y]) * surface[SLOPE_COS] - rows[:, gap] * surface[SLOPE_SIN]
                    through = max(through, float(into.max()))
    except SolverError as error:
        notes.append(str(error))
    figures = [
        Figure("Frames out of the groove without flag or event", missed, "", 0),
        Figure("events taken back", unlatched, "", 0),
        Figure("deepest into a flank or the root, over the diameter", through / scene.cable.diameter, "", 1.0),
        Figure("ran to its end", not notes, "", True, IS),
    ]
    notes.append(
        "stayed in the groove"
        if out_at is None
        else f"out of the groove after {out_at[0]:.1f} s at {out_at[1]:.1f} deg of the ship"
    )
    return figures, notes


@stress("N18", "highest tension, least wrap", "penetration <= 0.1 diameter")
def pressed(quick: bool) -> Found:
    """Static tows at the tension the contact is made for and above, the sheave raised until the cable hardly bends."""
    figures, notes = [], []
    for speed, rise in ((2.2, 0.6), (2.6, 0.6), (2.6, -0.6), (2.6, -1.0), (2.6, -1.4), (2.6, 2.0))[: 3 if quick else 6]:
        scene = held(ship__tow_speed=speed, sheave__position=[-36.8, 0.0, 3.1 + rise])
        frame = started(scene).frame
        working = scene.contact.working_tension
        name = f"{speed:g} m/s, sheave {rise:+g} m above the drum"
        judged = frame.tension_most <= working * 1.0001
        figures.append(
            Figure(
                f"penetration over diameter, {name}",
                float(frame.penetration / scene.cable.diameter),
                "",
                0.1 if judged else None,
            )
        )
        notes.append(
            f"{name}: {frame.tension:.0f} N at the sheave, largest {frame.tension_most:.0f} N, wrap "
            f"{np.degrees(frame.wrap_angle):.1f} deg, departure {np.degrees(frame.departure_angle):.1f} deg"
            + ("" if judged else "; above contact.working_tension, not judged")
        )
    return Found(figures, notes)
