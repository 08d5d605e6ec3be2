"""Energy of cable, bodies and beads, and its balance: stored less start, plus lost in the material, less work done."""

from __future__ import annotations

from .ancf import BUOYANCY, MASS_PER_LENGTH, WEIGHT_PER_LENGTH
from .bead import carried
from .jit import LANES, driver, inline
from .shape import W5, X5, shape
from .state import ARC, NOW, Q, V
from .work import HELD, LOADS, LOST_POWER, SURFACES, WATER


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
    q, v, arc = state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[NOW, ARC, :, 0]
    kinetic, potential, dry = 0.0, 0.0, 0.0
    for e in range(arc.shape[0] - 1):
        p = line.elements[e // LANES]
        lane = e % LANES
        length = arc[e + 1] - arc[e]
        m = 0.5 * p[MASS_PER_LENGTH, lane] * length
        for k in range(3):
            kinetic += m * quadratic(v[e, k], length * v[e, 3 + k], v[e + 1, k], length * v[e + 1, 3 + k])
        z0, z1, z2, z3 = q[e, 2], length * q[e, 5], q[e + 1, 2], length * q[e + 1, 5]
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
        for k in range(3):
            kinetic += 0.5 * body.mass * v[n, k] * v[n, k]
        z = q[n, 2]
        potential += body.mass * body.gravity * z - body.buoyancy * min(z, 0.0)
        dry += body.mass * body.gravity * z
    for i in range(line.beads.shape[0]):
        bead = line.beads[i]
        _, _, r, v, _ = carried(bead.place, state)
        kinetic += 0.5 * bead.mass * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        potential += bead.mass * bead.gravity * r[2] - bead.buoyancy * min(r[2], 0.0)
        dry += bead.mass * bead.gravity * r[2]
    return kinetic, potential, dry


@driver
def fill_energy(line, state, f):
    """Energy fields of a Frame record; the account begins with the first Frame."""
    now = state.memory[NOW]
    kinetic, potential, dry = energies(line, state)
    account, strain = now.account, now.health.strain
    f.kinetic_energy, f.strain_energy, f.potential_energy = kinetic, strain, potential
    stored = kinetic + strain + dry
    if now.time.ticks == 0:
        account.stored = stored
    work = account.work
    f.work_supplied, f.work_water, f.work_contact, f.dissipated = (
        work[HELD],
        work[WATER],
        work[SURFACES],
        work[LOST_POWER],
    )
    supplied = work[HELD] + work[WATER] + work[SURFACES] + work[LOADS]
    f.energy_residual = stored - account.stored + work[LOST_POWER] - supplied
