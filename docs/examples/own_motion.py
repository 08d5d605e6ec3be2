"""Own ship motion in a run: arrays written to a CSV table, or a table of your own.

Usage: python3 own_motion.py [FILE.csv] [--scene side_scan] [--duration 60]
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from cable_sim_ros import motion_of_bag, run


def arrays(duration, dt=0.1):
    """Columns of a table, by name: time s, heave m (up), roll deg (port up), pitch deg (bow down)."""
    t = np.arange(0.0, duration + dt, dt)
    grows = np.minimum(1.0, t / 5.0)  # from rest, like the tow
    heave = grows * (0.8 * np.sin(2 * np.pi * t / 8.0) + 0.3 * np.sin(2 * np.pi * t / 5.5))
    roll = grows * 3.0 * np.sin(2 * np.pi * t / 11.0)
    pitch = grows * 1.5 * np.sin(2 * np.pi * t / 8.0 + 1.0)
    return {"time_s": t, "heave_m": heave, "roll_deg": roll, "pitch_deg": pitch}


def write(path, columns):
    """Write arrays of one length as a table that `run` and `cable-sim run --motion` take."""
    names, rows = ",".join(columns), np.column_stack(list(columns.values()))
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=names, comments="")


def main(words=None):
    """Run under the motion, and print what the ship and the tow did."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", nargs="?", help="a table; left out, one is made from arrays")
    parser.add_argument("--scene", default="side_scan", help="name or file of a scene")
    parser.add_argument("--duration", type=float, default=60.0, help="s")
    given = parser.parse_args(words)
    with tempfile.TemporaryDirectory() as folder:
        path = given.file or Path(folder) / "mine.csv"
        if given.file is None:
            write(path, arrays(given.duration))
        result = run(given.scene, path, duration=given.duration, step="chosen")
        samples = motion_of_bag(path, given.scene)  # what the run took, as ShipMotion samples
    heave = np.array([sample.position[2] for sample in samples])
    frames = result.frames
    sheave, depth = frames.sheave_position[:, 2], -frames.body_position[:, 2]
    minimum, largest = frames.tension_tick_min.min(), frames.tension_tick_max.max()
    print(f"{len(samples)} samples, heave {heave.min():.2f} to {heave.max():.2f} m")
    print(f"sheave {np.ptp(sheave):.2f} m up and down, towbody {np.ptp(depth):.2f} m at {depth.mean():.1f} m")
    print(f"tension {minimum:.0f} to {largest:.0f} N, verdict {result.verdict.state}")


if __name__ == "__main__":
    main()
