"""A body with attitude: tangent against differences, eigenvalues, trim, energy and momentum against closed forms.

The body of full_scale (theory page of the towbody): a cylinder of 0.3 m and 3 m, 250 kg, 445 N in water. The numbers
beside a test are those of an own calculation by Runge-Kutta.
"""

import numpy as np
import pytest
from bench_cable import dense
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import eigvals
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from cable_sim_ros.physics.attitude import turn_from
from cable_sim_ros.physics.contact_surface import floor_row
from cable_sim_ros.physics.fluid import Fluid
from cable_sim_ros.physics.state import NOW, STEP, Change
from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.physics.water import Water, Waves
from cable_sim_ros.physics.wing import Wing, flap_effect
from cable_sim_ros.sim.rig.rig import Rig, cable_of
from cable_sim_ros.sim.tables.rigid_tables import spheroid
from verification.linear_tow import body_loads, plane_of

pytestmark = pytest.mark.check

MASS, WEIGHT, GRAVITY, RHO = 250.0, 445.0, 9.81, 1026.0
BUOYANCY = MASS * GRAVITY - WEIGHT
ADDED, INERTIA, ADDED_INERTIA = (10.9, 217.6, 217.6), (2.81, 188.9, 188.9), (0.0, 163.2, 163.2)
MUNK = ADDED[1] - ADDED[0]
SLOPE = 2.0 * np.pi * 2.0 / (2.0 + np.sqrt(8.0))
IDENTITY = (0.0, 0.0, 0.0, 1.0)


def body(centre, gravity_centre, **numbers):
    """The body, its hull about ``centre``, without drag but what is given."""
    own = {
        "model": "rigid",
        "mass": MASS,
        "net_weight": WEIGHT,
        "inertia": INERTIA,
        "centre_of_gravity": gravity_centre,
        "centre_of_buoyancy": centre,
        "added_mass": ADDED,
        "added_inertia": ADDED_INERTIA,
        "crossflow_coefficient": 0.0,
        "length": 3.0,
        "diameter": 0.3,
    }
    return Towbody(**(own | numbers))


def tail(area, behind, upright, below=0.0):
    """Fins of aspect ratio 2 and lift alone."""
    chord = np.sqrt(0.5 * area)
    return {
        "tail": Wing(
            place=(-behind, 0.0, -below),
            span=2.0 * chord,
            chord=chord,
            dihedral=90.0 if upright else 0.0,
            drag_coefficient=0.0,
            span_efficiency=1.2,
            stall_angle=60.0,
        )
    }


def rig_of(carried, speed=0.0, length=1.0, held=(0, -1), down=True, pulled=0.0, **numbers):
    """The body on a line of one element without mass, in endless water that flows aft, ``pulled`` [N] straight."""
    stiff, length = (1e7, length) if held else (1.0, 1e3)  # that of a free body is next to nothing
    cable = cable_of([{"length": length, "elements": 1}], mass_per_length=1e-5, axial_stiffness=stiff, diameter=1e-4)
    rig = Rig(
        cable,
        held=dict.fromkeys(held or (0,), "r"),
        bodies={-1: carried},
        tension=WEIGHT,
        **({"water": Fluid(density=RHO, current=(-speed, 0.0)), "gravity": GRAVITY} | numbers),
    )
    rig.straight((0.0, 0.0, -20.0), (0.0, 0.0, -1.0) if down else (-1.0, 0.0, 0.0), 1.0 + pulled / stiff)
    return rig


def whole(rig):
    """Tangent of nodes and rotation as one matrix, of the last residual with tangent, the condensed one undone."""
    state, nodes = rig.state, rig.nodes
    matrix, k = np.zeros((6 * nodes + 3, 6 * nodes + 3)), 6 * (nodes - 1)
    matrix[:-3, :-3] = dense(state.work.band, state.work.lower)
    attitude, free = state.attitude[NOW, 0], rig.model.held[-1, :3] == 0.0
    by_turn, turned = attitude.carries @ attitude.stiffness, attitude.stiffness @ attitude.follows
    matrix[k : k + 3, k : k + 3] += free[:, None] * (by_turn @ attitude.follows)
    matrix[k : k + 3, -3:], matrix[-3:, k : k + 3] = free[:, None] * by_turn, turned
    matrix[-3:, -3:] = attitude.stiffness
    return matrix


def modes(rig, rotation_alone=False):
    """Eigenvalues [1/s] of small motions, the slowest first: lambda^2 M + lambda C + K, each from the tangent."""
    parts = []
    for change in (Change(1.0, 1.0, 0.0, 0.0), Change(2.0, 1.0, 0.0, 0.0), Change(1.0, 2.0, 0.0, 0.0)):
        rig.state.attitude.turned[:] = 0.0
        rig.residual(change, True)
        parts.append(whole(rig))
    c, m = parts[1] - parts[0], parts[2] - parts[0]
    k = parts[0] - c - m
    keep = np.append(rig.model.held.ravel() == 0.0, [True] * 3)
    keep[:-3] &= not rotation_alone
    k, c, m = (part[np.ix_(keep, keep)] for part in (k, c, m))
    zero, one = np.zeros_like(k), np.eye(len(k))
    found = eigvals(np.block([[zero, one], [-k, -c]]), np.block([[one, zero], [zero, m]]))
    found = found[np.isfinite(found)]
    return found[np.argsort(abs(found))]


def near(found, wanted, tolerance=2e-4):
    """Is there an eigenvalue here?"""
    return np.min(abs(found - wanted)) < tolerance


ANGLES, RATES = st.floats(-0.5, 0.5), st.floats(-1.5, 1.5)
VECTOR = st.tuples(RATES, RATES, RATES)
WINGED = {
    "wing": Wing(place=(0.1, 0.2, -0.1), span=1.0, chord=0.4, incidence=-5.0, dihedral=5.0),
    "fin": Wing(place=(-1.4, 0.0, 0.1), span=0.4, chord=0.2, dihedral=90.0, flap_share=0.3, flap=5.0),
}


@pytest.fixture(scope="module")
def winged():
    """A body without symmetry in a current; its place is that of each test."""
    carried = body(
        (-0.25, 0.01, -0.25),
        (-0.2, 0.02, -0.35),
        products_of_inertia=(0.5, 1.0, 2.0),
        hull_centre=(-0.2, 0.0, -0.24),
        drag_area=(0.1, 0.0, 0.8),
        crossflow_coefficient=1.1,
        wings=WINGED,
    )
    return rig_of(carried, held=(0,), water=Water(current=(1.0, 0.3)))


@given(
    depth=st.sampled_from([0.0, 0.05, 20.0]),
    attitude=st.tuples(ANGLES, ANGLES, ANGLES),
    turned=st.tuples(ANGLES, ANGLES, ANGLES),
    motion=st.tuples(VECTOR, VECTOR, VECTOR, VECTOR),
)
@settings(max_examples=12, deadline=None)
def test_the_tangent_is_that_of_differences(winged, depth, attitude, turned, motion):
    """Of force and moment to place and rotation, with what velocity and acceleration change with them."""
    state, change, rig = winged.state, Change(37.0, 2900.0, 0.7, 0.0), winged
    rig.straight((0.0, 0.0, 1.0 - depth), (0.0, 0.0, -1.0))
    begun, now, place = state.attitude[STEP, 0], state.attitude[NOW, 0], state.q[-1, :3].copy()
    begun.quaternion[:] = Rotation.from_rotvec(attitude).as_quat()
    v, a, rate, acceleration = (np.array(x) for x in motion)

    def residual(x, tangent=False):
        state.q[-1, :3] = place + x[:3]
        state.v[-1, :3], state.a[-1, :3] = v + change.velocity * x[:3], a + change.acceleration * x[:3]
        now.turned[:] = turned + x[3:]
        now.rate[:], now.acceleration[:] = rate + change.velocity * x[3:], acceleration + change.acceleration * x[3:]
        turn_from(begun, now)
        rig.residual(change, tangent)
        return np.append(-state.work.band[-1, :3, 12] + now.carries @ now.moment, now.moment)

    residual(np.zeros(6), True)
    unknowns = [*range(6, 9), *range(12, 15)]
    tangent, h = whole(rig)[np.ix_(unknowns, unknowns)], 1e-6
    differences = np.array([(residual(h * e) - residual(-h * e)) / (2.0 * h) for e in np.eye(6)]).T
    # at the surface the drag along the hull and the added mass go with its mean wet share
    np.testing.assert_allclose(tangent, differences, atol=(3e-8 if depth > 1.0 else 2e-3) * abs(differences).max())


def test_the_condensed_system_has_the_step_of_the_whole(winged):
    """Of nodes and rotation at once, and of the nodes alone with the rotation after them."""
    rig, state, change = winged, winged.state, Change(37.0, 2900.0, 0.7, 0.0)
    rig.straight((0.0, 0.0, -20.0), (0.0, 0.0, -1.0))
    rig.turn(Rotation.from_rotvec((0.2, -0.3, 0.1)).as_quat(), (0.1, 0.2, 0.3))
    rig.residual(change, True)
    free, attitude = np.append(rig.model.held.ravel() == 0.0, [True] * 3), state.attitude[NOW, 0]
    forces, matrix = state.work.band[:, :, 12].ravel(), whole(rig)[np.ix_(free, free)]
    forces[-6:-3] -= attitude.carries @ attitude.moment  # the residual has the condensed moment in it
    step = np.linalg.solve(matrix, np.append(forces, -attitude.moment)[free])
    after = -attitude.inverse @ attitude.moment - attitude.follows @ step[-9:-6]
    np.testing.assert_allclose(step[-3:], after, rtol=0.0, atol=2e-13 * abs(step[-3:]).max())


def test_a_pendulum_swings_in_its_period():
    """7.8840 s: 2 pi sqrt(J/K) with J = 394.0 kg m^2 of body and water about the held tow point, K = 250.2 N m."""
    centre, heavy = np.array((-0.2, 0.0, -0.25)), np.array((-0.2, 0.0, -0.3))
    inertia = INERTIA[1] + ADDED_INERTIA[1] + MASS * heavy @ heavy + ADDED[0] * 0.25**2 + ADDED[2] * 0.2**2
    period = 2.0 * np.pi * np.sqrt(inertia / np.linalg.norm(MASS * GRAVITY * heavy - BUOYANCY * centre))
    rig = rig_of(body(centre, heavy))
    rig.settle()
    assert period == pytest.approx(7.8840, abs=1e-3)
    assert near(modes(rig, rotation_alone=True), 2j * np.pi / period, 1e-5)


@pytest.mark.parametrize("heading, axis", [(0.0, 0), (90.0, 1)])
def test_swinging_water_takes_a_free_body_with_it(heading, axis):
    """v/V = (m_w + A)/(m + A), with m_w = 0.6 m 0.6167 along and 0.7861 across: in a wave of 390 m, its depth held."""
    displaced, wave = 0.6 * MASS, Waves(kind="airy", height=0.5, period=16.0, towards_deg=heading)
    steady = (1e6,) * 3  # kg m^2: nothing but that keeps Munk's moment from pitching it in a wave
    carried = body((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), net_weight=GRAVITY * (MASS - displaced), inertia=steady)
    rig = rig_of(carried, held=(), water=Water(density=RHO, waves=wave, ramp=0.0))
    rig.hold({0: "r", -1: "z"})
    rig.straight((0.0, 0.0, 980.0), (0.0, 0.0, -1.0))
    w, share = 2.0 * np.pi / 16.0, (displaced + ADDED[axis]) / (MASS + ADDED[axis])
    orbital = 0.25 * w * np.exp(-20.0 * w**2 / GRAVITY)
    rig.state.v[-1, axis] = share * orbital
    rig.balance()
    run = rig.run(8.0, 0.02)  # half a period: the line that bears nothing falls
    water = orbital * np.cos(w**2 / GRAVITY * run.q[:, -1, axis] - w * run.time)
    # but for terms of its steepness
    np.testing.assert_allclose(run.v[:, -1, axis], share * water, atol=2e-3 * share * orbital)


def test_a_double_pendulum_has_its_frequencies():
    """0.4046 and 0.9773 rad/s: det(K - w^2 M) = 0."""
    rig = rig_of(body((0.0, 0.0, -0.45), (0.0, 0.0, -0.5)), length=10.0, held=(0,))
    rig.settle()
    inertia = INERTIA[1] + ADDED_INERTIA[1] + MASS * 0.5**2 + ADDED[0] * 0.45**2
    across = -0.5 * MASS - 0.45 * ADDED[0]
    m = np.array([[MASS + ADDED[0], across], [across, inertia]])
    k = np.diag([WEIGHT / 10.0, MASS * GRAVITY * 0.5 - BUOYANCY * 0.45])
    for frequency in np.sqrt(eigvals(k, m).real):
        assert near(modes(rig), 1j * frequency, 1e-5)


def test_the_munk_moment_comes_from_the_added_mass():
    """86.861 N m at 5 deg and 2.2 m/s, to turn it further."""
    rig = rig_of(body((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), speed=2.2)
    yaw = np.radians(5.0)
    rig.turn(Rotation.from_euler("z", yaw).as_quat())
    rig.residual()
    moment = MUNK * 2.2**2 * np.sin(yaw) * np.cos(yaw)
    np.testing.assert_allclose(rig.state.attitude[NOW, 0].moment, (0.0, 0.0, -moment), atol=1e-9)


STIFF = 233.9  # N m/rad of weight and buoyancy about the tow point
LOW = (STIFF + 0.25 * BUOYANCY) / (MASS * GRAVITY)


@pytest.mark.parametrize("area, speed", [(0.06, 1.05 * 1.573), (0.06, 0.95 * 1.573), (0.15, 0.5)])
def test_pitch_grows_above_its_critical_speed(area, speed):
    """J p'' + Q l^2 p' + (k + U (Q l - D U)) p = 0: +0.0826 1/s at 1.05 of 1.573 m/s, -0.26148 + 0.77711i below."""
    carried = body((0.0, 0.0, -0.25), (0.0, 0.0, -LOW), wings=tail(area, 1.4, False, 0.25))
    inertia = INERTIA[1] + MASS * LOW**2 + ADDED_INERTIA[1] + ADDED[0] * 0.25**2
    q = 0.5 * RHO * area * SLOPE * speed
    found = modes(rig_of(carried, speed), rotation_alone=True)
    roots = np.roots([inertia, q * 1.4**2, STIFF + speed * (q * 1.4 - MUNK * speed)])
    assert all(near(found, root) for root in roots)
    assert (max(roots.real) > 0.0) == (speed > 1.573)


@pytest.mark.parametrize("share", [0.95, 1.05])
def test_least_fins_hold_the_heading_at_any_speed(share):
    """S = 2 D/(rho C l) = 0.0968 m^2 with the tow point 0.2 m ahead: -0.0677 and +0.0698 1/s at 2.2 m/s."""
    carried = body((-0.2, 0.0, 0.0), (-0.2, 0.0, 0.0), wings=tail(share * 0.0968, 1.6, True))
    found = modes(rig_of(carried, 2.2), rotation_alone=True)
    assert near(found, -0.0677 if share > 1.0 else 0.0698, 1.5e-3)


@pytest.mark.parametrize("upright, low", [(True, 0.0), (False, 0.05)])
def test_sway_with_yaw_and_heave_with_pitch_on_a_line(upright, low):
    """Neutrally buoyant, drag along the hull alone; of the tow in pitch the slow pair is that of porpoising."""
    speed, behind, drag = 2.2, 1.6, 30.0
    carried = body(
        (-0.2, 0.0, 0.0),
        (-0.2, 0.0, -low),
        net_weight=0.0,
        drag_area=(2.0 * drag / RHO, 0.0, 0.0),
        wings=tail(0.15, behind, upright),
    )
    pull, q = drag * speed**2, 0.5 * RHO * 0.15 * SLOPE * speed
    inertia = INERTIA[1] + ADDED_INERTIA[1] + MASS * (0.04 + low**2) + ADDED[1] * 0.04
    across = -0.2 * (MASS + ADDED[1])
    m = np.array([[MASS + ADDED[1], across], [across, inertia]])
    lift = MUNK * speed
    c = np.array([[q, -lift - q * behind], [lift - q * behind, q * behind**2]])
    k = np.array([[pull / 10.0, pull - q * speed], [0.0, MASS * GRAVITY * low + speed * (q * behind - lift)]])
    zero, one = np.zeros((2, 2)), np.eye(2)
    wanted = eigvals(np.block([[zero, one], [-k, -c]]), np.block([[one, zero], [zero, m]]))
    found = modes(rig_of(carried, speed, 10.0, held=(0,), down=False, pulled=pull))
    for root in wanted:
        assert near(found, root, 1e-3 * abs(root))


@pytest.mark.parametrize("ahead", [0.0, 0.05, 0.1, 0.2])
def test_the_static_start_trims_the_body(ahead):
    """Tow point 0.25 m over and ``ahead`` of the centre: where weight, drag, Munk's moment and tail are in balance."""
    speed, drag, area = 2.2, 24.0, 0.15
    carried = body(
        (-ahead, 0.0, -0.25),
        (-ahead, 0.0, -0.25),
        drag_area=(2.0 * drag / RHO, 0.0, 0.0),
        wings=tail(area, 1.4 + ahead, False, 0.25),
    )
    rig = rig_of(carried, speed)
    rig.settle()

    pitch = Rotation.from_quat(rig.state.attitude[NOW, 0].quaternion).as_euler("ZYX")[1]
    x, z = -speed * np.cos(pitch), -speed * np.sin(pitch)  # of the water, body axes: nose down it comes from above
    lift = -SLOPE * pitch
    size, induced = 0.5 * RHO * area * speed, lift**2 / (np.pi * 1.2 * 2.0)
    tail_x, tail_z = size * (lift * z + induced * x), size * (-lift * x + induced * z)
    weight = -WEIGHT * (ahead * np.cos(pitch) + 0.25 * np.sin(pitch))
    munk = MUNK * speed**2 * np.sin(pitch) * np.cos(pitch)
    moment = weight + 0.25 * drag * x**2 + munk - 0.25 * tail_x + (1.4 + ahead) * tail_z
    assert moment == pytest.approx(0.0, abs=1e-3)
    page = {0.0: 3.44, 0.05: 0.741, 0.1: -1.55, 0.2: -5.17}[ahead]
    assert np.degrees(pitch) == pytest.approx(page, abs=0.12)  # that of a drag which stays with the flow


def test_a_wing_glides_at_its_angle():
    """tan = C_D/C_L, U^2 = 2 W cos/(rho S C_L): 15.096 deg and 1.9242 m/s with 200 N on 0.5 m^2, its pitch held."""
    wing = Wing(place=(0.0, 0.0, 0.0), span=np.sqrt(2.0), chord=np.sqrt(0.125), drag_coefficient=0.05, stall_angle=60.0)
    lift = wing.slope * np.radians(3.0)
    drag = 0.05 + lift**2 / (np.pi * 0.9 * 4.0)
    glide = np.arctan2(drag, lift)
    speed = np.sqrt(2.0 * 200.0 * np.cos(glide) / (RHO * 0.5 * lift))
    carried = body((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), net_weight=200.0, wings={"wing": wing})
    rig = rig_of(carried, held=(), down=False)
    rig.turn(Rotation.from_euler("y", glide - np.radians(3.0)).as_quat())
    rig.state.v[:, 0], rig.state.v[:, 2] = speed * np.cos(glide), -speed * np.sin(glide)
    rig.residual()
    np.testing.assert_allclose(rig.state.work.band[-1, :3, 12], 0.0, atol=0.01)


def test_a_free_body_keeps_impulse_moment_and_energy():
    """In water at rest: R p, R h + r x R p and nu (M + A) nu/2 with nu = (u, omega), over 5 s of tumbling."""
    rig = rig_of(body((-0.1, 0.02, -0.2), (-0.15, 0.0, -0.25), net_weight=0.0), held=(), down=False, gravity=1e-9)
    rig.state.v[:, :3] = 1.0, 0.4, -0.3
    rig.turn(IDENTITY, (0.3, 0.2, -0.25))
    rig.balance()
    row = rig.model.rigid.bodies[0]
    own, about = np.zeros((6, 6)), np.array(row["gravity_centre"])
    hat = np.array([[0.0, -about[2], about[1]], [about[2], 0.0, -about[0]], [-about[1], about[0], 0.0]])
    own[:3, :3], own[:3, 3:], own[3:, :3], own[3:, 3:] = MASS * np.eye(3), -MASS * hat, MASS * hat, row["inertia"]

    def kept(q, v, attitude):
        turn = Rotation.from_quat(attitude[:4]).as_matrix()
        moved = np.append(turn.T @ v, attitude[4:])
        momentum = (own + row["added"]) @ moved
        impulse = turn @ momentum[:3]
        return np.concatenate((impulse, turn @ momentum[3:] + np.cross(q, impulse), [0.5 * moved @ momentum]))

    start = kept(rig.state.q[-1, :3], rig.state.v[-1, :3], np.append(IDENTITY, (0.3, 0.2, -0.25)))
    end = rig.run(5.0, 0.01)
    last = kept(end.q[-1, -1, :3], end.v[-1, -1, :3], end.attitude[-1, 0])
    np.testing.assert_allclose(last[:3], start[:3], atol=2e-3 * np.linalg.norm(start[:3]))
    np.testing.assert_allclose(last[3:6], start[3:6], atol=2e-3 * np.linalg.norm(start[3:6]))
    assert last[6] == pytest.approx(start[6], rel=1e-3)


def test_a_pendulum_over_the_top_is_of_second_order():
    """Its nose through the vertical: the energy stays, and a step of half the length has a quarter of the error."""
    ends = []
    for step in (0.005, 0.0025, 0.0005):
        rig = rig_of(body((0.0, 0.0, -0.25), (0.0, 0.0, -0.5)))
        rig.turn(Rotation.from_euler("y", 3.0).as_quat(), (0.0, 0.4, 0.0))
        rig.balance()
        row, run = rig.model.rigid.bodies[0], rig.run(8.0, step)
        ends.append(Rotation.from_quat(run.attitude[-1, 0, :4]).as_matrix())
        up = 1.0 - 2.0 * (run.attitude[:, 0, 0] ** 2 + run.attitude[:, 0, 1] ** 2)
        inertia = row["inertia"][1][1] + row["added"][4][4]
        energy = 0.5 * inertia * run.attitude[:, 0, 5] ** 2 - (MASS * GRAVITY * 0.5 - BUOYANCY * 0.25) * up
        assert np.ptp(energy) < 2e-2 * (step / 0.01) ** 2 * np.ptp(up) * MASS * GRAVITY * 0.25
    coarse, fine = (np.linalg.norm(end - ends[-1]) for end in ends[:2])
    assert coarse / fine == pytest.approx(4.125, rel=0.1)


def by_runge_kutta(plane, heave):
    """x, z and pitch (nose down, as a turn about y) after 2 s of an own calculation in the plane: a body on a spring of
    10 m from the height ``heave``(t), from its rest, by Dormand and Prince's method of order 8."""
    none, flow, spring = np.zeros(2), np.array([-2.2, 0.0]), 1e7 / 10.0

    def pull(t, x):
        along = np.array([0.0, heave(t)]) - x
        return spring * (np.hypot(*along) - 10.0) * along / np.hypot(*along)

    def rates(t, y):
        x, pitch, v, rate = y[:2], y[2], y[3:5], y[5]
        out = [np.append(*body_loads(plane, pitch, rate, s, v, np.array(a), flow)) for *a, s in np.eye(4)[:, 1:]]
        inertia = np.array(out[1:]).T - out[0][:, None]
        return np.concatenate((v, [rate], np.linalg.solve(inertia, np.append(pull(t, x), 0.0) - out[0])))

    pitch = brentq(lambda p: body_loads(plane, p, 0.0, 0.0, none, none, flow)[1], -0.3, 0.3)
    force = body_loads(plane, pitch, 0.0, 0.0, none, none, flow)[0]
    size = np.hypot(*force)
    start = np.array([0.0, heave(0.0)]) - (10.0 + size / spring) * force / size
    y = solve_ivp(rates, (0.0, 2.0), [*start, pitch, 0.0, 0.0, 0.0], method="DOP853", rtol=1e-7, atol=1e-8).y[:, -1]
    return np.array([y[0], 0.0, y[1], 0.0, -y[2], 0.0])


def test_a_winged_body_on_a_heaving_line_is_of_second_order():
    """Wing, fins and strips below 10 m of line whose upper end heaves 0.25 m in 5 s, at 2.2 m/s."""
    wings = {
        "wing": Wing(place=(0.0, 0.0, -0.25), span=1.414, chord=0.3536, incidence=-8.8),
        "tail": Wing(place=(-1.5, 0.0, -0.25), span=0.6, chord=0.3),
        "fin": Wing(place=(-1.5, 0.0, -0.1), span=0.6, chord=0.3, dihedral=90.0),
    }
    carried = body((-0.1, 0.0, -0.25), (-0.1, 0.0, -0.3), wings=wings, crossflow_coefficient=1.1)

    def heave(t):
        w = 2.0 * np.pi / 5.0
        rows = np.zeros((len(t), 1, 9))
        rows[:, 0, 2] = -20.0 + 0.125 * (1.0 - np.cos(w * t))
        rows[:, 0, 5], rows[:, 0, 8] = 0.125 * w * np.sin(w * t), 0.125 * w * w * np.cos(w * t)
        return rows

    ends = []
    for step in (0.04, 0.02, 0.01, 0.0025):
        rig = rig_of(carried, speed=2.2, length=10.0, held=(0,))
        rig.settle()
        run = rig.run(2.0, step, moved=(0,), motion=heave)
        ends.append(np.append(run.q[-1, -1, :3], Rotation.from_quat(run.attitude[-1, 0, :4]).as_rotvec()))
    off = [np.linalg.norm(end - ends[-1]) for end in ends[:-1]]
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.15) and off[1] / off[2] == pytest.approx(4.2, rel=0.15)
    assert off[0] < 1e-4
    own = by_runge_kutta(plane_of(carried, 0, GRAVITY, RHO), lambda t: heave(np.array([t]))[0, 0, 2])
    np.testing.assert_allclose(ends[-1], own, atol=3e-5)  # m, rad; the hull's strips there are Gauss points


def test_nothing_depends_on_where_north_is(winged):
    """All turned about the vertical: the same moments, and forces turned with it."""
    rig, state = winged, winged.state
    rig.straight((0.0, 0.0, -20.0), (0.0, 0.0, -1.0))
    found = []
    for yaw in (0.0, 1.234):
        turn, (x, y) = Rotation.from_euler("z", yaw), (0.7, 0.4)
        c, s = np.cos(yaw), np.sin(yaw)
        state.now.current[:2] = c * x - s * y, s * x + c * y
        state.v[-1, :3], state.a[-1, :3] = turn.apply((0.3, 0.2, -0.4)), turn.apply((0.1, -0.2, 0.3))
        rig.turn((turn * Rotation.from_rotvec((0.2, -0.3, 0.1))).as_quat(), (0.1, 0.2, 0.3))
        before = rig.model.elements
        rig.residual()
        assert rig.model.elements is before
        found.append((turn.inv().apply(state.work.band[-1, :3, 12]), state.attitude[NOW, 0].moment.copy()))
    np.testing.assert_allclose(found[0][1], found[1][1], atol=1e-9)


def test_added_mass_of_spheroids_and_lift_of_flaps():
    """Lamb art. 114-115 and thin foils: 0.0207, 0.9602, 0.8835 at 10 to 1, 0.0591, 0.8943, 0.6999 at 5 to 1; 0.609."""
    np.testing.assert_allclose(spheroid(10.0, 1.0), (0.0207, 0.9602, 0.8835), atol=5e-5)
    np.testing.assert_allclose(spheroid(5.0, 1.0), (0.0591, 0.8943, 0.6999), atol=5e-5)
    assert flap_effect(0.25) == pytest.approx(0.609, abs=5e-4)


@pytest.mark.parametrize("model", ["rigid", "level"])
def test_a_body_that_falls_into_the_water_shares_its_momentum_with_the_added_mass(model):
    """Without weight v = v_0 m/(m + A) once it is under (von Karman 1929), and it comes out as fast as it went up."""
    carried = body((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), net_weight=0.0)
    if model == "level":
        carried = Towbody(mass=MASS, net_weight=0.0, added_mass=ADDED)
    for begin, speed, end in ((1.0, -4.0, -4.0 * MASS / (MASS + ADDED[2])), (-1.0, 4.0, 4.0)):
        ends = []
        for step in (1e-3, 2.5e-4):
            rig = rig_of(carried, held=(), down=False, gravity=1e-9, water=Water(density=RHO))
            rig.state.q[:, 2], rig.state.v[:, 2] = begin, speed
            rig.balance()
            ends.append(rig.run(0.8, step).v[-1, -1, 2])
        assert ends[1] == pytest.approx(end, rel=2e-3)
        assert abs(ends[0] - end) < 0.05 * abs(end)


def test_the_slam_of_a_cylinder_that_falls_flat_beside_those_measured():
    """C_s = 2 A'/(rho D) at most; the impulse to full immersion is that of the added mass, rho pi D^2/4 a length."""
    diameter, length, speed = 0.3, 3.0, 3.0
    added = RHO * np.pi / 4.0 * diameter**2 * length
    heavy = body((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), mass=1e6, net_weight=0.0, added_mass=(0.0, added, added))
    rig = rig_of(heavy, held=(), down=False, gravity=1e-12, water=Water(density=RHO))
    rig.state.q[:, 2], rig.state.v[:, 2] = 0.2, -speed
    rig.balance()
    run = rig.run(0.16, 1e-3)
    force = 1e6 * np.gradient(run.v[:, -1, 2], run.time)
    force[run.q[:, -1, 2] > 0.16] = 0.0
    factor = force.max() / (0.5 * RHO * diameter * length * speed**2)
    assert factor == pytest.approx(1.5 * np.pi / 2.0, rel=0.02), "half immersed; docs/theory.md#slam has those measured"
    impulse = np.trapezoid(force, run.time)
    assert impulse == pytest.approx(added * speed, rel=0.02)
    under = np.linspace(0.0, 1.0, 2001)
    measured = 0.5 * np.trapezoid(5.15 / (1.0 + 19.0 * under) + 0.55 * under, under)
    assert measured == pytest.approx(0.544, abs=1e-3)
    assert impulse / (RHO * diameter**2 * length * speed) / measured == pytest.approx(1.44, abs=0.03), "a miss"
    t = 2.0 * np.pi - 1e-3  # of all of it, by the water of a cylinder in the surface
    arcs = 2.0 / 3.0 * np.pi**3 * (1.0 - np.cos(t)) / (2.0 * np.pi - t) ** 2 + np.pi / 3.0 * (1.0 - np.cos(t))
    assert (arcs + np.sin(t) - t) / 8.0 == pytest.approx(0.507, abs=1e-3)


def test_a_hull_that_turns_into_the_water_shares_its_angular_momentum_with_it():
    """About a tow point that is held 0.5 m over it, without weight: J w = (J + A) w' once all of it is under."""
    own, water = INERTIA[1] + MASS * 3.0**2, ADDED_INERTIA[1] + ADDED[2] * 3.0**2  # kg m^2
    carried = body((-3.0, 0.0, 0.0), (-3.0, 0.0, 0.0), net_weight=0.0)
    rig = rig_of(carried, gravity=1e-12, water=Water(density=RHO))
    rig.state.q[:, 2] += 0.5 - rig.state.q[-1, 2]
    rig.turn(Rotation.from_euler("y", 0.2).as_quat(), (0.0, -1.0, 0.0))
    rig.balance()
    run = rig.run(1.3, 2e-3)
    x, _, z, w = run.attitude[-1, 0, :4]
    assert 0.5 - 1.5 * 2.0 * (z * x - w * run.attitude[-1, 0, 1]) < -0.15, "the near end is under"
    assert run.attitude[-1, 0, 5] == pytest.approx(-own / (own + water), rel=1e-4)


@pytest.mark.parametrize("pitch", [0.0, 0.2])
def test_a_body_that_lands_on_its_ends_bears_what_a_spring_floor_gives_and_keeps_its_energy(pitch):
    """Flat, at 1 m/s without weight: 2/5 k d^2.5 = m v^2/2, F = k d^1.5; on one end it turns."""
    stiffness, speed, floor = 4e5, 1.0, -30.0  # N/m^1.5 of both ends
    carried = body((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), net_weight=0.0, added_mass=(1e-9, 1e-9, 1e-9))
    surfaces = [floor_row(floor, 0.0, 0.0, 0.0, 0.01)]
    rig = rig_of(carried, held=(), down=False, gravity=1e-9, water=Fluid(density=1e-2), surfaces=surfaces)
    row = rig.model.rigid.bodies
    row.setflags(write=True)
    row["floor_stiffness"], row["added"] = 0.5 * stiffness, 1e-9 * np.eye(6)
    row.setflags(write=False)
    rig.state.q[:, 2], rig.state.v[:, 2] = floor + 0.5, -speed
    rig.turn(Rotation.from_euler("y", pitch).as_quat())
    rig.balance()
    run = rig.run(1.0, 2.5e-4)
    up = 2.0 * (run.attitude[:, 0, 0] * run.attitude[:, 0, 2] - run.attitude[:, 0, 3] * run.attitude[:, 0, 1])
    reach = 1.5 - 0.15  # m, of the centres of the round ends
    ends = run.q[:, -1, 2, None] + reach * up[:, None] * np.array([1.0, -1.0]) - 0.15 - floor
    depth = np.maximum(-ends, 0.0)
    stored = 0.4 * 0.5 * stiffness * (depth**2.5).sum(axis=1)
    energy = 0.5 * MASS * run.v[:, -1, 2] ** 2 + 0.5 * 188.9 * run.attitude[:, 0, 5] ** 2 + stored
    np.testing.assert_allclose(energy, 0.5 * MASS * speed**2, rtol=2e-3)
    assert depth.max() > 0.01 and run.v[-1, -1, 2] > -0.5 * speed, "it has landed, and leaves"
    if pitch == 0.0:
        deepest = (0.5 * MASS * speed**2 / (0.4 * stiffness)) ** 0.4
        assert depth.max() == pytest.approx(deepest, rel=1e-3)
        force = MASS * np.gradient(run.v[:, -1, 2], run.time).max()
        assert force == pytest.approx(stiffness * deepest**1.5, rel=5e-3)
