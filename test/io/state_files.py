"""State files with other content and a checksum that is right again, for the tests of what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from cable_sim_ros.sim.npz_bytes import npz, sealed, text


def members_of(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as archive:
        return {name: archive[name] for name in archive.files}


def rewritten(source: Path, target: Path, **members) -> Path:
    """The file with some members replaced, by arrays or texts; None: left out."""
    arrays = members_of(source) | {k: text(v) if isinstance(v, str) else v for k, v in members.items()}
    target.write_bytes(sealed(npz({name: array for name, array in arrays.items() if array is not None})))
    return target


def with_notes(source: Path, target: Path, change) -> Path:
    """The file with its notes changed."""
    notes = json.loads(bytes(members_of(source)["notes"]))
    change(notes)
    return rewritten(source, target, notes=json.dumps(notes))
