"""Picture of a recovery: 3 t hauled out of a sea of 2.5 m with the winch held, compensated and at constant tension.

`python -m verification.recovery docs/recovery.png` draws docs/lifting.md's; the same runs, the same picture.
"""

from __future__ import annotations

import sys
import warnings

import numpy as np

from cable_sim_ros.io.scenes.document import SceneWarning
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.plots.run import save, sheet
from cable_sim_ros.plots.strips import LOOKS, WIDTH
from cable_sim_ros.runs.offline import run
from cable_sim_ros.runs.passage import events

SCENE = {  # of recovery_3t: near the surface, in another sea
    "winch.scope": 26.0,
    "winch.least_scope": 3.0,
    "water.waves.height": 2.5,
    "setpoint.tension": 20500.0,
}
WAY, SECONDS, FROM = "0 hold, 10 rate -0.25, 98 hold", 110.0, 40.0  # s, FROM: what is drawn
WINCHES = (("hold", "held"), ("simplified_sheave", "compensated"), ("constant_tension", "constant tension"))
WEIGHT = 3000.0 * 9.81  # N, in air


def main(out: str) -> None:
    """Run the three and draw tension and height of the load over time."""
    warnings.simplefilter("ignore", SceneWarning)
    scene = override(load_scene("recovery_3t"), SCENE)
    figure = sheet((WIDTH, 6.0), 110, "constrained")
    panels = figure.subplots(4, 1, sharex=True, height_ratios=(3, 3, 3, 2))
    for panel, (algorithm, name), (colour, _) in zip(panels, WINCHES, LOOKS):
        done = run(scene, rao="simple", duration=SECONDS, algorithm=algorithm, winch=WAY)
        frames, found = done.frames, events(done.frames)
        time = (frames.time - frames.time[0]) * 1e-9
        wet = np.flatnonzero(frames.status & Flag.SURFACE_CROSSED != 0)
        low, high = found["splash_tension_least"], found["splash_tension"]
        panel.fill_between(
            time,
            1e-3 * np.fmin(frames.tension, frames.tension_tick_min),
            1e-3 * np.fmax(frames.tension, frames.tension_tick_max),
            color=colour,
            lw=0.8,
        )
        panel.axvspan(time[wet[0]], time[wet[-1]], color="#eef0f2", zorder=-2)
        panel.axhline(1e-3 * WEIGHT, color="#8a8f96", lw=0.8, ls=":", zorder=-1)
        panel.set_title(
            f"Winch {name}: {1e-3 * low.value:.1f} to {1e-3 * high.value:.1f} kN in the surface, slam "
            f"{1e-3 * found['slam'].value:.2f} kN",
            loc="left",
            fontsize=9,
        )
        panel.set(ylabel="tension [kN]", ylim=(0.0, 40.0))
        panels[3].plot(time, frames.body_position[:, 2], color=colour, lw=1.0, label=name)
    panels[3].axhline(0.0, color="#8a8f96", lw=0.8)
    panels[3].set_title("Height of the load over the mean water surface", loc="left", fontsize=9)
    panels[3].set_ylabel("height [m]")
    panels[3].set_xlabel("time [s]; grey: the load is in the water surface; dotted: its weight in air")
    panels[3].legend(fontsize=8, ncols=3, loc="lower right", frameon=False)
    panels[3].set_xlim(FROM, SECONDS)
    print(save(figure, out))


if __name__ == "__main__":
    main(*sys.argv[1:2])
