"""Random cables in every state the kernels know: dry, wet, crossing the surface, touching drum, groove and floor."""

from __future__ import annotations

import numpy as np

from cable_sim_ros.compiler.jit import LANES, NO, YES
from cable_sim_ros.physics import ancf
from cable_sim_ros.physics.cable_assembly import Cable, Section, _assemble, link_assembly
from cable_sim_ros.physics.contact_surface import SURFACE, floor_row, surface_row
from cable_sim_ros.physics.drag_laws import CHOO_CASARELLA, LAWS, DragLaw, element_rows
from cable_sim_ros.physics.state import ARC, LINE_SETTINGS, MEAN, NOW, A, Change, Q, State, V, make_state, records
from cable_sim_ros.physics.towbody import BODY
from cable_sim_ros.physics.water import Water
from cable_sim_ros.physics.water_kinematics import link_stir
from cable_sim_ros.sim.build import build_line

C1, C2 = 30.0, 900.0  # 1/s, 1/s^2: what velocity and acceleration change by with the place


def record(row: np.ndarray) -> np.record:
    """One record, its fields as attributes, in the memory of ``row`` [1] or []."""
    return np.atleast_1d(row).view(np.recarray)[0]


def filled(kind: np.dtype, **values) -> np.record:
    """One record of a kind, zero but for these fields."""
    row = records(1, kind)[0]
    for name, value in values.items():
        row[name] = value
    return row


def dense(band: np.ndarray, lower: np.ndarray) -> np.ndarray:
    """The matrix of a block-tridiagonal system of n nodes [6 n, 6 n]."""
    i = np.arange(len(band))
    k = np.zeros((len(i), 6, len(i), 6))
    k[i, :, i] = band[:, :, :6]
    k[i[:-1], :, i[1:]] = band[:-1, :, 6:12]
    k[i[1:], :, i[:-1]] = lower[1:]
    return k.reshape(6 * len(i), 6 * len(i))


def differences(state: State, change: Change, force, step: float) -> np.ndarray:
    """d force()/dq of n nodes [6 n, 6 n] by central differences, with v and a following by ``change``."""
    start, columns = state.nodes[NOW].copy(), []
    for i in range(state.q.size):
        sides = []
        for s in (step, -step):
            for table, factor in ((state.q, 1.0), (state.v, change.velocity), (state.a, change.acceleration)):
                table.ravel()[i] += factor * s
            sides.append(force())
            state.nodes[NOW] = start
        columns.append((sides[0] - sides[1]).ravel() / (2.0 * step))
    return np.array(columns).T


def body_slopes(band_at, step: float) -> np.ndarray:
    """Derivatives [3, 3] of the load in ``band_at``(d) of a body that is moved by d, by central differences."""
    return np.array([(band_at(-d) - band_at(d))[:3, 12] / (2.0 * step) for d in step * np.eye(3)]).T


def about_z(yaw: float) -> np.ndarray:
    """The rotation [3, 3]."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def node_rows(row: int) -> property:
    """A row of State.nodes of the present as an attribute [nodes, 6] that may be assigned."""

    def put(self, value) -> None:
        self.state.nodes[NOW, row] = value

    return property(lambda self: self.state.nodes[NOW, row], put)


def hydro(law: DragLaw, fixed_cd: float | None, amplification: float, density=1026.0, gravity=9.81, of="both"):
    """Hydrodynamic rows of a cable of 10 mm with this law; one that needs a constant C_D has 1.2."""
    fixed_cd = 1.2 if law is DragLaw.DYMORE else fixed_cd
    amplified = {"drag_amplification": amplification, "drag_amplification_of": of}
    section = Section(length=1.0, elements=1, drag_law=law, drag_coefficient=fixed_cd, **amplified)
    cable = Cable(diameter=0.01, mass_per_length=0.389, axial_stiffness=1e4, sections={"all": section})
    return element_rows(section, cable, Water(density=density, viscosity=1.2e-3), gravity)


class Bench:
    """A cable of n elements with everything the assembly needs, and its dense residual and tangent."""

    q, v, a, mean = node_rows(Q), node_rows(V), node_rows(A), node_rows(MEAN)

    def __init__(
        self,
        n: int = 20,
        seed: int = 1,
        *,
        ea=1e4,
        ei=1.4,
        ca=20.0,
        tau=0.01,
        mass=0.389,
        gravity=9.81,
        compression=1.0,
        law=None,
        amplification=1.7,
        of="both",
        density=1026.0,
        current=(0.0, 0.0, 0.0, 0.0),
        lengths=None,
    ):
        rng = np.random.default_rng(seed)
        self.n, self.rng = n, rng
        groups = -(-n // LANES)
        self.elements = np.zeros((groups, ancf.ROWS, LANES))
        # within the narrow blend of a fit the moving bound is exact for the integral, not for its quadrature
        laws = [x for x in DragLaw if x is not DragLaw.OFF and LAWS[x].fit == CHOO_CASARELLA]
        for lane in range(groups * LANES):
            e = min(lane, n - 1)
            row = self.elements[lane // LANES, :, lane % LANES]
            rows = hydro(law or laws[e % len(laws)], None if e % 3 else 1.2, amplification, density, gravity, of)
            for index, value in rows.items():
                row[index] = value
            row[ancf.MASS_PER_LENGTH], row[ancf.EA], row[ancf.EI] = mass, ea, ei
            row[ancf.COMPRESSION] = compression
            row[ancf.AXIAL_DAMPING], row[ancf.BENDING_TIME], row[ancf.WEIGHT_PER_LENGTH] = ca, tau, mass * gravity
        self.elements.setflags(write=False)
        lengths = rng.uniform(0.1, 0.3, n) if lengths is None else np.full(n, lengths)
        self.state = make_state(np.concatenate(([0.0], np.cumsum(lengths))), [])
        self.state.now.current[:] = current
        self.fraction = 0.0  # of the running mean that a step takes up

    @property
    def arc(self) -> np.ndarray:
        return self.state.arc

    @arc.setter
    def arc(self, value) -> None:
        self.state.nodes[NOW, ARC, :, 0] = value

    @property
    def surfaces(self) -> np.ndarray:
        return self.state.surfaces

    @surfaces.setter
    def surfaces(self, rows) -> None:
        self.state = self.state._replace(surfaces=np.array(rows, SURFACE).reshape(-1).view(np.recarray))

    @property
    def work(self):
        return self.state.work

    @property
    def tension(self) -> np.ndarray:
        return self.state.tension

    def wander(self, slope: float = 0.35, top: float = 0.6) -> None:
        """A wavy line that begins at height ``top`` and falls by ``slope``; random velocities and accelerations."""
        rng, n = self.rng, self.n + 1
        self.q[:, 0], self.q[:, 2] = -self.arc, top - slope * self.arc
        self.q[:, :3] += 0.02 * rng.normal(size=(n, 3))
        tangent = np.gradient(self.q[:, :3], self.arc, axis=0)
        self.q[:, 3:] = tangent / np.linalg.norm(tangent, axis=1)[:, None] + 0.1 * rng.normal(size=(n, 3))
        # slow against the stream: where the flow turns round inside the element that crosses the surface, the
        # moving bound is exact for the integral, not for its quadrature
        self.v, self.a = 0.2 * rng.normal(size=(n, 6)), rng.normal(size=(n, 6))

    @property
    def power(self) -> np.ndarray:
        """Of the parts in the last assembly [W]."""
        return self.work.lanes[0].power

    def assemble(self, change: Change, tangent: np.bool_) -> float:
        """The system into work.band and work.lower; returns the strain energy [J]."""
        line = build_line(self.elements, np.zeros((self.n + 1, 6)), np.zeros(0, BODY), [], np.zeros(1, LINE_SETTINGS))
        link_stir(line, self.state)
        link_assembly(line, self.state)
        return _assemble(line, self.state, change, tangent)

    def residual(self, sigma=0.0) -> np.ndarray:
        """R [nodes, 6]."""
        self.energy = self.assemble(Change(0.0, 0.0, sigma, self.fraction), NO)
        return -self.work.band[:, :, 12].copy()

    def tangent(self, sigma: float = 0.0) -> np.ndarray:
        """dR/dq with v and a following by C1 and C2 [6 nodes, 6 nodes]."""
        self.assemble(Change(C1, C2, sigma, self.fraction), YES)
        return dense(self.work.band, self.work.lower)

    def worst(self, sigma: float = 0.3) -> float:
        """Largest difference of the tangent from central differences, over the largest number of its column."""
        exact = self.tangent(sigma)
        near = differences(self.state, Change(C1, C2, 0.0, 0.0), lambda: self.residual(sigma), 1e-7)
        return float((np.abs(near - exact) / np.abs(exact).max(0)).max())


PRESSED = 0.007  # m


def touching(bench: Bench, node: int, throat: float | None) -> np.ndarray:
    """A moving, turning surface that the cable presses by PRESSED at ``node``."""
    row = surface_row((0.0, 0.0, 0.0), 0.3, throat, 0.05, 0.03, 1e6, 0.2)
    row["centre"] = bench.q[node, :3] + np.array([0.01, 0.003, PRESSED - 0.3])
    row["speed"], row["spin"], row["axis"] = (0.1, -0.2, 0.15), (0.1, 0.2, 0.3), (0.0, 1.0, 0.0)
    return row


def floor_under(bench: Bench, node: int, slip: float = 0.01) -> np.ndarray:
    """A drifting floor that the cable presses by PRESSED at ``node``; slip: speed [m/s] of 0.7 of the friction."""
    row = floor_row(bench.q[node, 2] + PRESSED, 1e6, 0.2, 0.4, slip)
    row["speed"] = (0.1, -0.2, 0.0)
    return row


def lay_on(bench: Bench, row: np.ndarray, where: str, side: float) -> None:
    """Put node 2 on the flank, the round rim or the cheek of a groove, on one side of it: the only surface there is."""
    y, gap = {
        "flank": (0.3 * row["crest"], 0.0),
        "cheek": (row["crest"] + 0.5 * row["rim"], -0.1),
        "rim": (row["crest"] + 0.1 * row["rim"], row["top"] - 0.2 * row["rim"]),
    }[where]
    row["centre"] = bench.q[2, :3] - (0.0, side * y, row["radius"] + gap)
    bench.surfaces = row[None]
