"""What makes the water of a scene senseless, and what of it will show: tables, steepness, depth, the ship in waves."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf, pi, tanh

import numpy as np

from ...physics.water import CurrentTable, WaveKind, Waves
from ..problem import Limit, Problem, idle
from ..scene import Scene
from ..tables.sea_tables import wave_number

BREAKING = 0.142  # of H/L over tanh(kd): Miche (1944)
STEEPEST = 1.0 / 7.0  # of Hs over the deep-water length of Tp: no sea is that steep
STEEP = 1.0 / 15.0  # seas found are less steep: DNV-RP-C205
SHALLOW = 0.6  # of Hs over the depth: seas break before, Thornton & Guza (1982): H_rms 0.42 of the depth
TICKS = 5  # in the time scale of turbulence
OF_IRREGULAR = {  # keys of waves that a regular one does not have
    "gamma": "one wave has no spectrum",
    "spreading": "one wave has one direction",
    "components": "it is one wave",
    "seed": "a regular wave has nothing by chance",
}
CREST = 0.93  # of Hs over z = 0: the highest crest of a thousand waves, sqrt(2 ln 1000)/4


def sea_problems(scene: Scene) -> Iterator[Problem]:
    """What makes the water senseless."""
    yield from _table_problems(scene)
    yield from _variation_problems(scene)
    yield from _turbulence_problems(scene)
    yield from _wave_problems(scene)


def _ascending(key: str, values: tuple[float, ...], unit: str) -> Iterator[Problem]:
    if len(values) < 2:
        yield Problem(
            key,
            f"has {len(values)} row{'s' if len(values) != 1 else ''}, needs 2 or more to be interpolated",
            "Give at least two, or leave the table out",
        )
        return
    for i, (a, b) in enumerate(zip(values[:-1], values[1:], strict=True)):
        if b <= a:
            yield Problem(
                key,
                f"is not ascending: row {i + 2} with {b:g} {unit} comes after {a:g} {unit}, so that the current "
                "between them is not known",
                "Sort the rows, and give each once",
            )
            return


def _lengths(block: str, first: str, many: int, columns: dict[str, tuple[float, ...] | None]) -> list[Problem]:
    return [
        Problem(
            f"{block}.{name}",
            f"has {len(values)} numbers, {block}.{first} has {many}: which belong together is not known",
            "Give one of each a row",
        )
        for name, values in columns.items()
        if values is not None and len(values) != many
    ]


def _table_problems(scene: Scene) -> Iterator[Problem]:
    water, table, key = scene.water, scene.water.current_table, "water.current_table"
    columns = {name: getattr(table, name) for name in CurrentTable.model_fields if name != "depth"}
    if table.depth is None:
        given = [name for name, values in columns.items() if values is not None]
        if given:
            text = f"is given without {key}.depth: at which depths is not known"
            yield Problem(f"{key}.{given[0]}", text, "Give the depths")
        return
    yield from _ascending(f"{key}.depth", table.depth, "m")
    yield from _lengths(key, "depth", len(table.depth), columns)
    parts = {name for name, values in columns.items() if values is not None}
    if parts not in ({"east", "north"}, {"speed", "towards_deg"}):
        yield Problem(
            f"{key}.depth",
            "is given, but the current there is not known: east and north, or speed and towards_deg, are needed, and "
            f"not both pairs; here {' and '.join(sorted(parts)) or 'none'} {'is' if len(parts) < 2 else 'are'} given",
            "Give one pair; zeros for a part that the current does not have",
        )
    if any((*water.current, *water.current_gradient)):
        yield Problem(
            f"{key}.depth",
            f"is given beside water.current = {list(water.current)} m/s with water.current_gradient = "
            f"{list(water.current_gradient)} 1/s: the current would count twice",
            "Leave one of them out",
        )
    if (bed := scene.seabed.depth) is not None:
        yield from Limit(f"{key}.depth", table.depth[-1], "<=", bed, "m", "seabed.depth", "goes down to").problems(
            "it is the table of another place, or the depth is wrong",
            "Leave out the rows below the seabed, or correct seabed.depth",
        )


def _variation_problems(scene: Scene) -> Iterator[Problem]:
    variation, key = scene.water.current_variation, "water.current_variation"
    columns = {"factor": variation.factor, "turn_deg": variation.turn_deg}
    if variation.time is None:
        given = [name for name, values in columns.items() if values is not None]
        if given:
            yield Problem(f"{key}.{given[0]}", f"is given without {key}.time: when is not known", "Give the times")
        return
    yield from _ascending(f"{key}.time", variation.time, "s")
    yield from _lengths(key, "time", len(variation.time), columns)
    if variation.factor is None and variation.turn_deg is None:
        yield Problem(
            f"{key}.time",
            f"is given, but neither {key}.factor nor {key}.turn_deg: the current would not vary",
            "Give one of them or both, one number a time, or leave the times out",
        )
    water = scene.water
    if not any((*water.current, *water.current_gradient)) and water.current_table.depth is None:
        yield Problem(
            f"{key}.time",
            "is given, but there is no current that it could change",
            "Give water.current or water.current_table, or leave it out",
        )


def _turbulence_problems(scene: Scene) -> list[Problem]:
    turbulence, key = scene.water.turbulence, "water.turbulence"
    why, other = f"{key}.deviation = [0, 0, 0] m/s is no turbulence", f"{key}.deviation, such as [0.03, 0.03, 0.015]"
    names = () if any(turbulence.deviation) else ("time_scale", "components", "seed")
    return idle(key, turbulence, names, why, other)


def _length(waves: Waves, gravity: float, depth: float) -> float:
    return 2.0 * pi / float(wave_number(np.array([2.0 * pi / waves.period]), gravity, depth)[0])


def _wave_problems(scene: Scene) -> Iterator[Problem]:
    waves = scene.water.waves
    key = "water.waves"
    if waves.kind is WaveKind.OFF:
        yield from idle(key, waves, ["height"], f"{key}.kind = off", f"{key}.kind: airy or jonswap")
        return
    if waves.kind is WaveKind.AIRY:
        for name, why in OF_IRREGULAR.items():
            yield from idle(key, waves, [name], f"with {key}.kind = airy {why}", f"{key}.kind: jonswap")
    if waves.height == 0.0:
        text = f"= 0 m, but {key}.kind = {waves.kind.value} asks for waves"
        yield Problem(f"{key}.height", text, "Give the height, or kind: off")
        return
    if scene.gravity == 0.0:
        yield Problem("gravity", "= 0 m/s^2, but there are no waves without it", "Give gravity, or kind: off")
        return
    depth = inf if scene.seabed.depth is None else scene.seabed.depth
    length = _length(waves, scene.gravity, depth)
    if waves.kind is WaveKind.AIRY:
        maximum = BREAKING * length * (tanh(2.0 * pi * depth / length) if depth < inf else 1.0)
        breaks = f"at which a wave of {length:.4g} m ({waves.period:g} s) breaks"
        yield from Limit(f"{key}.height", waves.height, "<=", maximum, "m", breaks).problems(
            "there is no such wave", "Make it lower, or the period longer"
        )
        return
    deep = scene.gravity * waves.period**2 / (2.0 * pi)
    of_deep = f"1/7 of the {deep:.4g} m of waves of the peak period {waves.period:g} s"
    yield from Limit(f"{key}.height", waves.height, "<=", STEEPEST * deep, "m", of_deep).problems(
        "every wave of that sea would break",
        f"Make it at most {STEEP * deep:.3g} m (1/15 of that length, the steepest seas found)",
    )
    shallow = f"{SHALLOW:g} of seabed.depth"
    yield from Limit(f"{key}.height", waves.height, "<=", SHALLOW * depth, "m", shallow).problems(
        "it breaks before", "Make it lower, or correct seabed.depth"
    )


def sea_warnings(scene: Scene) -> Iterator[Problem]:
    """What of waves and turbulence will show in the results."""
    waves, turbulence = scene.water.waves, scene.water.turbulence
    if any(turbulence.deviation):
        key, minimum = "water.turbulence.time_scale", TICKS * scene.solver.tick
        yield from Limit(key, turbulence.time_scale, ">=", minimum, "s", f"{TICKS} ticks").problems(
            "what changes from tick to tick is not followed, its part of the deviation acts as noise",
            "Give a longer one, or a shorter solver.tick",
        )
    if waves.kind is WaveKind.OFF:
        return
    regular = waves.kind is WaveKind.AIRY
    chances = (
        "several water.waves.period some percent apart (a regular wave has no seed)"
        if regular
        else "many seeds (water.waves.seed)"
    )
    yield Problem(
        "water.waves.ship_motion",
        "= independent: waves act on cable and bodies; a ship that is given motion moves as recorded or commanded, "
        "whatever the waves are: how its heave goes with them, and with it the tension's peaks, is by chance",
        f"Let the waves move the ship (--rao), or with motion take the figures of {chances}, or give the waves "
        "alone (--motion none) or the motion alone",
    )
    steep, key = STEEP * scene.gravity * waves.period**2 / (2.0 * pi), "water.waves.height"
    if not regular:
        length = f"1/15 of the length of waves of {waves.period:g} s"
        yield from Limit(key, waves.height, "<=", steep, "m", length).problems(
            "steeper than seas found, and than linear waves are good for", "Check height and period"
        )
    crest = 0.5 * waves.height if regular else CREST * waves.height
    low = scene.sheave.position[2] - scene.sheave.radius + scene.ship.reference_height
    if low > 0.0:
        sheave, lead = "the lowest point of the sheave", f"= {waves.height:g} m brings crests of"
        yield from Limit(key, crest, "<=", low, "m", sheave, lead).problems(
            "cable aboard counts as wet there, as the ship does not rise with them", "Lower waves, or a higher sheave"
        )
