"""Time integration: generalised-alpha with the residual taken at the end of the step (Arnold & Bruls 2007)."""

from __future__ import annotations

from .quantity import Block, quantity


class Solver(Block):
    tick: float = quantity(0.01, "s", 1e-4, 0.1, "one published step")
    rho_inf: float = quantity(
        0.3, "1", 0.0, 0.5, "spectral radius at infinite frequency", "trap T2: 0.6 and above gain energy in snaps")
    tolerance: float = quantity(
        1e-7, "1", 1e-12, 1e-3, "largest residual, as a fraction of the working tension; never below round-off")
    max_iterations: int = quantity(20, "1", 2, 200, "Newton iterations before a step is halved")
    max_halvings: int = quantity(8, "1", 0, 20, "halvings of a step before the solver gives up")
