"""Declaring the rows of ros/parameters.py on a node, and changing the few that may change while it runs."""

from __future__ import annotations

import sys
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException

from .parameters import NONE, ParameterError, Row

TYPES = {
    float: ParameterType.PARAMETER_DOUBLE,
    int: ParameterType.PARAMETER_INTEGER,
    bool: ParameterType.PARAMETER_BOOL,
    str: ParameterType.PARAMETER_STRING,
    list: ParameterType.PARAMETER_DOUBLE_ARRAY,
}
HUGE = sys.float_info.max  # a ROS range has no open end
HUGE_INT = 2**63 - 1


def overrides_of(node) -> dict[str, Any]:
    """Values given to this node by parameter files and `-p`; {} where rclpy no longer gives them."""
    given = getattr(node, "_parameter_overrides", None)  # not public, but the only place that knows the unknown names
    return {} if given is None else {name: parameter.value for name, parameter in given.items()}


def descriptor(row: Row) -> ParameterDescriptor:
    """Descriptor with description, unit, source, range and whether a change needs a new configure."""
    text = row.doc + (f" [{row.unit}]" if row.unit not in ("", "1") else "")
    if row.nullable:
        text += f"; {'empty text' if row.kind is str else NONE[row.kind]}: none"
    if row.source:
        text += f" (source: {row.source})"
    result = ParameterDescriptor(
        name=row.name,
        type=TYPES[row.kind],
        description=text,
        read_only=row.configure,
        additional_constraints=row.range_text,
    )
    low = row.above if row.above is not None else row.low
    if row.nullable or (low is None and row.high is None):
        return result  # rclpy holds nan to be out of every range
    if row.kind is float:
        result.floating_point_range = [
            FloatingPointRange(
                from_value=float(-HUGE if low is None else low), to_value=float(HUGE if row.high is None else row.high)
            )
        ]
    elif row.kind is int:
        result.integer_range = [
            IntegerRange(
                from_value=int(-HUGE_INT if low is None else low),
                to_value=int(HUGE_INT if row.high is None else row.high),
                step=1,
            )
        ]
    return result


def declare(node, rows: list[Row]) -> None:
    """Declare every row; ParameterError where rclpy refuses a value."""
    for row in rows:
        try:
            node.declare_parameter(row.name, row.value, descriptor(row))
        except (InvalidParameterTypeException, InvalidParameterValueException) as error:
            raise ParameterError(f"parameter '{row.name}': {error}; {row.range_text}") from None
