"""The complete hand-written tangent against central differences, every term on and each alone."""

import numpy as np
import pytest
from bench_cable import Bench, floor_under, lay_on, record, touching

from cable_sim_ros.physics.contact import touch
from cable_sim_ros.physics.contact_surface import solid
from cable_sim_ros.physics.drag_laws import DragLaw
from cable_sim_ros.physics.state import NOW, STRUM
from cable_sim_ros.physics.viv_amplification import EXTRA

pytestmark = pytest.mark.check


@pytest.mark.parametrize("seed", range(3))
def test_every_term_on(seed):
    bench = Bench(20, seed, current=(-2.0, 0.3, 0.1, 0.05))
    bench.wander()
    bench.surfaces = np.stack([touching(bench, 3, None), touching(bench, 8, np.pi / 3)])
    bench.residual()
    crossing = [e for e in range(20) if bench.q[e, 2] * bench.q[e + 1, 2] < 0.0]
    assert crossing, "the case must have an element in the water surface"
    free = Bench(20, seed, current=(-2.0, 0.3, 0.1, 0.05))
    free.q, free.v, free.a = bench.q, bench.v, bench.a
    loaded = np.abs(bench.residual() - free.residual()).max(1) > 1.0
    assert loaded[2:5].any() and loaded[7:10].any(), "both surfaces must be touched"
    assert bench.worst() < 1e-6


@pytest.mark.parametrize("what", ["dry", "wet", "crossing", "drum", "groove"])
def test_each_alone(what):
    bench = Bench(6, 7, current=(-1.0, 0.4, 0.02, -0.01))
    bench.wander(top={"wet": -5.0, "crossing": 0.25}.get(what, 5.0))
    if what in ("drum", "groove"):
        bench.surfaces = touching(bench, 3, None if what == "drum" else np.pi / 3)[None]
    assert bench.worst() < 1e-6


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("where", ["flank", "rim", "cheek"])
def test_each_part_of_the_sheave(where, side, friction):
    """On flank, round rim and cheek of either half the force has its exact derivative."""
    bench = Bench(4, 3)
    bench.wander(top=5.0)
    row = touching(bench, 2, np.pi / 3)
    row["friction"], row["slip"] = friction, 0.3
    lay_on(bench, row, where, side)
    found, own, _ = touch(solid(record(row)), row["stiffness"], tuple(bench.q[2, :3]), tuple(bench.v[2, :3]))
    assert own.load > 0.1 and found.side == side and (found.own.bend > 0.0) == (where == "rim")
    assert (abs(found.own.normal[1]) == 1.0) == (where == "cheek")
    assert bench.worst() < 1e-6


def test_slow_water_takes_the_low_branches_of_the_drag_coefficient():
    bench = Bench(4, 5, current=(-0.002, 0.001, 0.0, 0.0))
    bench.wander(top=-5.0)
    bench.v *= 1e-3
    assert bench.worst() < 1e-5


@pytest.mark.parametrize("fraction", [0.0, 0.01])
def test_folding_elements_with_axial_damping(fraction):
    """Elements between folded and stretched, some with their damping cut off at the tension."""
    bench = Bench(20, 4, compression=fraction, ca=20.0)
    bench.wander(top=50.0)
    bench.residual()
    assert (bench.tension < 0.01).any() and (bench.tension > 1.0).any()
    assert bench.worst() < 1e-6


@pytest.mark.parametrize("of, fraction", [("both", 0.01), ("both", 0.3), ("both", 1.0), ("normal", 0.3)])
@pytest.mark.parametrize("top", [-5.0, 0.25], ids=["wet", "crossing"])
def test_the_mean_flow_of_the_amplified_drag(top, of, fraction):
    """The mean velocity takes up a share of the velocity within the step; the drag of the mean flow has its part."""
    bench = Bench(20, 4, current=(-2.0, 0.4, 0.02, -0.01), of=of)
    bench.wander(top=top)
    if of == "normal":
        bench.state.nodes[NOW, STRUM, :, EXTRA] = bench.rng.uniform(0.5, 1.5, bench.n + 1)
    bench.mean = 0.4 * bench.rng.normal(size=bench.mean.shape)
    still = bench.residual()
    bench.fraction = fraction
    assert np.abs(bench.residual() - still).max() > 1e-3, "the mean flow must matter"
    assert bench.worst() < 1e-6


def test_a_cable_that_is_drawn_along_itself():
    """Within 6 deg of the flow the C_D of f_t leaves that of the flow across the cable."""
    bench = Bench(20, 4, law=DragLaw.DRISCOLL_NAHON)
    bench.wander(top=-5.0)
    along = bench.q[:, 3:] / np.linalg.norm(bench.q[:, 3:], axis=1)[:, None]
    bench.v = 1e-3 * bench.v
    bench.v[:, :3] += np.geomspace(0.01, 2.0, 21)[:, None] * along
    assert bench.worst() < 1e-6


def test_without_amplification_the_mean_flow_has_no_part():
    bench = Bench(20, 6, current=(-1.0, 0.4, 0.02, -0.01), amplification=1.0)
    bench.wander(top=0.25)
    before, tangent = bench.residual(), bench.tangent()
    bench.mean, bench.fraction = bench.rng.normal(size=bench.mean.shape), 0.5
    assert (bench.residual() == before).all() and (bench.tangent() == tangent).all()


@pytest.mark.parametrize("fraction", [0.01, 1.0])
@pytest.mark.parametrize("slip", ["sliding", "creeping", "at rest"])
def test_a_floor_under_the_cable(slip, fraction):
    """Normal press and friction, sliding far above the slip speed, below it, and next to rest on the floor."""
    bench = Bench(6, 8, current=(-1.0, 0.4, 0.02, -0.01))
    bench.wander(top=-5.0, slope=0.05)
    bench.surfaces = floor_under(bench, 3, slip=0.01 if slip == "sliding" else 0.5)
    free = Bench(6, 8, current=(-1.0, 0.4, 0.02, -0.01))
    if slip != "sliding":
        bench.v = 0.2 * bench.v if slip == "creeping" else 1e-3 * bench.v
        bench.v[:, :3] += bench.surfaces[0].speed
    free.q, free.v, free.a = bench.q, bench.v, bench.a
    pressed = bench.residual() - free.residual()
    assert pressed[:, 2].min() < -1.0, "it must press up"
    along = np.abs(pressed[:, :2]).max() / np.abs(pressed[:, 2]).max()
    assert {"sliding": along > 0.2, "creeping": 0.01 < along < 0.2, "at rest": along < 0.01}[slip]
    bench.fraction = fraction
    assert bench.worst() < 1e-6
