"""What a step pays for, by counts: an option that is off costs no call, no word and no byte that is copied."""

import numba
import pytest

from cable_sim_ros.sim.inputs import WinchCommand
from cable_sim_ros.sim.layout import layout_of
from verification.benchmarks.account import OPTIONS, of_line, of_ticks
from verification.benchmarks.water_cost import changed
from verification.shipped import started

MARK = 123.0
pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="needs compilation")


@pytest.fixture(scope="module")
def mesh():
    return layout_of(changed({})).mesh


@pytest.fixture(scope="module")
def plain(mesh):
    return of_ticks(started(changed({}), mesh))


@pytest.mark.parametrize("name", [name for name, (off, _) in OPTIONS.items() if off is not None])
def test_an_option_that_is_off_costs_no_call_and_no_byte(name, plain, mesh):
    off = of_ticks(started(changed(OPTIONS[name][0]), mesh))
    assert off == plain


def test_an_option_that_is_on_is_counted(plain, mesh):
    on = of_ticks(started(changed(OPTIONS["constant amplification 2"][1]), mesh))
    assert set(on.kernels) - set(plain.kernels) == {"mean_flow._take_up", "mean_flow._follow"}
    assert on.calls > plain.calls and on.bytes == plain.bytes


def test_a_line_alone_pays_for_no_ship_winch_and_water():
    line = of_line()
    assert set(line.kernels) == {
        *("integrate._predict", "integrate._newton", "line._residual", "cable_assembly._assemble", "substeps._finish")
    }
    assert max(kernel.words for kernel in line.kernels.values()) < 10, "model and state are one word each"


def test_a_tangent_is_assembled_where_that_of_a_tick_before_does_not_serve(mesh):
    sim = started(changed({}), mesh)
    band, corrections, made = sim.state.work.band, [], []
    for speed in (0.0, 0.02):
        sim.push(WinchCommand(rate=speed))
        for _ in range(40):
            band[3, 0, 0] = MARK
            corrections.append(sim.run(1).iterations[0])
            made.append(band[3, 0, 0] != MARK)
    assert not any(corrections[:40]) and not any(made[1:40]), "at rest"
    assert all(corrections[40:]) and 1 <= sum(made[40:]) <= 20, "hauled"
