"""State files that are crafted, flipped, and flipped below the checksum, each restored by a session in lockstep.

python test/ros/hostile_run.py FLIPS FLIPS_BELOW [SEED]: counts, and a line for whatever should not have happened.
"""

from __future__ import annotations

import json
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "io"))

from hostile_files import crafted, flipped, flipped_inside, members_of
from pytest import MonkeyPatch
from test_saving import Harness

WHOLE = 40  # refusals from one comparison of everything to the next; the others compare the tow and the clock


class Trial:
    """One session that is handed files."""

    def __init__(self, folder: Path) -> None:
        self.it, self.good, self.bad = Harness(MonkeyPatch()), folder / "tow.npz", folder / "bad.npz"
        self.it.feed(0, 300)
        self.it.feed(0, 300, "imu")
        self.it.order(0.3)
        self.it.step(60)
        self.it.order(-0.1)
        self.it.step(5)
        assert self.it.session.save(self.good)[0]
        self.handed = 0

    def state(self) -> bytes:
        session = self.it.session
        state = session.built_sim.state
        parts = [state.memory.tobytes(), state.nodes.tobytes(), f"{session.steps.clock} {session.state}".encode()]
        if self.handed % WHOLE == 1:
            parts += [array.tobytes() for array in session.built_sim.inputs] + [json.dumps(session.notes()).encode()]
        return b"".join(parts)

    def hand(self, what: str, data: bytes, counts: Counter, may_fit: bool) -> None:
        session = self.it.session
        self.bad.write_bytes(data)
        self.handed += 1
        before = self.state()
        try:
            done, text = session.restore(self.bad)
            if not done:
                counts["refused"] += 1
                wrong = "changed" if self.state() != before else "of several lines" if "\n" in text else ""
            else:
                counts["taken"] += 1
                wrong = "" if may_fit else "taken"
                self.it.step(3)
                counts["halted"] += session.state == "halted"
            if wrong:
                counts["WRONG"] += 1
                print(f"{what}: {wrong}: {text}")
            if not done:
                return
        except BaseException:
            counts["TRACEBACK"] += 1
            print(what)
            traceback.print_exc(limit=-4)
        done, text = session.restore(self.good)
        assert done and session.state == "running", text


def main() -> None:
    flips, below = int(sys.argv[1]), int(sys.argv[2])
    rng = np.random.default_rng(int(sys.argv[3]) if len(sys.argv) > 3 else 1)
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        trial = Trial(Path(folder))
        good = trial.good.read_bytes()
        members = members_of(good)
        bits = rng.integers(0, 8 * len(good), flips).tolist()
        for name, files, may_fit in (
            ("crafted", ((what, make()) for what, make in crafted(good)), False),
            ("flipped", ((f"bit {bit}", flipped(good, bit)) for bit in bits), False),
            ("flipped below", ((f"number {k}", flipped_inside(members, rng)) for k in range(below)), True),
        ):
            counts: Counter = Counter()
            for what, data in files:
                trial.hand(what, data, counts, may_fit)
            print(name, dict(counts), flush=True)
        assert trial.it.session.state == "running" and len(trial.it.step(10)) == 10
        trial.it.close()
        print("the session runs on")


if __name__ == "__main__":
    main()
