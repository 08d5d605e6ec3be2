"""Energy of cable, bodies and beads, and its balance: stored less start, plus lost in the material, less work done."""

from math import sqrt

from ..compiler.jit import LANES, driver, inline
from .ancf import BUOYANCY, EA, EI, MASS_PER_LENGTH, WEIGHT_PER_LENGTH
from .hermite import LINK, W5, X5, hermite_of, shape
from .mesh_convection import convective, second
from .point_mass import aboard, carried
from .rigid_body import rigid_energies
from .state import ARC, NOW, STEP, Q, V
from .workspace import FED, HELD, LOADS, LOST_POWER, RUBBED, SURFACES, WATER


@inline
def quadratic(a, b, c, d):
    """Mass form of one coordinate: N-weighted a, b, c, d with MASS."""
    return (
        156.0 * (a * a + c * c)
        + 4.0 * (b * b + d * d)
        + 44.0 * (a * b - c * d)
        + 108.0 * a * c
        - 26.0 * (a * d - b * c)
        - 6.0 * b * d
    ) / 420.0


@driver
def energies(line, state):
    """Kinetic energy, potential of weight less buoyancy, potential of the weight alone [J], zero at the surface.

    Of cable, bodies and beads.
    """
    q, v, arc = state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[NOW, ARC]
    kinetic, potential, dry = 0.0, 0.0, 0.0
    for e in range(arc.shape[0] - 1):
        p = line.elements[e // LANES]
        lane = e % LANES
        length = arc[e + 1, 0] - arc[e, 0]
        flow = (arc[e, 1] / length, arc[e + 1, 1] / length)
        m = 0.5 * p[MASS_PER_LENGTH, lane] * length
        for k in range(3):
            y, u = hermite_of(arc, q, v, e, k)
            a, b, c, d = convective(flow, y)
            kinetic += m * quadratic(u[0] + a, u[1] + b, u[2] + c, u[3] + d)
        z0, z1, z2, z3 = hermite_of(arc, q, v, e, 2)[0]
        weight, lift = p[WEIGHT_PER_LENGTH, lane], p[BUOYANCY, lane]
        mean = 0.5 * (z0 + z2) + (z1 - z3) / 12.0
        dry += length * weight * mean
        if max(z0, z2) < 0.0:
            weight -= lift
        elif min(z0, z2) < 0.0:  # crossing the surface
            for g in range(5):
                n = shape(X5[g])
                z = n[0] * z0 + n[1] * z1 + n[2] * z2 + n[3] * z3
                potential -= W5[g] * length * lift * min(z, 0.0)
        potential += length * weight * mean
    for i in range(line.bodies.shape[0]):
        body, n = line.bodies[i], line.body_nodes[i]
        if body.rigid >= 0:
            continue
        for k in range(3):
            kinetic += 0.5 * body.mass * v[n, k] * v[n, k]
        z = q[n, 2]
        potential += body.mass * body.gravity * z - body.buoyancy * min(z, 0.0)
        dry += body.mass * body.gravity * z
    if line.rigid.bodies.shape[0] > 0:
        motion, weight, own = rigid_energies(line, state)
        kinetic, potential, dry = kinetic + motion, potential + weight, dry + own
    for i in range(line.beads.shape[0]):
        bead = line.beads[i]
        if not aboard(bead.place, state, NOW):
            motion, weight, lift = bead_energy(bead, state)
            kinetic, potential, dry = kinetic + motion, potential + weight - lift, dry + weight
    return kinetic, potential, dry


@inline
def bead_energy(bead, state):
    """Kinetic energy of a bead, potential of its weight and, to be taken off, of its buoyancy [J]."""
    _, _, r, v, _ = carried(bead.place, state)
    motion = 0.5 * bead.mass * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return motion, bead.mass * bead.gravity * r[2], bead.buoyancy * min(r[2], 0.0)


@driver
def beads_fed(line, state):
    """Energy of the beads that came off the drum in the last step [J]; of those wound on, negative."""
    energy = 0.0
    for i in range(line.beads.shape[0]):
        bead = line.beads[i]
        came = aboard(bead.place, state, STEP) - aboard(bead.place, state, NOW)
        if came != 0:
            motion, weight, _ = bead_energy(bead, state)
            energy += came * (motion + weight)
    return energy


@driver
def fed(line, state):
    """Energy of the material that enters at the first node, its weight's included [W]; leaving counts negative."""
    q, v, arc = state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[NOW, ARC]
    rate = -arc[0, 1]
    if rate == 0.0:
        return 0.0
    p, length = line.elements[0], arc[1, 0] - arc[0, 0]
    motion, bent, stretched = 0.0, 0.0, 0.0
    for k in range(3):
        g = q[0, 3 + k] if arc[0, LINK] == 0.0 else (q[1, k] - q[0, k]) / length
        w = v[0, k] + rate * g
        r, _ = second(hermite_of(arc, q, v, 0, k)[0])
        motion, bent, stretched = motion + w * w, bent + r * r, stretched + g * g
    strain = sqrt(stretched) - 1.0
    density = 0.5 * (p[MASS_PER_LENGTH, 0] * motion + p[EA, 0] * strain * strain + p[EI, 0] * bent / length**4)
    return rate * (density + p[WEIGHT_PER_LENGTH, 0] * q[0, 2])


@driver
def fill_energy(line, state, f):
    """Energy fields of a tick output record; the account begins with the first tick output."""
    now = state.memory[NOW]
    kinetic, potential, dry = energies(line, state)
    account, strain, drum = now.account, now.health.strain, now.drive
    kinetic += 0.5 * drum.mass * now.winch.rate**2  # of a drum that a motor turns; else there is no mass
    f.kinetic_energy, f.strain_energy, f.potential_energy = kinetic, strain, potential
    stored = kinetic + strain + dry
    if now.time.ticks == 0:
        account.stored = stored
    work = account.work
    f.work_supplied, f.dissipated = work[HELD] + work[FED] + drum.supplied, work[LOST_POWER] + drum.lost
    f.work_water, f.work_contact, f.friction_heat = work[WATER], work[SURFACES], work[RUBBED]
    supplied = f.work_supplied + work[WATER] + work[SURFACES] + work[LOADS]
    f.energy_residual = stored - account.stored + f.dissipated - supplied


@driver
def slack_gain(account, f, slack, fraction):
    """Has the integration given slack cable more than ``fraction`` of the work turned over since the start, and of the
    energy that moves and stretches the tow now? Call once a tick output record, filled by fill_energy."""
    if f.tick == 0:
        account.supplied, account.residual = f.work_supplied, f.energy_residual
        account.turned, account.gained = 0.0, 0.0
    account.turned += abs(f.work_supplied - account.supplied)
    if slack:
        account.gained += f.energy_residual - account.residual
    account.supplied, account.residual = f.work_supplied, f.energy_residual
    return account.gained > fraction * (account.turned + f.kinetic_energy + f.strain_energy)
