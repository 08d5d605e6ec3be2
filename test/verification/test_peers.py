"""Other codes of the benchmark: that they are given the same scene, and reach what they are shown with."""

import numpy as np
import pytest

from verification.benchmarks.bench import PEER_SCENES
from verification.ours import CLEAR, leaving_tension
from verification.peers import CANNOT, CODES, RUNS, Setting, even, installed
from verification.peers.in_exudyn import Stream
from verification.scenes import errors, reference

P = reference("P5").params
GRADED = ((0.6, 5), (0.3, 6), (0.1, 6))


def best_of(code, scene):
    """Errors of the settings a code is shown with, tension and position [runs, 2]."""
    if installed(code) is None:
        pytest.skip(f"{code} is not installed")
    run, settings = RUNS[code, scene]
    return np.array([errors(scene, run(s).history) for s in settings])


def test_every_code_has_a_run_or_a_reason_on_every_scene():
    everything = {(code, scene) for code in CODES for scene in PEER_SCENES}
    assert set(RUNS) | set(CANNOT) >= everything and not set(RUNS) & set(CANNOT)


def test_a_history_with_few_samples_keeps_its_crests():
    exact = reference("P5").history
    assert max(errors("P5", exact[::4])) < max(errors("P5", exact)) + 1e-5
    assert np.isnan(errors("P5", np.where(exact == exact[7, 3], np.nan, exact))).all()


def test_arc_of_a_graded_mesh():
    arc = Setting(GRADED, 0.1).arc(450.0)
    assert len(arc) == 18 and arc[-1] == pytest.approx(450.0)
    assert np.diff(arc)[[0, 5, -1]] == pytest.approx((54.0, 22.5, 7.5))


def stream(angle, rise=0.0, lift=0.0, elements=3, points=3):
    """Load at rest on a straight cable at an angle [rad] below the stream, and its arc lengths."""
    arc = even(elements, 0.1).arc(P["L"])
    wet = Stream(arc, points, P, np.zeros(1), np.array([(rise, lift)]))
    direction = np.array((np.cos(angle), -np.sin(angle)))
    q = np.zeros((len(arc), 4))
    q[:, :2] = arc[:, None] * (direction - (1.0, 0.0))
    q[:, 2:] = direction - (1.0, 0.0)
    return wet, q.ravel(), direction


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.5])
def test_load_of_a_straight_cable_is_the_drag_law_of_the_scene(angle):
    rise, lift = 0.7, 0.3
    wet, q, t = stream(angle, rise, lift)
    force = wet.force(0.0, q, np.zeros_like(q)).reshape(-1, 4)[:, :2].sum(0)
    n, flow = np.array((-t[1], t[0])), np.array((P["U"], -rise))
    size = 0.5 * P["rho"] * P["d"] * P["L"]
    want = size * (P["Cdn"] * abs(flow @ n) * (flow @ n) * n + np.pi * P["Cdt"] * abs(flow @ t) * (flow @ t) * t)
    want[1] -= P["w"] * P["L"] + P["Wnet"] + lift * (P["mu"] * P["L"] + P["M"])
    assert force == pytest.approx(want, rel=1e-10)


@pytest.mark.parametrize(("by_q", "by_v"), [(1.0, 0.0), (0.0, 1.0)])
def test_jacobian_of_the_load_by_differences(by_q, by_v):
    wet, q, _ = stream(0.5, 0.2, 0.1)
    rng = np.random.default_rng(1)
    q = q + rng.normal(size=q.size) * np.tile((5.0, 5.0, 0.3, 0.3), q.size // 4)
    v = rng.normal(size=q.size) * np.tile((1.0, 1.0, 0.01, 0.01), q.size // 4)
    got, want = np.zeros((q.size, q.size)), np.zeros((q.size, q.size))
    rows, columns, values = wet.jacobian(0.0, q, v, by_q, by_v).T
    np.add.at(got, (rows.astype(int), columns.astype(int)), values)
    for j, h in enumerate(1e-6 * np.eye(q.size)):
        want[:, j] = -(wet.force(0.0, q + by_q * h, v + by_v * h) - wet.force(0.0, q - by_q * h, v - by_v * h)) / 2e-6
    assert got == pytest.approx(want, abs=1e-8 * abs(want).max())


def test_tension_where_the_cable_leaves_is_read_from_its_straight_part():
    middle, tangent = np.linspace(0.0, 8.0, 81), 4.5
    tension = 500.0 + 3.0 * (middle - tangent)
    tension[middle <= tangent + CLEAR] += 100.0
    assert leaving_tension(middle, tangent, tension) == pytest.approx(500.0)


def test_fluid_force_of_a_rigid_link_is_the_drag_law():
    mujoco = pytest.importorskip("mujoco")
    from verification.peers.in_mujoco import _towed_model

    model = _towed_model(even(2, 0.1, points=1), np.array((225.0, 225.0)), P)
    data = mujoco.MjData(model)
    # first link straight down, second on along it: the stream is across both
    data.qpos[0] = 0.5 * np.pi
    mujoco.mj_forward(model, data)
    torque = 0.5 * P["rho"] * P["d"] * P["Cdn"] * P["U"] ** 2 * P["L"] ** 2 / 2.0
    assert abs(data.qfrc_fluid[0]) == pytest.approx(torque, rel=1e-6)
    # both along the stream: nothing but skin friction, which the slide between them takes for the second link
    data.qpos[0] = 0.0
    mujoco.mj_forward(model, data)
    friction = 0.5 * P["rho"] * P["d"] * np.pi * P["Cdt"] * P["U"] ** 2 * 0.5 * P["L"]
    assert data.qfrc_fluid[1] == pytest.approx(friction, rel=1e-6)


@pytest.mark.parametrize(
    ("code", "scene"), sorted(RUNS.keys() - {("mujoco", "P2"), ("moordyn", "P5"), ("moordyn", "P6")})
)
def test_a_code_reaches_one_percent_with_a_setting_it_is_shown_with(code, scene):
    assert best_of(code, scene).max(1).min() < 0.01
