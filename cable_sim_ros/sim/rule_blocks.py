"""What a scene says of the rules on watch: a set by name, and thresholds. docs/rules.md."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from ..physics.parameter import Block, choice, quantity


class RuleSet(str, Enum):
    """Which rules are watched."""

    NONE = "none"
    WATCH = "watch"  # those whose threshold the scene gives
    UNOLS_3HZ = "unols_3hz"  # and what the research fleet asks for where tension is logged at 3 Hz
    UNOLS_20HZ = "unols_20hz"  # and at 20 Hz, for the lower factors of safety


class Rules(Block):
    """Thresholds; a rule without its threshold is not watched. None changes the tow."""

    set: RuleSet = choice(
        RuleSet.NONE,
        "none; watch: the rules whose threshold is given here; unols_3hz, unols_20hz: these, with rate of the tension "
        "and D/d of the research fleet",
        "docs/rules.md; UNOLS RVSS, appendix A",
    )
    breaking_load: float | None = quantity(
        None, "N", 1e-3, 1e9, "breaking load of the cable; none: the least cable.breaking_load of its sections"
    )
    factor_of_safety: float | None = quantity(None, "1", 1.0, 50.0, "breaking load over the working load")
    working_load: float | None = quantity(
        None, "N", 1e-3, 1e9, "largest tension in work; none: breaking load over factor_of_safety"
    )
    tension_rate: float | None = quantity(
        None, "Hz", 0.01, 1000.0, "rate at which the tension is read for working_load; none: any time step"
    )
    sheave_ratio: float | None = quantity(
        None, "1", 1.0, 1000.0, "least D/d: root diameter of the sheave over the diameter of the cable"
    )
    wire_ratio: float | None = quantity(
        None, "1", 1.0, 1e4, "least D/d1: root diameter of the sheave over wire_diameter"
    )
    wire_diameter: float | None = quantity(None, "m", 1e-5, 1.0, "largest strand or armour wire of the cable, d1")
    bend_radius: float | None = quantity(
        None, "m", 1e-3, 20.0, "least radius of the cable's centreline on drum and sheave"
    )
    turns_left: float | None = quantity(None, "1", 0.0, 1e4, "least turns of cable left on the drum")
    slack_tension: float | None = quantity(None, "N", -1e6, 1e7, "least tension along the cable, in any time step")
    snap_tension: float | None = quantity(
        None, "N", 0.0, 1e9, "largest tension at the sheave within snap_time of cable below slack_tension"
    )
    snap_time: float = quantity(1.0, "s", 0.0, 60.0, "time after slack in which a peak of the tension is a snap")
    lifted_fraction: float | None = quantity(
        None, "1", 0.0, 1.0, "largest part of the wrap on the sheave that carries no load"
    )
    groove_margin: float | None = quantity(
        None, "m", -1.0, 1.0, "least distance of the cable below the top of the groove; 0: it is at the rim"
    )
    saturated_share: float | None = quantity(
        None, "1", 0.0, 1.0, "largest share of a tick in which rate, torque or power is at its limit"
    )
    brake_rise: float | None = quantity(None, "K", 0.1, 2000.0, "largest rise of the brake's temperature by its heat")
    brake_heat_capacity: float | None = quantity(
        None, "J/K", 1.0, 1e9, "heat capacity of what the brake heats, for brake_rise"
    )
    brake_cooling_time: float | None = quantity(
        None, "s", 1.0, 1e6, "time constant with which the brake cools; none: it does not"
    )
    cycle_constant: float | None = quantity(
        None, "1", 1e-12, 1e30, "K of the curve N = K R^-m: N cycles of the range R of tension over breaking load"
    )
    cycle_exponent: float | None = quantity(None, "1", 1.0, 20.0, "m of that curve")
    cycle_least: float = quantity(
        1e-3, "1", 0.0, 0.5, "ranges of tension below this share of the breaking load are not counted"
    )
    bend_life: float | None = quantity(
        None, "1", 1.0, 1e9, "bendings over the sheave (straight, bent, straight) that the cable bears"
    )
    damage: float = quantity(1.0, "1", 1e-9, 1e6, "largest sum of damage, of tension and of bending")


class Fleet(NamedTuple):
    """What a set asks for beside the thresholds of the scene."""

    tension_rate: float  # Hz
    sheave_ratio: float = 40.0
    wire_ratio: float = 400.0


# requirements by group in the overview of UNOLS RVSS appendix A by Swensen (Oregon State University); the factors of
# safety that part the groups do not stand in it: the scene gives the factor
FLEETS = {RuleSet.UNOLS_3HZ: Fleet(3.0), RuleSet.UNOLS_20HZ: Fleet(20.0)}


def tension_rate(rules: Rules) -> float | None:
    """Rate [Hz] at which the tension is read; None: any time step."""
    fleet = FLEETS.get(rules.set)
    return fleet.tension_rate if rules.tension_rate is None and fleet is not None else rules.tension_rate


def sheave_ratios(rules: Rules) -> tuple[float | None, float | None]:
    """Least D/d and D/d1."""
    fleet = FLEETS.get(rules.set)
    if fleet is None:
        return rules.sheave_ratio, rules.wire_ratio
    return rules.sheave_ratio or fleet.sheave_ratio, rules.wire_ratio or fleet.wire_ratio


def slowest_tick(rules: Rules) -> float:
    """Longest tick [s], in whole milliseconds, that has a tension for every reading."""
    rate = tension_rate(rules)
    return 1.0 if rules.set is RuleSet.NONE or rate is None else max(1e-4, int(1e3 / rate + 1e-9) * 1e-3 or 1e-4)
