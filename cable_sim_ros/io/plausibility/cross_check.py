"""Odometry held against the IMU: attitude and heave, also where the IMU itself has been convicted.

An IMU that reads -g has its axes down, or its force reversed; both make its vertical acceleration that of z down.
Odometry whose vertical velocity fits that is down as well: all of the motion is in NED axes, and none of it is used. An
IMU that is convicted of something else still has an attitude: odometry that turns with it has a witness.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...sim.tables.attitude import to_world
from ..messages.fault_hypotheses import attitude_guesses, heave_guesses, ned_guesses
from ..messages.messages import Odometry
from .regression import GOOD, Comparison

NEAR = 100_000_000  # ns between an IMU message and the odometry that is held against it
DOWN = "gravity_sign"  # the finding of an IMU whose vertical is reversed
NO_ATTITUDE = ("gravity_direction",)  # findings after which the IMU's attitude says nothing


class CrossCheck:
    """imu and odometry take each message in turn; `causes`: findings against the odometry, "" for none.

    gravity: m/s^2; arm: IMU in base_link, m. `witnessed`: the odometry has been seen to fit the IMU.
    """

    def __init__(self, gravity: float, arm: Sequence[float]) -> None:
        self.gravity, self.arm = gravity, arm
        self._turned = Comparison(attitude_guesses(), moving=1e-3, apart=2.5e-3)
        self._heaved = Comparison(heave_guesses(), moving=0.02, apart=0.05, drift=True)
        self._down = Comparison(ned_guesses(), moving=0.02, apart=0.05, drift=True)
        self._witness = Comparison(attitude_guesses(), moving=1e-3, apart=2.5e-3)
        self.reset()

    def reset(self) -> None:
        """A jump of the clock: forget the times, not the findings."""
        self._imu: tuple[int, tuple, float] | None = None  # stamp, angles, vertical specific force
        self._climbed = self._sunk = 0.0  # m/s: integrals of it, read with z up and with z down

    @property
    def causes(self) -> tuple[str, ...]:
        """What is found against the odometry; "" each where nothing is."""
        return self._turned.cause, self._heaved.cause, self._down.cause

    @property
    def witnessed(self) -> bool:
        """Has the odometry been seen to fit the IMU, and does nothing speak against it?"""
        compared = (self._turned, self._heaved, self._down, self._witness)
        return not any(one.cause for one in compared) and any(one.agreed >= GOOD for one in compared)

    def imu(self, stamp: int, angles, force, dt: float) -> None:
        """An IMU message: stamp [ns], angles [rad], specific force in body axes [m/s^2]; dt: s since the one before."""
        if not dt:
            self._imu = None
        up = to_world(angles, force)[2]
        if self._imu is not None:
            mean = 0.5 * dt * (up + self._imu[2])
            self._climbed += mean - dt * self.gravity
            self._sunk += mean + dt * self.gravity
        self._imu = stamp, angles, up

    def odometry(self, stamp: int, angles, message: Odometry, climb: float, dt: float, doubted: str) -> None:
        """An odometry message; climb: its vertical velocity [m/s]; doubted: finding against the IMU, "" for none."""
        near = self._imu is not None and dt > 0.0 and abs(stamp - self._imu[0]) <= NEAR
        if near and message.twist:
            (ax, ay, az), (p, q, r) = self.arm, message.rate
            climb += to_world(angles, (q * az - r * ay, r * ax - p * az, p * ay - q * ax))[2]
        for compared, meant in (
            (self._turned, not doubted),
            (self._heaved, not doubted),
            (self._down, doubted == DOWN),
            (self._witness, bool(doubted) and doubted not in (DOWN, *NO_ATTITUDE)),
        ):
            if not (near and meant):
                compared.begin()
                continue
            assert self._imu is not None
            if compared in (self._turned, self._witness):
                compared.add((*angles, *self._imu[1]), dt)
            else:
                compared.add((climb, self._sunk if compared is self._down else self._climbed), dt)
