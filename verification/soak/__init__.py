"""Soak of the real node under load, faults and hostile neighbours: stimulus, measured, limit. ``cable-sim soak``.

Rows R1 to R11 and S3 to S9; S1 and S2, names and paths of recordings, are tests of the suite (test/io).
"""

from ..stress.verdict import Tests

SOAK = Tests(
    __name__,
    {
        "R1": "pace.idle",
        "R2": "pace.loaded",
        "R3": "pace.hoarded",
        "R4": "faults.stopped",
        "R5": "faults.stepped",
        "R6": "faults.flooded",
        "R7": "pace.hour",
        "R8": "pace.stamp_to_tension",
        "R9": "pace.first_ticks",
        "R10": "faults.too_big",
        "R11": "faults.silent",
        "S3": "hostile.giants",
        "S4": "hostile.discovery",
        "S5": "files.files",
        "S6": "hostile.scans",
        "S7": "hostile.floods",
        "S8": "hostile.foreign",
        "S9": "hostile.policy",
    },
)
