"""Own heave controller: a callable commands the winch offline, beside a run with the winch held.

Usage: python3 own_controller.py [SCENE] [--heave 1.0 8.0] [--duration 60] [--out DIR]
"""

import argparse
from math import cos, sin

from cable_sim_ros import WinchCommand, load_scene, run
from cable_sim_ros.io.scenes.load import override

PERIOD = 0.05  # s between two commands
GAIN, LEAK = 0.5, 100.0  # 1/s; s after which a length that was paid out is forgotten


class HeaveController:
    """Pays out as fast as the sheave rises along the cable, so that the cable below it stands still."""

    def __init__(self, ramp=5.0):
        """ramp: s until the whole gain."""
        self.ramp = ramp
        self.begin = self.datum = None
        self.length = 0.0  # m wanted, over that of the start

    def __call__(self, row):
        """The command for the next period, from the row of the last tick."""
        if self.begin is None:
            self.begin, self.datum, self.angle = row.time, row.payout, row.departure_angle
        t = (row.time - self.begin) * 1e-9  # s
        gain = min(1.0, t / self.ramp)
        speed = gain * (row.sheave_ahead_rate * sin(self.angle) + row.sheave_up_rate * cos(self.angle))
        self.length += PERIOD * (speed - self.length / LEAK)
        error = self.length - (row.payout - self.datum)
        return WinchCommand(rate=float(speed + GAIN * error))


def main(words=None):
    """Run with the winch held and with the controller, and compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", default="side_scan", help="name or file of a scene")
    parser.add_argument("--heave", nargs=2, type=float, default=(1.0, 8.0), help="amplitude m, period s")
    parser.add_argument("--duration", type=float, default=60.0, help="s")
    parser.add_argument("--skip", type=float, default=20.0, help="s at the begin that do not count")
    parser.add_argument("--out", help="folder to make, for the recording of the second run")
    given = parser.parse_args(words)
    scene = override(load_scene(given.scene), {"setpoint.algorithm": "hold"})  # else both would compensate
    common = {"heave": tuple(given.heave), "duration": given.duration, "step": "chosen", "every": PERIOD}
    controller = HeaveController()
    runs = {
        "hold": run(scene, **common),
        "controller": run(scene, **common, controller=controller, control_period=PERIOD, out=given.out),
    }
    for name, result in runs.items():
        frames = result.frames
        late = frames[frames.time - frames.time[0] > given.skip * 1e9]
        mean, std, depth = late.tension.mean(), late.tension.std(), late.body_position[:, 2].std()
        print(f"{name:10}  tension {mean:.0f} N, std {std:.1f} N, depth std {depth:.3f} m, {result.verdict.state}")
    print(f"{runs['controller'].metrics['controller']['commands']} commands")


if __name__ == "__main__":
    main()
