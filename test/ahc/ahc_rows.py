"""Rows and results of the AHC benchmark that no simulation made, and its command."""

from functools import partial

from calling import cable_sim

from cable_sim_ros.tools.ahc import definition

call = partial(cable_sim, "ahc")


def row_of(entrant, cell, figures, twin, state="ok"):
    place = {"scene": cell.scene, "motion": cell.motion, "class": cell.condition, "seed": definition.seed(cell.motion)}
    rank = "built-in" if entrant == "hold" else "external"
    head = {"entrant": entrant, "rank": rank, **place, "state": state, "reason": ""}
    return {**head, "figures": figures, "twin": twin}


def result_of(rows, version=definition.VERSION, **changed):
    head = {"benchmark": version, "definition": definition.digest(version), "product": "0.2.0", "commit": "abc1234"}
    return {**head, "rows": rows, **changed}
