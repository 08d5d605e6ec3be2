"""How deep a cable is in its sheave, anywhere: from the contact tables of the ticks and the shape of the sheave."""

from __future__ import annotations

import numpy as np

from cable_sim_ros.physics.tick_output import CONTACT_COLUMNS

from .verdict import Metric

Y, GAP, ARC = ([name for name, _ in CONTACT_COLUMNS].index(name) for name in ("y", "gap", "arc_length"))
SAME = 1e-3  # m
BETWEEN = np.linspace(0.0, 1.0, 5)[:-1]  # places looked at between two contact points, on their chord


def depth(surface: np.ndarray, y, gap):
    """Way out of the sheave [m] of a centreline at y [m] along the axis, gap [m] above the seat; negative outside.

    surface: the SURFACE record of the sheave.
    """
    sine, cosine, round_rim = surface["slope_sin"], surface["slope_cos"], surface["rim"]
    u, w = np.abs(y) - surface["crest"], gap - (surface["top"] - round_rim)
    flank, cheek = np.abs(y) * cosine - gap * sine, round_rim - u
    rim = (w > 0.0) & (u * sine + w * cosine > 0.0)
    return np.where(rim, round_rim - np.hypot(u, w), np.minimum(flank, cheek))


class Watch:
    """Looks at the tables of a run: deepest [m], when [s], and how often a contact point went through the disc."""

    def __init__(self, sim):
        self.sim, self.surface = sim, sim.state.surfaces[int(sim.model.settings["sheave"][0])]
        self.deepest, self.when, self.through = -np.inf, 0.0, 0
        self._sides = np.zeros(
            (0, 2)
        )  # of each contact point beside the sheave in the last tick: place on the cable, side

    def look(self, frames):
        """Look at the part of the run just made; returns its tick outputs."""
        feeds = bool(self.sim.model.settings[0].drum["feeds"])
        for frame, rows in zip(frames, self.sim.chunk_tables[1], strict=False):
            rows = rows[: int(frame.contact_stations)].copy()
            rows[:, ARC] -= frame.cable_on_drum if feeds else 0.0  # the mesh at the sheave rides with the ship
            if len(rows):
                self._deep(frame.time * 1e-9, rows)
            self._passing(rows)
        return frames

    def metrics(self, diameter: float) -> list[Metric]:
        """Neither deeper than a diameter [m] anywhere nor through."""
        return [
            Metric("deepest into the sheave, over the diameter", self.deepest / diameter, "", 1.0),
            Metric("contact points through the sheave", self.through, "", 0),
        ]

    def _deep(self, time: float, rows: np.ndarray) -> None:
        points = rows[:, (Y, GAP)]
        near = np.diff(rows[:, ARC]) < 0.5  # contact points of elements side by side
        chords = points[:-1][near, None] + BETWEEN[:, None] * np.diff(points, axis=0)[near, None]
        points = np.concatenate((points, chords.reshape(-1, 2)))
        into = float(depth(self.surface, points[:, 0], points[:, 1]).max())
        if into > self.deepest:
            self.deepest, self.when = into, time

    def _passing(self, rows: np.ndarray) -> None:
        """A contact point is through when it is beside on one side in one tick and beside on the other in the next.

        It is the same one where it is nearest and no more than SAME away: nodes outboard move along the cable.
        """
        aside = (np.abs(rows[:, Y]) > self.surface["crest"]) & (rows[:, GAP] < 0.0)
        sides = np.column_stack((rows[aside, ARC], np.sign(rows[aside, Y])))
        if len(sides) and len(self._sides):
            far = np.abs(sides[:, None, 0] - self._sides[None, :, 0])
            nearest = far.argmin(1)
            same = far[np.arange(len(sides)), nearest] <= SAME
            self.through += int((same & (self._sides[nearest, 1] != sides[:, 1])).sum())
        self._sides = sides
