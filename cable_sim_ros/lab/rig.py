"""A line on the laboratory bench: the product's element, water, contact and integrator without ship, drum and winch.

A Rig holds what a verification case needs: nodes that are held or moved, point bodies, nodal loads, fixed surfaces.
Nothing of the physics stands here; every force and every step is that of ``physics``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..physics.ancf import (
    ADDED_MASS,
    AXIAL_DAMPING,
    BUOYANCY,
    EA,
    EI,
    HALF_RHO_D,
    MASS_PER_LENGTH,
    RE_FACTOR,
    WEIGHT_PER_LENGTH,
)
from ..physics.banded import solve
from ..physics.cable import Cable, Section, make_work
from ..physics.drag import DragLaw
from ..physics.integrate import TURN_MOST, Solver, advance, link_solver, predict, settle, take_back, whipped
from ..physics.jit import LANES, NO, YES, driver
from ..physics.line import HEALTH, LOAD_COLUMNS, STRAIN, STRUT_COLUMNS, Line, residual
from ..physics.surface import AXIS, BODY, CENTRE, SURFACE_COLUMNS
from ..physics.towbody import BODY_ROWS, Towbody, body_table
from ..physics.water import Water
from ..sim.build import ROUND_OFF, arc_lengths, element_table, lock

FOLDING = 1e-7  # cable.compression_share of a cable that goes slack
SHIPPED = Solver()  # the defaults of the product: step, rho_inf, tolerance


class RigError(RuntimeError):
    """A case that could not be solved; nothing of it is told as a value."""


class History(NamedTuple):
    """Samples of a run: ``every`` steps one, the first after ``every`` steps."""

    time: np.ndarray  # [samples] s
    q: np.ndarray  # [samples, nodes, 6]
    v: np.ndarray  # [samples, nodes, 6]
    tension: np.ndarray  # [samples, elements] N
    reaction: np.ndarray  # [samples, nodes, 6] N, N m
    strain: np.ndarray  # [samples] J
    iterations: int  # Newton iterations of the whole run
    steps: int


@driver
def accelerate(line):
    """Accelerations that balance the present q and v; returns the residual left [N]."""
    big = 1e14  # inertia over stiffness: the solution is an acceleration, the shape stays
    worst = residual(line, 0.0, 0.0, 0.0, NO)
    for _ in range(6):
        if worst <= line.tolerance:
            break
        residual(line, 0.0, big, 0.0, YES)
        if not solve(line.work.band, line.work.lower, line.work.factor, line.work.step):
            return np.inf
        for n in range(line.q.shape[0]):
            for k in range(6):
                line.a[n, k] += big * line.work.step[n, k]
        worst = residual(line, 0.0, 0.0, 0.0, NO)
    for n in range(line.q.shape[0]):
        for k in range(6):
            line.x[n, k] = line.a[n, k]
    return worst


@driver
def moved_step(line, h, rho, nodes, motion):
    """One step of h [s], nodes [m] at its end where motion [m, 9] (r, v, a) says. Returns the iterations, or -1."""
    predict(line, h, rho)
    for m in range(nodes.shape[0]):
        for k in range(3):
            line.q[nodes[m], k] = motion[m, k]
            line.v[nodes[m], k] = motion[m, 3 + k]
            line.a[nodes[m], k] = motion[m, 6 + k]
    return advance(line, h, rho)


@driver
def halved_step(line, h, rho, halvings):
    """One step of h [s], halved where Newton does not solve it, as in the tow. Returns the iterations, or -1."""
    done, share, level, total = 0.0, 1.0, 0, 0
    while done < 1.0:
        predict(line, share * h, rho)
        used = advance(line, share * h, rho)
        if used < 0:
            level += 1
            share *= 0.5
            if level > halvings:
                return used
            continue
        total += used
        done += share
        if share < 1.0 and (done / (2.0 * share)) % 1.0 == 0.0:
            share *= 2.0
            level -= 1
    return total


@driver
def march(line, rho, h, steps, every, halvings, moved, motion, q, v, tension, reaction, strain, count):
    """``steps`` steps of h [s]; moved [m] nodes follow motion [steps, m, 9] (r, v, a). Returns the steps done."""
    for i in range(steps):
        if moved.shape[0] > 0:
            used = moved_step(line, h, rho, moved, motion[i])
        else:
            used = halved_step(line, h, rho, halvings)
        if used < 0:
            return i
        count[0] += used
        if (i + 1) % every == 0:
            s = (i + 1) // every - 1
            for n in range(line.q.shape[0]):
                for k in range(6):
                    q[s, n, k] = line.q[n, k]
                    v[s, n, k] = line.v[n, k]
                    reaction[s, n, k] = line.reaction[n, k]
            for e in range(line.tension.shape[0]):
                tension[s, e] = line.tension[e]
            strain[s] = line.health[STRAIN]
    return steps


@driver
def bring_to_rest(line, sigma, steps, longest):
    """integrate.settle as an entry of its own."""
    return settle(line, sigma, steps, longest)


def cable_of(sections: list[dict], **numbers) -> Cable:
    """A Cable of the product from plain numbers; a section without a drag law has none.

    Slack elements push, as in scenes by default; a case whose cable goes slack lets them fold (FOLDING).
    """
    named = {f"s{i}": Section(**({"drag_law": DragLaw.OFF} | s)) for i, s in enumerate(sections)}
    return Cable(sections=named, **({"diameter": 0.01} | numbers))


def rows_in_air(elements: np.ndarray) -> np.ndarray:
    """The element table without water: no drag, added mass and buoyancy at any height."""
    elements = elements.copy()
    elements[:, [HALF_RHO_D, RE_FACTOR, ADDED_MASS, BUOYANCY]] = 0.0
    return elements


class Rig:
    """One line, its supports and its loads. Lengths [m], forces [N], SI throughout.

    cable: the product's Cable block; water: none for a cable in air, at whatever height; held: unknowns imposed, as
    {node: "rg"} with r the position and g the gradient; bodies: {node: Towbody} or {node: mass [kg]}; surfaces: rows
    of surface.surface_row, placed where they are;
    tension: working tension [N] that scales the tolerance.
    """

    def __init__(
        self,
        cable: Cable,
        *,
        held: dict[int, str],
        tension: float,
        water: Water | None = None,
        gravity: float = 9.81,
        bodies: dict | None = None,
        surfaces: list[np.ndarray] | None = None,
        loads: list | None = None,
        struts: list | None = None,
        solver: Solver = SHIPPED,
    ):
        self.cable, self.solver, self.gravity = cable, solver, gravity
        self.arc = arc_lengths(cable)
        nodes = len(self.arc)
        rows = np.zeros((len(surfaces or ()), SURFACE_COLUMNS))
        for i, row in enumerate(surfaces or ()):
            rows[i] = row
            rows[i, CENTRE : CENTRE + 3] = row[BODY : BODY + 3]
            rows[i, AXIS : AXIS + 3] = (0.0, 1.0, 0.0)
        carried = {
            node % nodes: body if isinstance(body, Towbody) else Towbody(mass=body, net_weight=body * gravity)
            for node, body in (bodies or {}).items()
        }
        air = water is None
        water = water or Water()
        table = [body_table(body, gravity, water.density) for body in carried.values()]
        z = np.zeros
        flow = z((len(carried), 6))
        flow[:, 0] = -1.0
        current = np.array((*water.current, *water.current_gradient))
        free = tuple(
            not (
                node in held
                or node in carried
                or node % nodes in carried
                or any(row[0] == node % nodes for row in (*(loads or ()), *((s[0] + 1,) for s in struts or ())))
            )
            for node in (0, -1)
        )
        elements = element_table(cable, water, gravity, free)
        self.line = Line(
            elements=lock(rows_in_air(elements) if air else elements),
            held=lock(np.zeros((nodes, 6))),
            bodies=lock(np.array(table).reshape(-1, BODY_ROWS)),
            seats=lock(np.array(list(carried)), np.int64),
            loads=np.array(loads or (), float).reshape(-1, LOAD_COLUMNS),
            struts=lock(np.array(struts or (), float).reshape(-1, STRUT_COLUMNS)),
            arc=self.arc,
            q=z((nodes, 6)),
            v=z((nodes, 6)),
            a=z((nodes, 6)),
            x=z((nodes, 6)),
            old=z((4, nodes, 6)),
            gain=z((nodes, 6)),
            current=current,
            surfaces=rows,
            flow=flow,
            tension=z(nodes - 1),
            reaction=z((nodes, 6)),
            health=z(HEALTH),
            work=make_work(nodes),
            gravity=float(gravity),
            tolerance=float(max(solver.tolerance * tension, ROUND_OFF * cable.axial_stiffness)),
            max_iterations=int(solver.max_iterations),
        )
        self.hold(held)
        self.iterations = 0
        link_solver(self.line)

    @property
    def nodes(self) -> int:
        return len(self.arc)

    def place(self, r: np.ndarray, g: np.ndarray, v: np.ndarray | None = None, vg: np.ndarray | None = None) -> None:
        """Set positions and gradients [nodes, 3], and their rates (default: rest)."""
        line = self.line
        line.q[:, :3], line.q[:, 3:] = r, g
        line.v[:, :3], line.v[:, 3:] = (0.0 if v is None else v), (0.0 if vg is None else vg)
        line.a[:], line.x[:] = 0.0, 0.0

    def straight(self, start, direction, stretch: float = 1.0) -> None:
        """Lay the cable straight from ``start`` along ``direction``, stretched by a factor."""
        d = np.asarray(direction, float) / np.linalg.norm(direction)
        self.place(np.asarray(start, float) + self.arc[:, None] * stretch * d, np.tile(stretch * d, (self.nodes, 1)))

    def settle(self, sigma: float = 0.2, steps: int = 400, longest: float = 1000.0) -> int:
        """Static equilibrium with the held unknowns where they are; returns the steps. Raises RigError."""
        done, iterations, left = bring_to_rest(self.line, float(sigma), int(steps), float(longest))
        self.iterations += iterations
        if done < 0 or not np.isfinite(self.line.q).all():
            raise RigError(
                f"no static equilibrium after {-done} steps and {iterations} iterations, residual "
                f"{left:.3g} N, allowed {self.line.tolerance:.3g} N"
            )
        return done

    def hold(self, held: dict[int, str]) -> None:
        """Hold these nodes where they are, and no others."""
        mask = np.zeros((self.nodes, 6))
        for node, what in held.items():
            mask[node, :3], mask[node, 3:] = "r" in what, "g" in what
        self.line = self.line._replace(held=lock(mask))

    def empty_element(self, element: int) -> None:
        """Leave an element only its unknowns, next to no mass and stiffness: it carries the far end of a strut."""
        table = self.line.elements.copy()
        e = element % (self.nodes - 1)
        lanes = [divmod(k, LANES) for k in range(table.shape[0] * LANES) if k == e or (e == self.nodes - 2 and k > e)]
        for group, lane in lanes:
            table[group, [MASS_PER_LENGTH, EA], lane] = 1e-9, 1e-6
            table[group, [EI, AXIAL_DAMPING, WEIGHT_PER_LENGTH], lane] = 0.0
        self.line = self.line._replace(elements=lock(table))

    def add_load(self, node: int, force: np.ndarray) -> None:
        """One more dead force [N] on a node."""
        row = (node % self.nodes, *force, 0.0, 0.0, 0.0)
        self.line = self.line._replace(loads=np.vstack((self.line.loads, row)))

    def release_loads(self) -> None:
        """Drop all nodal loads."""
        self.line = self.line._replace(loads=np.zeros((0, LOAD_COLUMNS)))

    def release(self, *nodes: int) -> None:
        """Let go of nodes that were held, and drop all nodal loads."""
        held = self.line.held.copy()
        held[list(nodes)] = 0.0
        self.line = self.line._replace(held=lock(held), loads=np.zeros((0, LOAD_COLUMNS)))

    def balance(self) -> None:
        """Accelerations of the first instant from q and v. Raises RigError."""
        left = accelerate(self.line)
        if not left <= max(self.line.tolerance, 1e-9 * np.abs(self.line.tension).max()):
            raise RigError(f"no accelerations balance the start: residual {left:.3g} N")

    def run(
        self, duration: float, step: float, every: int = 1, moved: tuple[int, ...] = (), motion=None, halvings: int = 0
    ) -> History:
        """Advance ``duration`` in equal steps near ``step`` [s]; ``every`` steps one sample.

        motion(t [steps]) -> array [steps, len(moved), 9] of r, v, a of the moved nodes; without moved nodes a step that
        Newton does not solve is halved, ``halvings`` times at most. Raises RigError.
        """
        steps = max(int(round(duration / step)), 1)
        steps = -(-steps // every) * every
        h, samples = duration / steps, steps // every
        table = np.zeros((steps, 0, 9)) if motion is None else np.ascontiguousarray(motion(h * np.arange(1, steps + 1)))
        z = np.zeros
        q, v, reaction = (z((samples, self.nodes, 6)) for _ in range(3))
        tension, strain, count = z((samples, self.nodes - 1)), z(samples), z(1, np.int64)
        nodes = np.array([n % self.nodes for n in moved], np.int64)
        done = march(
            self.line,
            self.solver.rho_inf,
            h,
            steps,
            int(every),
            int(halvings),
            nodes,
            table,
            q,
            v,
            tension,
            reaction,
            strain,
            count,
        )
        self.iterations += int(count[0])
        if done < steps or not np.isfinite(self.line.q).all():
            raise RigError(
                f"step {done + 1} of {steps} ({h:g} s) could not be solved in {self.line.max_iterations} "
                f"iterations; remedy: a smaller step or a finer mesh"
            )
        return History(h * every * np.arange(1, samples + 1), q, v, tension, reaction, strain, int(count[0]), steps)

    def refuse_whip(self, step: float) -> None:
        """Take a last step [s] back that turned the cable too far, see integrate.whipped. Raises RigError."""
        line = self.line
        if whipped(line.q, line.old, float(step)):
            take_back(line)
            raise RigError(f"a step of {step:g} s turned the cable by more than {TURN_MOST:g}; remedy: a smaller step")

    def tension_at(self, s: float) -> float:
        """Element tension at unstretched arc length s [m], interpolated between element middles."""
        middle = 0.5 * (self.arc[1:] + self.arc[:-1])
        return float(np.interp(s, middle, self.line.tension))


def warm_up() -> None:
    """Compile what a case runs, or load it from the cache, so that it does not count as the time of a case."""
    rig = Rig(
        cable_of([{"length": 1.0, "elements": 2}], mass_per_length=1.0, axial_stiffness=1e5),
        held={0: "r"},
        tension=10.0,
    )
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    rig.balance()
    rig.run(0.02, 0.01)
