"""Checks of the rules on watch: thresholds that lack what they are compared with, or that watch nothing."""

from __future__ import annotations

from collections.abc import Iterator

from ...physics.winch_drive import DriveModel
from ..problem import Limit, Problem, changed, idle
from ..rule_blocks import FLEETS, Rules, RuleSet, slowest_tick, tension_rate
from ..rules.latch import RULES
from ..rules.watch import breaking_load
from ..scene import Scene

# rule by rule: key with the threshold, what it cannot be judged without, what that is for
NEEDS = (
    ("snap_tension", "slack_tension", "a snap is a peak after slack"),
    ("cycle_constant", "cycle_exponent", "the curve is N = K R^-m"),
    ("cycle_exponent", "cycle_constant", "the curve is N = K R^-m"),
    ("brake_rise", "brake_heat_capacity", "heat alone is no temperature"),
    ("wire_ratio", "wire_diameter", "it counts from the largest strand or wire"),
)
OF_BREAKING_LOAD = ("factor_of_safety", "cycle_constant")
THRESHOLDS = tuple(key for rule in RULES for key in rule.key.split(" or "))


def rule_problems(scene: Scene) -> Iterator[Problem]:
    """What makes a rule on watch senseless."""
    rules = scene.rules
    if rules.set is RuleSet.NONE:
        return

    def wrong(key: str, text: str, remedy: str) -> Problem:
        return Problem(f"rules.{key}", text, remedy)

    value = rules.model_dump()
    if rules.set is RuleSet.WATCH and all(value[key] is None for key in THRESHOLDS):
        why = "= watch, but no threshold is given: nothing would be watched"
        yield wrong("set", why, "Give one, or rules.set: none")
    if rules.factor_of_safety is not None and rules.working_load is not None:
        yield wrong(
            "working_load",
            f"= {rules.working_load:g} N and rules.factor_of_safety = {rules.factor_of_safety:g} were both given: "
            "either makes the other",
            "Leave one of them out",
        )
    if rules.set in FLEETS and rules.factor_of_safety is None and rules.working_load is None:
        yield wrong(
            "factor_of_safety",
            f"is not given, but rules.set = {rules.set.value} reads the tension against the working load",
            "Give the factor that the operator works with, or rules.working_load",
        )
    if breaking_load(scene) is None:
        for key in OF_BREAKING_LOAD:
            if value[key] is not None:
                yield wrong(
                    key,
                    f"= {value[key]:g} counts from a breaking load, and that of a section of the cable is not known",
                    "Give cable.breaking_load, or rules.breaking_load, in N",
                )
    for key, other, why in NEEDS:
        if value[key] is not None and value[other] is None:
            yield wrong(
                key,
                f"= {value[key]:g} cannot be judged without rules.{other}: {why}",
                f"Give rules.{other} too, or leave it out",
            )

    if rules.wire_diameter is not None:
        cable = scene.cable.diameter
        yield from Limit("rules.wire_diameter", rules.wire_diameter, "<", cable, "m", "cable.diameter").problems(
            "no wire is as thick as its cable", "Give the diameter of one strand or wire, in m"
        )
    if scene.drive.model is not DriveModel.MOTOR:
        why = f"drive.model = {scene.drive.model.value} has no brake"
        yield from idle("rules", rules, ["brake_rise"], why, "drive.model: motor")
    yield from fleet_problems(rules)
    yield from rate_problems(scene)


def fleet_problems(rules: Rules) -> Iterator[Problem]:
    """Values that ask for less than the set of that name."""
    fleet = FLEETS.get(rules.set)
    if fleet is None:
        return
    for key, unit in (("tension_rate", "Hz"), ("sheave_ratio", ""), ("wire_ratio", "")):
        if (value := getattr(rules, key)) is not None:
            of_set = f"that of rules.set = {rules.set.value}"
            yield from Limit(f"rules.{key}", value, ">=", getattr(fleet, key), unit, of_set).problems(
                "", "Leave it out, or give rules.set: watch"
            )


def rate_problems(scene: Scene) -> Iterator[Problem]:
    """A tension that is to be read oftener than there are ticks, or that nothing reads."""
    rules, tick = scene.rules, scene.solver.tick
    rate = tension_rate(rules)
    if rate is None:
        return
    if rules.tension_rate is not None and rules.factor_of_safety is None and rules.working_load is None:
        yield Problem(
            "rules.tension_rate",
            f"= {rules.tension_rate:g} Hz, but no working load is given that the tension is read for",
            "Give rules.factor_of_safety or rules.working_load, or leave it out",
        )
        return
    yield from Limit("rules.tension_rate", rate, "<=", 1.0 / tick, "Hz", f"1 in solver.tick = {tick:g} s").problems(
        "peaks between ticks would be missed", f"Give solver.tick (--every) of at most {slowest_tick(rules):g} s"
    )


def rule_warnings(scene: Scene) -> Iterator[Problem]:
    """Thresholds that nobody watches."""
    if scene.rules.set is RuleSet.NONE:
        yield from idle("rules", scene.rules, changed(scene.rules), "rules.set = none", "rules.set: watch")
