"""A line of one's own: the product's element, water, contact and integrator without ship, drum and winch.

A Rig holds what a line needs: ends that are held, moved or free, point bodies, nodal loads, fixed surfaces. Nothing of
the physics stands here; every force and every step is that of ``physics``. A weight on a cable, pulled aside by a force
and let go:

    cable = cable_of([{"length": 10.0, "elements": 16}], mass_per_length=0.4, axial_stiffness=1e5)
    rig = Rig(cable, held={0: "r"}, bodies={-1: 20.0}, tension=200.0)
    rig.straight(start=(0, 0, 0), direction=(0, 0, -1))
    rig.load(-1, force=(50.0, 0.0, 0.0))
    rig.settle()                                        # the rest under the force
    rig.release_loads()
    rig.balance()                                       # accelerations of the first instant without it
    history = rig.run(duration=5.0, step=0.01)
    print(history.q[-1, -1, :3], history.tension[-1, 0])
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ...compiler.jit import LANES, NO, YES, prepare
from ...errors import RunError
from ...physics.ancf import (
    ADDED_MASS,
    AXIAL_DAMPING,
    BUOYANCY,
    DISPLACED,
    EA,
    EI,
    HALF_RHO_D,
    MASS_PER_LENGTH,
    RE_FACTOR,
    WEIGHT_PER_LENGTH,
)
from ...physics.cable_assembly import Cable, Section
from ...physics.contact_surface import SURFACE
from ...physics.drag_laws import DragLaw
from ...physics.flaps import clear_attitudes
from ...physics.fluid import Fluid, fill_space
from ...physics.integrate import Solver
from ...physics.link_element import without_bending
from ...physics.section import CableModel
from ...physics.state import AT_REST, FLOW, LOAD, NOW, STRUT, Change, LineModel, Q, V, X, make_state
from ...physics.substeps import MAX_TURN, NO_LIMIT, link_stepper
from ...physics.towbody import BODY, Towbody, body_record
from ...physics.water import Water
from ..build import StepRules, arc_lengths, bead_table, build_line, element_table, line_settings, lock, with_attitudes
from ..checks.section_checks import water_problems
from ..problem import Problem
from ..tables.current import declare_water
from ..tables.sea_tables import sea_of
from ..wake_tables import begin_wakes, line_problems, step_problems, wake_table
from .rig_entries import Moved, Samples, accelerate, begin_step, bring_to_rest, integrate, look, take, weigh_up

COMPONENTS = {"x": [0], "y": [1], "z": [2], "r": [0, 1, 2], "gx": [3], "gy": [4], "gz": [5], "g": [3, 4, 5]}

FOLDING = 1e-7  # cable.compression_share of a cable that goes slack
SHIPPED = Solver()  # the defaults of the product: step, rho_inf, tolerance
WHOLE = StepRules(0, NO_LIMIT, NO_LIMIT)  # steps as asked for, or not at all
HALVED = StepRules(SHIPPED.max_halvings, NO_LIMIT, NO_LIMIT)  # halved where Newton does not solve them
WHIPPING = StepRules(10, MAX_TURN, NO_LIMIT)  # and where they turn the cable far: for one that goes slack


def cable_of(sections: list[dict], **numbers: Any) -> Cable:
    """A Cable of the product from plain numbers; a section without a drag law has none.

    Slack elements push, as in scenes by default; a case whose cable goes slack lets them fold (FOLDING).
    """
    named = {f"s{i}": Section(**({"drag_law": DragLaw.OFF} | s)) for i, s in enumerate(sections)}
    return Cable(sections=named, **({"diameter": 0.01} | numbers))


def load_of(node: int, force: npt.ArrayLike = (0.0, 0.0, 0.0), moment: npt.ArrayLike = (0.0, 0.0, 0.0)) -> np.ndarray:
    """A LOAD record: dead force [N] on a node, moment [N m] on its tangent."""
    row = np.zeros((), LOAD)
    row["node"], row["force"], row["moment"] = node, force, moment
    return row


def rows_in_air(elements: np.ndarray) -> np.ndarray:
    """The element table without water: no drag, added mass and buoyancy at any height."""
    elements = elements.copy()
    elements[:, [HALF_RHO_D, RE_FACTOR, ADDED_MASS, BUOYANCY, DISPLACED]] = 0.0
    return elements


class RigError(RunError):
    """A line that could not be solved; nothing of it is given as a value."""


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
    attitude: np.ndarray  # [samples, rigid bodies, 7] quaternion x y z w to the world, rate [rad/s] in body axes


class Rig:
    """One line, its supports and its loads. Lengths [m], forces [N], SI throughout; z is up.

    cable: the product's Cable block, see cable_of(); water: none for a cable in nothing, at whatever height, or a
    Fluid, without a surface; depth: of the water [m] for its waves, none: deep; the frame of the scene keys of the
    water is that of the world; mass_damping [1/s]: of all motion, 2 zeta om for a share zeta of critical at om;
    held: {node: components}, see hold(); bodies: {node: Towbody} or {node: mass [kg]}; surfaces: SURFACE records, see
    physics/contact_surface.py, standing where they are; loads: LOAD records, see load_of(); struts: STRUT records;
    tension: working tension [N] that scales the tolerance. Nodes count from 0, negative ones from the end.
    """

    def __init__(
        self,
        cable: Cable,
        *,
        held: dict[int, str],
        tension: float,
        water: Water | Fluid | None = None,
        depth: float | None = None,
        gravity: float = 9.81,
        bodies: dict | None = None,
        surfaces: list[np.ndarray] | None = None,
        loads: list[np.ndarray] | None = None,
        struts: list[np.ndarray] | None = None,
        solver: Solver = SHIPPED,
        mass_damping: float = 0.0,
    ):
        for name, section in cable.sections.items():
            for problem in water_problems(name, section):
                raise _refused(problem)
        self._speed = 0.0 if water is None else float(np.hypot(*water.current))
        for problem in line_problems(cable, water, self._speed, tension):
            raise _refused(problem)
        self.cable, self.solver, self.gravity, self._working = cable, solver, gravity, tension
        arc, self._links = arc_lengths(cable), cable.model is CableModel.SEGMENTS
        nodes = len(arc)
        carried = {
            node % nodes: body if isinstance(body, Towbody) else Towbody(mass=body, net_weight=body * gravity)
            for node, body in (bodies or {}).items()
        }
        air, endless = water is None, isinstance(water, Fluid)
        water = water.as_water() if isinstance(water, Fluid) else water or Water()
        pulls, rods = np.array(loads or [], LOAD), np.array(struts or [], STRUT)
        pulls["node"] %= nodes
        borne = {n % nodes for n in held} | set(carried) | {int(n) for n in pulls["node"]}
        borne |= {int(n) + 1 for n in rods["node"]}
        beads = bead_table(cable, water, gravity)
        if air:
            beads["buoyancy"] = 0.0
        sea = sea_of(water, gravity, depth)
        elements = element_table(cable, water, gravity, (0 not in borne, nodes - 1 not in borne))
        settings = line_settings(cable, solver, gravity, tension, WHOLE)
        settings["mass_damping"] = mass_damping
        points = np.array([body_record(body, gravity, water.density) for body in carried.values()], BODY)
        points, rigid = with_attitudes(points, list(carried.values()), list(carried), gravity, water.density)
        self.model = build_line(
            rows_in_air(elements) if air else elements,
            np.zeros((nodes, 6)),
            points,
            list(carried),
            settings,
            pulls,
            rods,
            beads,
            wakes=wake_table(cable, water),
            rigid=rigid,
            sea=sea,
        )
        attitudes = len(rigid.bodies)
        self.state = make_state(arc, np.array(surfaces or [], SURFACE), sea, self._links, rigid=attitudes)
        clear_attitudes(self.state, rigid)
        if endless:
            fill_space(self.state.work)
        begin_wakes(self.state, cable)
        declare_water(self.state.now, water, 0.0)
        self.state.now.events.pressed_since = -1  # nobody says that it begins in a groove
        self.state.nodes[:, FLOW, list(carried), 0] = -1.0
        self._check_loads(pulls)
        self.hold(held)
        self.iterations = 0
        prepare(link_stepper, (self.model, self.state))

    @property
    def nodes(self) -> int:
        """How many nodes the line has."""
        return len(self.arc)

    @property
    def arc(self) -> np.ndarray:
        """Unstretched arc length of every node [nodes], m."""
        return self.state.arc

    @property
    def tolerance(self) -> float:
        """Largest residual force of a solved step [N]."""
        return float(self.model.settings["tolerance"][0])

    def place(self, r: np.ndarray, g: np.ndarray, v: np.ndarray | None = None, vg: np.ndarray | None = None) -> None:
        """Set positions and gradients [nodes, 3], and their rates (default: rest)."""
        state = self.state
        state.q[:, :3], state.q[:, 3:] = r, g
        state.v[:, :3], state.v[:, 3:] = (0.0 if v is None else v), (0.0 if vg is None else vg)
        state.a[:], state.nodes[NOW, X] = 0.0, 0.0

    def turn(self, attitudes: npt.ArrayLike, rates: npt.ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """Set quaternions x y z w [rigid bodies, 4], body axes to the world, and rates [rad/s] in body axes."""
        table = self.state.attitude
        table["quaternion"], table["rate"] = np.asarray(attitudes, float), np.asarray(rates, float)
        table["acceleration"], table["auxiliary"], table["gain"] = 0.0, 0.0, 0.0

    def straight(self, start: npt.ArrayLike, direction: npt.ArrayLike, stretch: float = 1.0) -> None:
        """Lay the cable straight from ``start`` along ``direction``, stretched by a factor."""
        d = np.asarray(direction, float) / np.linalg.norm(direction)
        self.place(np.asarray(start, float) + self.arc[:, None] * stretch * d, np.tile(stretch * d, (self.nodes, 1)))

    def settle(self, sigma: float = 0.2, steps: int = 400, longest: float = 1000.0) -> int:
        """Static equilibrium with the held unknowns where they are; returns the steps. Raises RigError."""
        done, iterations, left = bring_to_rest(self.model, self.state, float(sigma), int(steps), float(longest))
        self.iterations += iterations
        if done < 0 or not np.isfinite(self.state.q).all():
            raise RigError(
                f"no static equilibrium after {-done} steps and {iterations} iterations, residual "
                f"{left:.3g} N, allowed {self.tolerance:.3g} N"
            )
        return done

    def hold(self, held: dict[int, str]) -> None:
        """Hold these components of these nodes where they are, and no others.

        Components: ``r`` the position, ``g`` the gradient, or single ones: ``x y z gx gy gz``, as in "rg" or "xy".
        """
        mask = np.zeros((self.nodes, 6))
        for node, what in held.items():
            names = re.findall("g[xyz]|[rgxyz]", what)
            if not names or "".join(names) != re.sub("[ ,]", "", what):
                raise ValueError(f"node {node}: '{what}' holds nothing: components are {', '.join(COMPONENTS)}")
            for name in names:
                if name.startswith("g") and self._limp(node):
                    raise RigError(
                        f"node {node}: '{what}' holds a gradient, and a joint of cable.model = segments without "
                        f"bending_stiffness has none; nothing was held. Hold the place of the next node too, or give "
                        f"bending_stiffness above 0 N m^2"
                    )
                mask[node, COMPONENTS[name]] = 1.0
        self.model = self.model._replace(held=lock(mask))

    def load(self, node: int, force: npt.ArrayLike = (0.0, 0.0, 0.0), moment: npt.ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """One more dead force [N] on a node, and moment [N m] on its tangent."""
        self.reload([*self.model.loads, load_of(node, force, moment)])

    def reload(self, loads: list[np.ndarray]) -> None:
        """These nodal loads in place of those before: LOAD records, see load_of()."""
        rows = np.array(loads, LOAD)
        rows["node"] %= self.nodes
        self._check_loads(rows)
        self.model = self.model._replace(loads=rows)

    def _limp(self, node: int) -> bool:
        """Is the node a joint of links that bears no moment?"""
        return self._links and bool(without_bending(self.model.elements, node % self.nodes, self.nodes - 1))

    def _check_loads(self, rows: np.ndarray) -> None:
        for row in rows:
            if np.any(row["moment"]) and self._limp(int(row["node"])):
                raise RigError(
                    f"a load on node {row['node']} has a moment [N m], and a joint of cable.model = segments without "
                    f"bending_stiffness bears none; nothing was loaded. Give a pair of forces, or bending_stiffness "
                    f"above 0 N m^2"
                )

    def release_loads(self) -> None:
        """Drop all nodal loads."""
        self.reload([])

    def release(self, *nodes: int) -> None:
        """Let go of nodes that were held, and drop all nodal loads."""
        held = self.model.held.copy()
        held[list(nodes)] = 0.0
        self.model = self.model._replace(held=lock(held))
        self.release_loads()

    def change_elements(self, rows: dict[int, float], element: int | None = None) -> None:
        """Other numbers in rows of the element table (physics/ancf.py), of one element or of all of them."""
        table = self.model.elements.copy()
        if element is None:
            for row, value in rows.items():
                table[:, row] = value
        else:
            e, last = element % (self.nodes - 1), self.nodes - 2
            for k in range(table.shape[0] * LANES):
                if k == e or (e == last and k > e):  # the tail repeats the last element
                    for row, value in rows.items():
                        table[k // LANES, row, k % LANES] = value
        self.model = self.model._replace(elements=table)

    def empty_element(self, element: int) -> None:
        """Leave an element only its unknowns, next to no mass and stiffness: it carries the far end of a strut."""
        none = {EI: 0.0, AXIAL_DAMPING: 0.0, WEIGHT_PER_LENGTH: 0.0}
        self.change_elements({MASS_PER_LENGTH: 1e-9, EA: 1e-6} | none, element)

    def balance(self) -> None:
        """Accelerations of the first instant from q and v. Raises RigError."""
        left = accelerate(self.model, self.state)
        if not left <= max(self.tolerance, 1e-9 * np.abs(self.state.tension).max()):
            raise RigError(f"no accelerations balance the start: residual {left:.3g} N")

    def run(
        self,
        duration: float,
        step: float,
        every: int = 1,
        moved: tuple[int, ...] = (),
        motion: Callable | None = None,
        rules: StepRules = WHOLE,
    ) -> History:
        """Advance ``duration`` in equal steps near ``step`` [s]; ``every`` steps one sample.

        motion(t [times]) -> array [times, len(moved), 9] of r, v, a of the moved nodes; rules: WHOLE, HALVED,
        WHIPPING or one's own. Raises RigError.
        """
        steps = max(int(round(duration / step)), 1)
        self._follows(duration / steps)
        steps = -(-steps // every) * every
        h, samples, z = duration / steps, steps // every, np.zeros
        out = Samples(
            q=z((samples, self.nodes, 6)),
            v=z((samples, self.nodes, 6)),
            reaction=z((samples, self.nodes, 6)),
            tension=z((samples, self.nodes - 1)),
            strain=z(samples),
            attitude=z((samples, self.state.attitude.shape[1], 7)),
        )
        follow = self._moved(h * np.arange(steps + 1), moved, motion)
        done, iterations = integrate(self._under(rules), self.state, h, int(every), follow, out)
        self.iterations += iterations
        if done < steps or not np.isfinite(self.state.q).all():
            raise self._stuck(done, steps, h, rules)
        time = h * every * np.arange(1, samples + 1)
        return History(time, out.q, out.v, out.tension, out.reaction, out.strain, iterations, steps, out.attitude)

    def steps(
        self, step: float, moved: tuple[int, ...] = (), motion: Callable | None = None, rules: StepRules = HALVED
    ) -> Iterator[float]:
        """One step [s] piece by piece: yields the length of every piece taken, see run(). Raises RigError."""
        self._follows(step)
        line, follow = self._under(rules), self._moved(np.array((0.0, step)), moved, motion)
        begin_step(self.state)
        plan = self.state.plan
        while plan["done"][0] < 1.0:
            h = take(line, self.state, follow, 0, float(step))
            if h < 0.0 or not np.isfinite(self.state.q).all():
                raise self._stuck(0, 1, step, rules)
            if h > 0.0:
                yield h
        self.iterations += int(plan["used"][0])

    def residual(self, change: Change = AT_REST, tangent: bool = False) -> float:
        """Largest force [N] out of balance at the present q, v, a; forces, and with ``tangent`` their derivative by a
        change of position, are left in state.work.band and lower."""
        return weigh_up(self.model, self.state, change, YES if tangent else NO)

    def contact_table(self, q: np.ndarray | None = None, v: np.ndarray | None = None) -> np.ndarray:
        """CONTACT_POINT records of every Gauss point on every surface, of the present or of a sample q, v of a
        History."""
        kept = self.state.nodes[NOW, [Q, V]].copy()
        try:
            if q is not None:
                self.state.q[:] = q
            if v is not None:
                self.state.v[:] = v
            look(self.state)
        finally:
            self.state.q[:], self.state.v[:] = kept
        return self.state.contact_points

    def _moved(self, times: np.ndarray, nodes: tuple[int, ...], motion: Callable | None) -> Moved:
        table = np.zeros((len(times), 0, 9)) if motion is None else np.ascontiguousarray(motion(times), float)
        return Moved(np.array([n % self.nodes for n in nodes], np.int64), table)

    def _follows(self, step: float) -> None:
        for problem in step_problems(self.cable, self._speed, step, "step"):
            raise _refused(problem, "nothing was simulated")

    def _under(self, rules: StepRules) -> LineModel:
        settings = self.model.settings.copy()
        settings["max_halvings"], settings["max_turn"], settings["leave_step"] = rules
        return self.model._replace(settings=lock(settings, settings.dtype))

    def _stuck(self, done: int, steps: int, h: float, rules: StepRules) -> RigError:
        turn = f" without turning a gradient by more than {rules.max_turn:g}" if rules.max_turn < NO_LIMIT else ""
        return RigError(
            f"step {done + 1} of {steps} ({h:g} s) could not be solved in {self.solver.max_iterations} "
            f"iterations{turn}, {rules.max_halvings} halvings allowed; remedy: a smaller step or a finer mesh"
        )

    def tension_at(self, s: float) -> float:
        """Element tension at unstretched arc length s [m], interpolated between element middles."""
        middle = 0.5 * (self.arc[1:] + self.arc[:-1])
        return float(np.interp(s, middle, self.state.tension))


def _refused(problem: Problem, consequence: str = "nothing was built") -> RigError:
    return RigError(f"{problem.key} {problem.text}; {consequence}. {problem.remedy}")


def warm_up() -> None:
    """Compile what a line runs, or load it from the cache, so that it does not count as its time."""
    rig = Rig(
        cable_of([{"length": 1.0, "elements": 2}], mass_per_length=1.0, axial_stiffness=1e5),
        held={0: "r"},
        tension=10.0,
    )
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    rig.balance()
    rig.run(0.02, 0.01)
