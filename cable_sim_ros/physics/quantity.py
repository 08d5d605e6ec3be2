"""One declaration per number: unit, range, default and source stand once, on the declaring line.

A :class:`Block` is a group of scene parameters declared beside the physics that uses them. The same
declaration feeds the check at load, the ROS parameter descriptor and the manual.
"""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

REQUIRED = ...


class Block(BaseModel):
    """Base of every group of scene parameters: frozen, no unknown keys, no NaN or infinity."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, use_enum_values=False)


def quantity(default: Any, unit: str, low: float | None, high: float | None, doc: str,
             source: str = "", *, above: float | None = None, configure: bool = True) -> Any:
    """Declare one scene number.

    default: value, or REQUIRED; unit: SI unit ("1" for a pure number); low, high: closed bounds
    (None = open end), for a vector they hold for each component; above: strict lower bound in place of
    ``low``; doc: one sentence; source: document and equation or table; configure: True when a change
    needs a new configure (a read-only ROS parameter).
    """
    extra = {"unit": unit, "low": low, "high": high, "above": above, "source": source, "configure": configure}
    return Field(default, description=doc, json_schema_extra=extra)
