"""Ringing that the time integration damps: what it takes from a body that swings along its cable, and would be there.

Generalised-alpha (integrate.py) damps what a step h does not resolve: a mode of frequency w by 0.077 (w h)^3 of its
critical damping (rho_inf = 0.3; 0.0065 at w h = 0.47), where a steel cable in air damps itself by 0.002. With x the
auxiliary acceleration, d the change over a step and forces linear in the place, work less gain of kinetic energy is,
but for what the next step gives back,

    D = -m h^2 e ((1/2 - af)^2 da + ((1/2 - af)(gamma - 1/2) + beta - gamma/2) dx),  e = (1/2 - af) da - (1/2 - am) dx,

from q1 = q0 + h v + h^2 (beta - gamma/2) dx, v the mean velocity, and e = mean x less mean a. It is free of the errors
of the account of energy (energy.py), which a slow motion leaves there and which are larger. What is taken would have
died out in time, by the cable's material and the water. An amplitude A of the tension belongs to an energy of A^2 C/2,
C = sum(length/EA).
"""

from math import sqrt

from ..compiler.jit import LANES, driver, inline
from .ancf import AXIAL_DAMPING, EA
from .integrate import coefficients
from .state import ARC, GAIN, NOW, STEP, A, Q, X
from .vec import dot, norm, row3, scale, sub

# phase of a motion in one step, below which it is resolved: 8e-5 of critical damping is less than any cable has
SMOOTH = 0.1
# 1/s, rate at which what hangs in the water loses such energy: 2 F/(U m) of its drag F at the speed U, 4.5 of side_scan
# and 6 of full_scale
WET = 5.0
EVERY = 32  # ticks after which compliance and material are looked at again


@inline
def mass_along(body, u, z):
    """Mass of a body [kg] that moves with it along a direction u; z: its height, in the water it carries some along."""
    if z >= 0.0:
        return body.mass
    return body.mass + (u[0] * u[0] + u[1] * u[1]) * body.added[0] + u[2] * u[2] * body.added[2]


@driver
def damped(line, state, h):
    """Energy [J] that the solved step of h [s] took from the bodies' motion along the cable."""
    am, af, beta, gamma, _, _ = coefficients(h, line.settings[0].rho_inf)
    by_a, by_x = 0.5 - af, 0.5 - am
    weight_a, weight_x = by_a * by_a, by_a * (gamma - 0.5) + beta - 0.5 * gamma
    q, gain = state.nodes[NOW, Q], state.nodes[NOW, GAIN]
    energy = 0.0
    for i in range(line.bodies.shape[0]):
        n = line.body_nodes[i]
        along = sub(row3(q, n), row3(q, max(n - 1, 0)))
        u = scale(1.0 / max(norm(along), 1e-12), along)
        a = dot(u, row3(state.nodes[NOW, A], n))
        da = a - dot(u, row3(state.nodes[STEP, A], n))
        turn = abs(da - dot(u, row3(gain, n)))
        if turn < SMOOTH * abs(da) and turn < SMOOTH * SMOOTH * abs(a):  # a sine has one or the other all the time
            continue
        dx = dot(u, sub(row3(state.nodes[NOW, X], n), row3(state.nodes[STEP, X], n)))
        off = by_a * da - by_x * dx
        energy -= mass_along(line.bodies[i], u, q[n, 2]) * h * h * off * (weight_a * da + weight_x * dx)
    return energy


@driver
def look_at_cable(line, state):
    """Compliance of the cable along itself [m/N] and the time constant of its material [s] into the account."""
    account, arc = state.memory[NOW].account, state.nodes[NOW, ARC, :, 0]
    compliance, damping = 0.0, 0.0
    for e in range(arc.shape[0] - 1):
        rows, lane = line.elements[e // LANES], e % LANES
        part = (arc[e + 1] - arc[e]) / rows[EA, lane]
        compliance += part
        damping += part * rows[AXIAL_DAMPING, lane] / rows[EA, lane]
    account.compliance, account.material = compliance, damping / compliance


@driver
def fade(line, state, h, ticks):
    """What the ringing that was taken would have lost by itself over a tick of h [s]: of the towbody on its cable the
    material takes (time constant)/(compliance mass), the water WET."""
    account = state.memory[NOW].account
    if ticks % EVERY == 1:
        look_at_cable(line, state)
    body, n = line.bodies[0], line.body_nodes[0]
    rate = account.material / (account.compliance * body.mass)
    if state.nodes[NOW, Q, n, 2] < 0.0:
        rate += WET
    account.ringing = max(account.ringing, 0.0) / (1.0 + rate * h)


@inline
def missing(account):
    """Amplitude of the tension [N] that the ringing has lost to the integration."""
    return sqrt(2.0 * account.ringing / account.compliance) if account.compliance > 0.0 else 0.0
