"""What a step pays for, by counts: an option that is off costs no call, no word and no byte that is copied."""

import numba
import pytest

from cable_sim_ros.sim.layout import layout_of
from verification.benchmarks.account import OPTIONS, of_line, of_ticks
from verification.benchmarks.water_cost import changed
from verification.shipped import started

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="needs compilation")

MESH = layout_of(changed({})).mesh


@pytest.fixture(scope="module")
def plain():
    return of_ticks(started(changed({}), MESH))


@pytest.mark.parametrize("name", [name for name, (off, _) in OPTIONS.items() if off is not None])
def test_an_option_that_is_off_costs_no_call_and_no_byte(name, plain):
    off = of_ticks(started(changed(OPTIONS[name][0]), MESH))
    assert off == plain


def test_an_option_that_is_on_is_counted(plain):
    on = of_ticks(started(changed(OPTIONS["constant amplification 2"][1]), MESH))
    assert set(on.kernels) - set(plain.kernels) == {"mean_flow._take_up", "mean_flow._follow"}
    assert on.calls > plain.calls and on.bytes == plain.bytes


def test_a_line_alone_pays_for_no_ship_winch_and_water():
    line = of_line()
    assert set(line.kernels) == {
        *("integrate._predict", "integrate._newton", "line._residual", "cable_assembly._assemble", "substeps._finish")
    }
    assert max(kernel.words for kernel in line.kernels.values()) < 10, "model and state are one word each"
