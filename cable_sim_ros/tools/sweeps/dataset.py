"""The rows of a sweep as one data set: what was varied as coordinates, figures with units, provenance as attributes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import told_as
from ...files import whole
from ...physics.parameter import declaration
from ...sim.scene import Scene
from ...version import __version__
from ..report.subject import Table
from ..report.sweep_page import Many, write_sweep_page
from .figures import FIGURES, MEANINGS, RULE, unit_of
from .store import EXTRA, StoreError
from .sweep import Swept
from .sweep_file import SweepPlan
from .worker import AGAIN

if TYPE_CHECKING:
    import xarray


WORDS = ("verdict", "reasons", "error", "warnings", "key")  # columns of text
NUMBERS = ("cpu_s", "simulated_s")


def names_of(swept: Swept) -> list[str]:
    """Figures of the rows, in the order of FIGURES, then rules: that of the rows is another once they were kept."""
    there = {name for row in swept.rows for name in row} - {*WORDS, *NUMBERS, "flags", "rule_units", AGAIN}
    return [*(name for name in FIGURES if name in there), *sorted(there.difference(FIGURES))]


def rule_units(swept: Swept) -> dict[str, str]:
    """Unit of each rule on watch."""
    return {name: unit for row in swept.rows for name, unit in row.get("rule_units", {}).items()}


def dataset(swept: Swept) -> xarray.Dataset:
    """Dimension `case`; coordinates: what was varied; variables: figures [case], NaN where a run gave none, verdict,
    reasons, error. Raises StoreError where xarray is missing."""
    missing = f"the data set is made with xarray, which is not installed: rows are kept; {EXTRA}"
    with told_as(StoreError, missing, of=ImportError):
        import xarray
    rows, rules = swept.rows, rule_units(swept)
    made = xarray.Dataset(coords={"case": ("case", np.arange(len(rows)), {"long_name": "number of the case"})})
    for key in dict.fromkeys(key for case in swept.cases for key in case.varied):
        made = made.assign_coords({key: ("case", _column([case.varied[key] for case in swept.cases]), _about(key))})
    for name in names_of(swept):
        values = [row.get(name, np.nan) for row in rows]
        meaning = MEANINGS.get(name, f"rule on watch: {name.removeprefix(RULE)}")
        made[name] = ("case", np.array(values, float), {"units": unit_of(name, rules), "long_name": meaning})
    for name in sorted({name for row in rows for name in row["flags"]}):
        counts = [row["flags"].get(name, 0) for row in rows]
        made[f"flag.{name}"] = ("case", np.array(counts, float), {"units": "1", "long_name": f"ticks with flag {name}"})
    for name in WORDS:
        made[name] = ("case", np.array([row[name] for row in rows], dtype=str))
    for name in NUMBERS:
        made[name] = ("case", np.array([row[name] for row in rows], float), {"units": "s"})
    made.attrs = {
        "title": swept.plan.sweep,
        "source": f"cable_sim_ros {__version__}",
        "sweep": json.dumps(swept.plan.model_dump(mode="json")),
        "Conventions": "CF-1.11",
    }
    return made


def write(swept: Swept, folder: Path) -> list[Path]:
    """`sweep.nc`, and `sweep.csv` with one header line, each whole or not at all; answers their paths."""
    data, paths = dataset(swept), [folder / "sweep.nc", folder / "sweep.csv"]
    try:
        with whole(paths[0]) as netcdf, whole(paths[1]) as csv:
            data.to_netcdf(netcdf, engine="h5netcdf")
            data.to_dataframe().to_csv(csv, index_label="case")
    except OSError as error:
        why = f" ({error.strerror})" if error.strerror else ""  # none: words of the HDF5 library for its makers
        raise StoreError(
            f"{folder}: sweep.nc and sweep.csv cannot be written{why}; the rows are kept in {folder / 'rows'}. Another "
            "sweep may be writing there: wait until it has ended, or make room, and start the same command again, or "
            "give another --out"
        ) from None
    return paths


def _about(key: str) -> dict[str, str]:
    """Attributes of what was varied: unit and meaning of a key of the scene."""
    if key == "seed":
        return {"units": "1", "long_name": "seed of waves, turbulence and instruments"}
    item = declaration(Scene, key)
    if item is None:
        return {}
    return {"units": item.unit, "long_name": item.doc} if item.unit else {"long_name": item.doc}


def _column(values: list[Any]) -> np.ndarray:
    plain = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
    return np.array(values, float) if plain else np.array([str(value) for value in values])


def write_report(
    swept: Swept,
    path: Path,
    command: Sequence[str] = (),
    *,
    kind: str = "sweep",
    tables: Sequence[Table] = (),
    notes: Sequence[str] = (),
    doubts: Sequence[str] = (),
) -> Path:
    """Write the report of a sweep and return its path; kind: what it is, as table or envelope; tables: what else was
    found; notes: what a reader must know; doubts: why what was found is doubtful, beside its runs. Raises
    ReportError."""
    names, rules = names_of(swept), rule_units(swept)
    many = Many(
        swept.plan.sweep,
        [case.varied for case in swept.cases],
        swept.rows,
        {name: unit_of(name, rules) for name in names},
        {name: MEANINGS.get(name, f"rule on watch: {name.removeprefix(RULE)}").replace("`", "") for name in names},
        same=_same(swept.plan),
    )
    notes = [f"Rows in {name} could not be read: their cases were computed again." for name in swept.damaged] + [*notes]
    return write_sweep_page(many, path, kind=kind, command=command, notes=notes, tables=tables, doubts=doubts)


def _same(plan: SweepPlan) -> list[tuple[str, str]]:
    """What every run of a sweep has: scene, motion, seconds, seeds, version."""
    rows = [("scene", Path(plan.scene).name)]
    rows += [(key, str(value)) for key, value in plan.settings.items()]
    motions = [Path(one.name).name if one.bag else one.name for one in plan.motions]
    said = ["none: the mean track, so nothing swings" if name == "none" else name for name in motions]
    rows.append(("ship motion", "; ".join(said)))
    if plan.plans != [None]:
        rows.append(("winch plan", "; ".join(words or "none" for words in plan.plans)))
    if plan.setpoints != [None]:
        rows.append(("set-point law", "; ".join(law.value if law else "that of the scene" for law in plan.setpoints)))
    rows.append(("length of each run", f"{plan.duration:g} s" if plan.duration else "as cable-sim run"))
    rows.append(("seeds of what is random", f"1 to {plan.seeds}" if plan.seeds else "those of the scene"))
    rows.append(("time steps", f"{plan.step} by their error" if plan.step == "chosen" else "fixed, one a tick"))
    return [*rows, ("version", f"cable_sim_ros {__version__}")]
