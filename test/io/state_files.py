"""State files with other content and a checksum that is right again, for the tests of what is refused."""

from __future__ import annotations

import json
from pathlib import Path

from hostile_files import members_of, rebuilt


def rewritten(source: Path, target: Path, **members) -> Path:
    """The file with some members replaced, by arrays or texts; None: left out."""
    kept = {k: v for k, v in members_of(source.read_bytes()).items() if members.get(k, v) is not None}
    target.write_bytes(rebuilt(kept, **{k: v for k, v in members.items() if v is not None}))
    return target


def with_notes(source: Path, target: Path, change) -> Path:
    """The file with its notes changed."""
    notes = json.loads(bytes(members_of(source.read_bytes())["notes"]))
    change(notes)
    return rewritten(source, target, notes=json.dumps(notes))
