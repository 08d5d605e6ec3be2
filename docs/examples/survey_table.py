"""Survey table: depth, tension and layback over scope and speed, in still water.

Usage: python3 survey_table.py [SCENE] [--scope 100 150 200] [--speed 1.5 2.0 2.5]
"""

import argparse

from cable_sim_ros import Simulator, load_scene
from cable_sim_ros.io.scenes.load import override


def table(scene, scopes, speeds):
    """Rows (scope m, speed m/s, depth m, tension N, layback m) of static equilibria."""
    rows = []
    for scope in scopes:
        for speed in speeds:
            sim = Simulator(override(scene, {"winch.scope": scope, "ship.tow_speed": speed}))
            sim.start()  # static equilibrium: no time step is taken
            rows.append((scope, speed, -sim.frame.body_position[2], sim.frame.tension, sim.frame.layback))
    return rows


def main(words=None):
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", default="side_scan", help="name or file of a scene")
    parser.add_argument("--scope", nargs="+", type=float, default=[100.0, 150.0, 200.0], help="m outboard")
    parser.add_argument("--speed", nargs="+", type=float, default=[1.5, 2.0, 2.5], help="m/s through the water")
    given = parser.parse_args(words)
    print("scope m  speed m/s  depth m  tension N  layback m")
    for scope, speed, depth, tension, layback in table(load_scene(given.scene), given.scope, given.speed):
        print(f"{scope:7.0f}  {speed:9.2f}  {depth:7.1f}  {tension:9.0f}  {layback:9.1f}")


if __name__ == "__main__":
    main()
