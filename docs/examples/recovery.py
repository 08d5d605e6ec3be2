"""Recovery in waves: haul the towbody to near the surface; largest and least tension on the way.

Usage: python3 recovery.py [SCENE] [--scope 20] [--rate 1.0] [--heave 1.0 8.0] [--out DIR]
"""

import argparse

import numpy as np

from cable_sim_ros import load_scene, run
from cable_sim_ros.io.scenes.load import override

SETTLE = 20.0  # s before the haul: the heave is taken up over ship.start_blend, 10 s


def recover(scene, scope, rate, heave, wait, out=None, settle=SETTLE):
    """Run and times [s] of the haul: `settle` s of waves, haul to `scope` m at `rate` m/s, `wait` s in the waves."""
    haul = (scene.winch.scope - scope) / rate
    plan = f"0 hold, {settle:g} rate {-rate:g}, {settle + haul:g} scope {scope:g}"
    duration = settle + haul + wait
    result = run(scene, heave=heave, duration=duration, winch=plan, step="chosen", out=out)
    return result, (settle, settle + haul)


def main(words=None):
    """Haul, and print a table of its parts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", default="side_scan", help="name or file of a scene")
    parser.add_argument("--scope", type=float, default=20.0, help="m outboard at which the haul stops")
    parser.add_argument("--rate", type=float, default=1.0, help="m/s of hauling in")
    parser.add_argument("--acceleration", type=float, default=0.5, help="m/s^2 to that rate and back")
    parser.add_argument("--heave", nargs=2, type=float, default=(1.0, 8.0), help="amplitude m, period s")
    parser.add_argument("--settle", type=float, default=SETTLE, help="s in the waves before the haul")
    parser.add_argument("--wait", type=float, default=30.0, help="s in the waves after the haul")
    parser.add_argument("--out", help="folder to make, for the recording")
    given = parser.parse_args(words)
    scene = load_scene(given.scene)
    scene = override(scene, {"winch.command_acceleration": given.acceleration})
    result, (begin, end) = recover(
        scene, given.scope, given.rate, tuple(given.heave), given.wait, given.out, given.settle
    )
    frames = result.frames
    seconds = (frames.time - frames.time[0]) * 1e-9
    parts = {"before": seconds < begin, "haul": (seconds >= begin) & (seconds < end), "after": seconds >= end}
    print("part    tension N: least  mean  largest   depth m: least  largest")
    for name, part in parts.items():
        minimum, maximum = frames.tension_tick_min[part].min(), frames.tension_tick_max[part].max()
        depth = -frames.body_position[part, 2]
        mean = frames.tension[part].mean()
        print(f"{name:6}  {minimum:16.0f}  {mean:4.0f}  {maximum:7.0f}   {depth.min():14.1f}  {depth.max():7.1f}")
    slack = np.count_nonzero(frames.tension_least < 0.0) * float(np.median(np.diff(seconds)))
    print(
        f"scope {frames.scope[-1]:.1f} m at the end, slack somewhere for {slack:.1f} s, verdict {result.verdict.state}"
    )


if __name__ == "__main__":
    main()
