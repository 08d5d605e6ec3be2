"""A bag whose journal somebody has rewritten, every checksum right: replayed as far as it holds, never ok, never for
ever, and what does not hold is said."""

import json

import pytest

from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.recordings.journal import MSGTYPE, encoded
from cable_sim_ros.io.sources.recorded_tow import read_tow
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.simulator import Simulator

pytestmark = pytest.mark.trust


@pytest.fixture(scope="module")
def tow(tmp_path_factory):
    """Recorded: 30 ticks under a heave and a plan."""
    folder = tmp_path_factory.mktemp("recorded")
    offline.run(
        "side_scan", heave=(0.5, 8.0), duration=0.6, winch="0 hold, 0.2 rate 0.2", every=0.02, step="fixed", out=folder
    )
    return read_tow(folder / "tow")


@pytest.fixture
def replayed(tow, monkeypatch):
    """The replay of the bag with other entries; change: is handed them as dicts."""
    monkeypatch.setattr(Simulator, "warm_up", lambda self, progress=None: 0.0)

    def replayed(change):
        entries = [json.loads(STORE.deserialize_cdr(data, MSGTYPE).data) for data in tow.journal]
        change(entries)
        monkeypatch.setattr(tow, "journal", [encoded(entry) for entry in entries])
        monkeypatch.setattr(offline, "find_bag", lambda bag: bag)
        monkeypatch.setattr(offline, "read_tow", lambda path, topics=None: tow)
        return offline.replay("bag")

    return replayed


def test_as_it_was_recorded_it_is_the_run(replayed):
    found = replayed(lambda entries: None)
    assert found.verdict.state == "ok" and found.metrics["ticks"] == found.metrics["recorded_ticks"] == 30


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda entries: entries.append(entries[1]), "entry 1 is there twice, the second is left out"),
        (lambda entries: entries[-1].update(tick=10**7), "the journal says 10000000 ticks from 1.000 s (start) on"),
        (lambda entries: entries[0]["start"].update(state="UEsDBA=="), "its end is missing"),
        (lambda entries: entries[0]["start"].update(time=2**62), "30 ticks are in the bag and"),
        (lambda entries: entries[0]["start"].update(position=[1e9, 1e9]), "30 ticks are in the bag and"),
        (lambda entries: entries[0]["start"].update(cause="restore"), "'memory' is missing"),
        (lambda entries: entries[1].update(set={"winch.command_timeout": -1}), "refused here"),
        (lambda entries: entries[1].update(set={"no.such": 1}), "refused here"),
        (lambda entries: entries.clear(), "the bag has no journal"),
        (lambda entries: entries.__delitem__(0), "the journal has no start to begin from"),
    ],
)
def test_what_does_not_hold_is_said(replayed, change, text):
    found = replayed(change)
    report = [*found.metrics["replay_faults"], *(str(reason) for reason in found.verdict.reasons)]
    assert any(text in fault for fault in report), report
    assert found.metrics["ticks"] <= 2_030
    if "no journal" not in text:
        assert found.verdict.code in (1, 4)
