"""Water: density, viscosity, current, turbulence, waves. World frame ``odom``: ENU, z up, mean water surface at z = 0.

The current varies linearly with depth, V(z) = V_surface - gradient z, Westin (2018) (140); the drag kernels carry it as
four numbers, relative to the tow frame. What is beyond that (a table by depth, turbulence, waves) is off by default:
sea.py, docs/waves.md.
"""

from __future__ import annotations

from enum import Enum

from .parameter import Block, choice, quantity


class CurrentFrame(str, Enum):
    """What the two components of the current are counted along."""

    WORLD = "world"  # east and north
    HEADING = "heading"  # ahead and to port of the ship's mean heading at the start


class WaveKind(str, Enum):
    """Kind of sea."""

    OFF = "off"
    AIRY = "airy"  # one regular wave
    JONSWAP = "jonswap"  # irregular, see docs/waves.md


class ShipInWaves(str, Enum):
    """How the ship's motion belongs to the waves."""

    INDEPENDENT = "independent"  # not at all: the ship moves as recorded or commanded


class Waves(Block):
    kind: WaveKind = choice(WaveKind.OFF, "off; airy: one regular wave; jonswap: irregular sea", "docs/waves.md")
    height: float = quantity(
        0.0, "m", 0.0, 30.0, "airy: height from trough to crest; jonswap: significant wave height Hs"
    )
    period: float = quantity(8.0, "s", 0.3, 40.0, "airy: period; jonswap: peak period Tp; in still water")
    towards_deg: float = quantity(
        0.0, "deg", -360.0, 360.0, "direction the waves travel to: from east to north, or from ahead to port (frame)"
    )
    frame: CurrentFrame = choice(
        CurrentFrame.WORLD,
        "world: towards_deg counts from east; heading: from the heading of the start, so that a head sea stays ahead "
        "whatever the heading of the recorded motion is",
    )
    gamma: float = quantity(3.3, "1", 1.0, 10.0, "peak enhancement of jonswap; 1: Pierson-Moskowitz", "JONSWAP mean")
    spreading: float | None = quantity(
        None, "1", 1.0, 200.0, "s of the directional spreading cos^2s(angle/2) of jonswap; none: long-crested"
    )
    components: int = quantity(100, "1", 10, 1000, "regular waves that make up the irregular sea")
    seed: int = quantity(1, "1", 0, 2**31 - 1, "of phases, frequencies and directions: the same seed, the same sea")
    ship_motion: ShipInWaves = choice(
        ShipInWaves.INDEPENDENT,
        "independent: the ship moves as recorded, whatever the waves are; run --rao moves it in them",
    )


class Turbulence(Block):
    deviation: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0),
        "m/s",
        0.0,
        5.0,
        "standard deviations of the water's velocity along x, y (as water.current counts them) and up; 0: none",
        "Westin 4.3: 0.0300, 0.0262, 0.0152",
    )
    time_scale: float = quantity(
        1.0, "s", 1e-3, 3600.0, "integral time scale of the von Karman spectrum", "a choice: Westin prints none"
    )
    components: int = quantity(100, "1", 10, 1000, "sinusoids an axis")
    seed: int = quantity(1, "1", 0, 2**31 - 1, "of phases and frequencies: the same seed, the same turbulence")


class CurrentTable(Block):
    depth: tuple[float, ...] | None = quantity(
        None, "m", 0.0, 12000.0, "depths of the rows, ascending; the current is held above the first and below the last"
    )
    east: tuple[float, ...] | None = quantity(
        None, "m/s", -10.0, 10.0, "current at each depth, east (ahead where water.current_frame is heading)"
    )
    north: tuple[float, ...] | None = quantity(
        None, "m/s", -10.0, 10.0, "current at each depth, north (to port where water.current_frame is heading)"
    )
    speed: tuple[float, ...] | None = quantity(
        None, "m/s", 0.0, 10.0, "in place of east and north: speed of the current at each depth, with towards_deg"
    )
    towards_deg: tuple[float, ...] | None = quantity(
        None, "deg", -360.0, 720.0, "direction the current sets to at each depth, from east to north, with speed"
    )


class CurrentVariation(Block):
    time: tuple[float, ...] | None = quantity(
        None, "s", 0.0, 1e8, "times since the start, ascending; held before the first and after the last"
    )
    factor: tuple[float, ...] | None = quantity(
        None, "1", -10.0, 10.0, "by which the current is multiplied at each time, at every depth; none: 1"
    )
    turn_deg: tuple[float, ...] | None = quantity(
        None, "deg", -3600.0, 3600.0, "by which the current is turned at each time, from east to north; none: 0"
    )


class Water(Block):
    density: float = quantity(1026.0, "kg/m^3", 900.0, 1100.0, "density of the water", "sea water")
    viscosity: float = quantity(1.2e-3, "Pa s", 1e-4, 1e-2, "dynamic viscosity", "sea water at 13 deg C")
    current: tuple[float, float] = quantity((0.0, 0.0), "m/s", -10.0, 10.0, "current at the surface, east and north")
    current_gradient: tuple[float, float] = quantity(
        (0.0, 0.0), "1/s", -1.0, 1.0, "growth of the current per metre of depth, east and north", "Westin (140)"
    )
    current_frame: CurrentFrame = choice(
        CurrentFrame.WORLD,
        "world: current and its gradient are east and north; heading: ahead and to port of the heading of the start, "
        "so that a current abeam stays abeam whatever the heading of the recorded motion is",
    )
    current_table: CurrentTable = choice(CurrentTable(), "current by depth, in place of current and current_gradient")
    current_variation: CurrentVariation = choice(CurrentVariation(), "slow change of the current with time")
    turbulence: Turbulence = choice(Turbulence(), "turbulence, the same everywhere at a time")
    waves: Waves = choice(Waves(), "waves")
    ramp: float = quantity(
        20.0, "s", 0.0, 3600.0, "time over which waves and turbulence grow from the static start, which has none"
    )
