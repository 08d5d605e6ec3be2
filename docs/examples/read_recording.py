"""A recording (MCAP) as arrays: ship, winch and tow at every tick, printed, written or plotted.

Usage: python3 read_recording.py RECORDING [--csv tow.csv] [--plot tow.png]
"""

import argparse

import numpy as np

from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.physics.tick_output import FIELDS

UNITS = {name: unit for name, _, _, unit, _ in FIELDS}  # of every field of a row
CHOSEN = ("tension", "payout", "scope", "layback")  # fields with one number a tick


def arrays(frames):
    """Columns [ticks] by name with unit: time from the first tick, depth of the towbody, the chosen fields."""
    seconds, depth = (frames.time - frames.time[0]) * 1e-9, -frames.body_position[:, 2]
    return {"time_s": seconds, "depth_m": depth} | {f"{name}_{UNITS[name]}": frames[name] for name in CHOSEN}


def main(words=None):
    """Read, print, and write what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", help="folder or MCAP file of `run(..., out=...)` or of the node")
    parser.add_argument("--csv", help="table to write")
    parser.add_argument("--plot", help="picture to write; needs matplotlib")
    given = parser.parse_args(words)
    recorded = load_run(given.recording)
    columns = arrays(recorded.frames)
    seconds = columns["time_s"]
    print(f"scene {recorded.custom_data['scene']}, {len(seconds)} ticks, {seconds[-1]:.1f} s")
    for name, values in list(columns.items())[1:]:
        print(f"{name:9}  least {values.min():7.2f}  mean {values.mean():7.2f}  largest {values.max():7.2f}")
    _, shape = recorded.shapes[-1]  # at its time: a row a node, x, y, z [m], tension [N], arc length [m]
    lowest = shape[np.argmin(shape[:, 2])]
    print(f"cable: {len(shape)} nodes, the lowest {-lowest[2]:.1f} m deep with {lowest[3]:.0f} N")
    if given.csv:
        rows = np.column_stack(list(columns.values()))
        np.savetxt(given.csv, rows, fmt="%.6f", delimiter=",", header=",".join(columns), comments="")
    if given.plot:
        plot(columns, given.plot)


def plot(columns, path):
    """One panel for each column over the time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 9), layout="constrained")
    panels = figure.subplots(len(columns) - 1, sharex=True)
    (_, seconds), *others = columns.items()
    for panel, (name, values) in zip(panels, others):
        panel.plot(seconds, values)
        panel.set_ylabel(name)
    panels[-1].set_xlabel("time_s")
    figure.savefig(path)


if __name__ == "__main__":
    main()
