"""One declaration per number: unit, range, default and source stand once, on the declaring line.

A :class:`Block` is a group of scene parameters declared beside the physics that uses them. The same
declaration feeds the check at load, the ROS parameter descriptor and the manual.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

REQUIRED = ...
before_checks = model_validator(mode="before")  # of a class method of a Block: what was given -> what is checked


class Block(BaseModel):
    """Base of every group of scene parameters: frozen, no unknown keys, no NaN or infinity, bounds checked."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_enum_values=False, validate_default=True
    )

    @field_validator("*", mode="before")
    @classmethod
    def _numbers_are_numbers(cls, value: Any, info: ValidationInfo) -> Any:
        # pydantic would take "12" and true for numbers; in a scene both are mistakes
        if cls.model_fields[info.field_name].json_schema_extra["unit"]:
            for part in value if isinstance(value, (list, tuple)) else (value,):
                if isinstance(part, (bool, str)):
                    raise PydanticCustomError("not_a_number", "{part} is not a number", {"part": repr(part)})
        return value

    @field_validator("*", mode="after")
    @classmethod
    def _within_bounds(cls, value: Any, info: ValidationInfo) -> Any:
        extra = cls.model_fields[info.field_name].json_schema_extra
        parts = value if isinstance(value, tuple) else (value,)
        outside = [i for i, part in enumerate(parts) if _outside(part, extra)]
        if outside:
            raise PydanticCustomError(
                "out_of_range",
                "outside {interval} {unit}",
                {
                    "interval": interval(extra["low"], extra["high"], extra["above"]),
                    "unit": extra["unit"],
                    "components": outside,
                },
            )
        return value


def quantity(
    default: Any,
    unit: str,
    low: float | None,
    high: float | None,
    doc: str,
    source: str = "",
    *,
    above: float | None = None,
    configure: bool = True,
) -> Any:
    """Declare one scene number.

    default: value, or REQUIRED; unit: SI unit ("1" for a pure number, "" for what is no number); low, high: closed
    bounds (None = open end), for a vector they hold for each component; above: strict lower bound in place of
    ``low``; doc: one sentence; source: document and equation or table; configure: True when a change
    needs a new configure (a read-only ROS parameter).
    """
    extra = {"unit": unit, "low": low, "high": high, "above": above, "source": source, "configure": configure}
    return Field(default, description=doc, json_schema_extra=extra)


def choice(default: Any, doc: str, source: str = "", *, configure: bool = True) -> Any:
    """Declare what of a scene is no number: a word, a switch, a Block or a table of them; see `quantity`."""
    return quantity(default, "", None, None, doc, source, configure=configure)


def again(block: type[Block], name: str, without: str) -> Any:
    """Declare a number of another Block once more, as one that may be left out: its unit, bounds, meaning and source.

    without: what counts where it is none, in words.
    """
    field = block.model_fields[name]
    return Field(None, description=f"{field.description}; none: {without}", json_schema_extra=field.json_schema_extra)


def interval(low: float | None, high: float | None, above: float | None = None) -> str:
    """Bounds as text: ``[0, 5]``, ``(0, 5]`` for a strict lower bound, ``[0, inf)`` for an open end; "" if none."""
    if low is None and high is None and above is None:
        return ""
    left = f"({_plain(above)}" if above is not None else "(-inf" if low is None else f"[{_plain(low)}"
    return f"{left}, inf)" if high is None else f"{left}, {_plain(high)}]"


def _plain(number: float) -> str:
    short = f"{number:g}"
    return short if float(short) == number else repr(number)


def _outside(value: Any, extra: dict) -> bool:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    low, high, above = extra["low"], extra["high"], extra["above"]
    return (
        (above is not None and value <= above)
        or (above is None and low is not None and value < low)
        or (high is not None and value > high)
    )


class Declared(NamedTuple):
    """One declared scene number, flattened: key is dotted (``water.density``), ``<name>`` stands for a free name."""

    key: str
    annotation: Any
    default: Any  # REQUIRED when the scene must give it
    unit: str
    low: float | None
    high: float | None
    above: float | None
    doc: str
    source: str
    configure: bool

    @property
    def interval(self) -> str:
        """Bounds as text, "" when there are none."""
        return interval(self.low, self.high, self.above)


def block_of(annotation: Any) -> tuple[type[Block] | None, bool]:
    """The Block behind an annotation, and whether it is a table of them by free names (``dict[str, Block]``)."""
    if isinstance(annotation, type) and issubclass(annotation, Block):
        return annotation, False
    for part in get_args(annotation):
        if isinstance(part, type) and issubclass(part, Block):
            return part, True
    return None, False


def declaration(block: type[Block], key: str) -> Declared | None:
    """How a key of a block is declared, ``bodies.pod.mass`` or ``towbody.drag_area[0]``; None where it is not."""
    parts = key.partition("[")[0].split(".")
    for one in declared(block):
        own = one.key.split(".")
        if len(own) == len(parts) and all(name in ("<name>", part) for name, part in zip(own, parts, strict=True)):
            return one
    return None


def declared(block: type[Block], prefix: str = "") -> Iterator[Declared]:
    """Every number declared in a block and in the blocks below it, in order of declaration."""
    for name, field in block.model_fields.items():
        inner, table = block_of(field.annotation)
        if inner:
            yield from declared(inner, f"{prefix}{name}.<name>." if table else f"{prefix}{name}.")
            continue
        default = REQUIRED if field.is_required() else field.default
        yield Declared(prefix + name, field.annotation, default, doc=field.description, **field.json_schema_extra)
