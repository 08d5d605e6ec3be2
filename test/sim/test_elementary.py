"""Functions and products that no processor computes otherwise: as numpy's but for the last bit."""

import numpy as np
import pytest

from cable_sim_ros.sim.tables.elementary import exp, log, power, principal, product, tanh

pytestmark = pytest.mark.trust

RNG = np.random.default_rng(3)


@pytest.mark.parametrize("ours, numpys", [(exp, np.exp), (tanh, np.tanh)], ids=["exp", "tanh"])
def test_functions_of_one_array(ours, numpys):
    x = RNG.normal(size=(40, 3)) * 5.0
    np.testing.assert_allclose(ours(x), numpys(x), rtol=4e-16)
    assert ours(x).shape == x.shape and ours(-np.inf).shape == ()


def test_logarithm_and_power_of_arrays_and_numbers():
    x = RNG.random(50) + 0.1
    np.testing.assert_allclose(log(x), np.log(x), rtol=4e-16, atol=1e-17)
    for exponent in (-5.0, 0.25, RNG.normal(size=50)):
        np.testing.assert_allclose(power(x, exponent), x**exponent, rtol=4e-16)
    with pytest.raises(ValueError):
        log(0.0)


def test_products():
    a, b = RNG.normal(size=(7, 3)), RNG.normal(size=(3, 4))
    np.testing.assert_allclose(product(a, b), a @ b, rtol=1e-13)
    np.testing.assert_allclose(product(a[0], b), a[0] @ b, rtol=1e-13)
    np.testing.assert_allclose(product(a, b[:, 0]), a @ b[:, 0], rtol=1e-13)


@pytest.mark.parametrize("small", [1.0, 1e-4, 0.0])
def test_principal_axes(small):
    turn = np.linalg.qr(RNG.normal(size=(3, 3)))[0]
    matrix = turn @ np.diag([3.0, small, 1.0]) @ turn.T
    values, axes = principal(0.5 * (matrix + matrix.T))
    np.testing.assert_allclose(values, sorted([3.0, small, 1.0]), rtol=1e-11, atol=1e-15)
    np.testing.assert_allclose(matrix @ axes, axes * values, atol=1e-14)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-14)
