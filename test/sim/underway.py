"""What tests of a tow share: shipped scenes with other values, what is refused or said of them, a ship on its way."""

import warnings

import numpy as np
import pytest

from cable_sim_ros import ShipMotion, WinchCommand
from cable_sim_ros.io.scenes.load import SceneError, SceneWarning, load_scene, override

LEVEL = (0.0, 0.0, 0.0)


def scene_with(name="full_scale", /, **values):
    """A shipped scene with other values, ``__`` standing for the dot of a key."""
    return override(load_scene(name), {key.replace("__", "."): value for key, value in values.items()})


def refused(make, *given, **named):
    """What is said of the scene that a call refuses to make."""
    with pytest.raises(SceneError) as caught:
        make(*given, **named)
    return str(caught.value)


def cautioned(make, *given, **named):
    """Cautions of a call that makes a scene."""
    with warnings.catch_warnings(record=True, action="always") as caught:
        make(*given, **named)
    assert all(item.category is SceneWarning for item in caught)
    return [item.message.args[0] for item in caught]


def goes_on(sim, ticks, folder):
    """Tick outputs that follow. Taken back, and loaded from a file, the tow makes the same to the last bit."""
    sim.save(folder / "tow.npz")
    saved, loaded = sim.snapshot(), type(sim).load(folder / "tow.npz")
    frames, end = sim.run(ticks), sim.snapshot()
    sim.restore(saved)
    for again in (sim, loaded):
        assert again.run(ticks).tobytes() == frames.tobytes()
        assert [name for name, array in again.snapshot().items() if array.tobytes() != end[name].tobytes()] == []
    return frames


def at_rate(sim, rate, ticks, every=5):
    """Tick outputs of a winch that is given its rate [m/s] again and again."""
    parts = []
    for _ in range(0, ticks, every):
        sim.push(WinchCommand(rate=rate))
        parts.append(sim.run(every))
    return np.concatenate(parts).view(np.recarray)


def sail(sim, t, up=0.0, rate=0.0, attitude=LEVEL, turns=LEVEL, at=(0.0, 0.0), begin=0):
    """Push what the ship does t [s] after ``begin`` [ns], on its way ahead from ``at``: height and its rate, attitude
    and rates in its own axes."""
    speed = sim.scene.ship.tow_speed
    place, velocity = (at[0] + speed * t, at[1], up), (speed, 0.0, rate)
    stamp = begin + round(t * 1e9)
    sim.push(ShipMotion(time_ns=stamp, position=place, velocity=velocity, attitude=attitude, rate=turns))
