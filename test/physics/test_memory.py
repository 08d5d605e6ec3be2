"""What carries over from step to step: kept and taken back whole, restored by a halt, enough to go on from."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.physics import ancf
from cable_sim_ros.physics.inputs import push_motion
from cable_sim_ros.physics.state import MEMORY, NOW, SLOTS, STEP, TICK, checkpoint, make_state, restore
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.simulator import Simulator, SolverError

WRITTEN = [ancf.LENGTH, ancf.PER_LENGTH, ancf.EXTRA_NOW, *range(ancf.FLOW_0, ancf.FLOW_RATE_1 + 1)]  # by gather()
pytestmark = pytest.mark.check


def leaves(record, kind: np.dtype = MEMORY, name: str = "") -> dict[str, bytes]:
    """Every number of a record by its full name, as bytes; the gaps between numbers are no part of it."""
    found = {}
    for field in kind.names:
        part = kind[field]
        if part.names:
            found |= leaves(record[field], part, f"{name}{field}.")
        else:
            found[name + field] = np.asarray(record[field]).tobytes()
    return found


def everything(state) -> dict[str, bytes]:
    """All that a step may change and must restore: memory, nodes and where the surfaces are."""
    kept = leaves(state.memory[NOW]) | {"nodes": state.nodes[NOW].tobytes()}
    return kept | {f"surface {i}": row.tobytes() for i, row in enumerate(state.surfaces)}


def scribble(state, random: np.random.Generator) -> None:
    """Any bits into the present."""
    for table in (state.memory, state.nodes):
        present = table[NOW : NOW + 1].view(np.ndarray)
        present[...] = np.frombuffer(random.bytes(present.nbytes), present.dtype).reshape(present.shape)


@given(st.integers(0, 2**32 - 1), st.sampled_from([STEP, TICK]))
@settings(max_examples=50)
def test_taking_back_is_the_identity_whatever_was_written_in_between(seed, slot):
    state, random = make_state(np.linspace(0.0, 1.0, 5), []), np.random.default_rng(seed)
    scribble(state, random)
    before = everything(state)
    checkpoint(state, slot)
    scribble(state, random)
    assert everything(state) != before
    restore(state, slot)
    assert everything(state) == before
    other = STEP + TICK - slot
    assert not any(leaves(state.memory[other])["winch.length"]) and not state.nodes[other, :-1].any(), "left alone"
    assert SLOTS == 3


def heave(sim: Simulator, seconds: float, jump: float = 0.0) -> None:
    """50 Hz of a ship that tows ahead and heaves 1 m with a period of 10 s, and after 0.2 s jumps up [m]."""
    w, speed = 0.2 * np.pi, sim.scene.ship.tow_speed
    for k in range(round(50 * seconds)):
        t = 0.02 * k
        up, rate = np.sin(w * t) + (jump if k >= 10 else 0.0), w * np.cos(w * t)
        push_motion(sim.inputs, round(t * 1e9), [speed * t, 0, up, 0, 0, 0, speed, 0, rate, 0, 0, 0, 1, 1])


@pytest.fixture(scope="module")
def started():
    sim = Simulator(load_scene("full_scale"))
    sim.start()
    return sim, sim.snapshot()


@pytest.fixture
def sim(started):
    sim, saved = started
    sim.restore(saved)
    return sim


def test_a_halt_restores_everything_to_the_bit(sim):
    """The jump cannot be followed: some ticks are halved, one is given up with part of it done."""
    heave(sim, 1.0, jump=30.0)
    with pytest.raises(SolverError):
        for _ in range(40):
            before = everything(sim.state)
            sim.tick()
    assert sim.state.plan[0].done > 0.0, "part of the tick must have been taken"
    after = everything(sim.state)
    assert after.pop("halted") != before.pop("halted")
    assert [name for name in after if after[name] != before[name]] == []
    assert sim.state.now.halted == Flag.NEWTON_FAILED | Flag.HALVED
    with pytest.raises(SolverError):
        sim.tick()
    again = everything(sim.state)
    del again["halted"]
    assert again == before, "a halted run changes nothing"


@pytest.mark.parametrize("jump", [0.0, 1.0], ids=["quiet", "halved"])
def test_a_run_from_a_snapshot_is_the_run_that_was_not_interrupted(sim, jump):
    """Tick by tick, also right after a step that was halved; by another simulator, and by this one again."""
    heave(sim, 1.0, jump)
    frames = sim.run(25)
    assert bool(frames.status[-1] & Flag.HALVED) == bool(jump)
    saved = sim.snapshot()
    whole, end = sim.run(10), everything(sim.state)
    other = Simulator(sim.scene)
    for one in (other, sim):
        one.restore(saved)
        assert np.concatenate([one.run(1) for _ in range(10)]).tobytes() == whole.tobytes()
        assert everything(one.state) == end


def digest(model) -> str:
    """Of every array of a Model."""
    found = hashlib.sha256()
    for part in model:
        found.update(part.tobytes() if isinstance(part, np.ndarray) else digest(part).encode())
    return found.hexdigest()


def kept(model) -> str:
    """Digest of a Model but for the rows of its elements that every assembly writes first."""
    elements = model.line.elements.copy()
    elements[:, WRITTEN] = 0.0
    return digest(model._replace(line=model.line._replace(elements=elements)))


def test_a_run_leaves_the_model_as_it_was(sim):
    before = kept(sim.model)
    heave(sim, 1.0, jump=1.0)
    sim.run(30)
    assert kept(sim.model) == before
    other = sim.model.line.settings.copy()
    other["tolerance"] *= 2.0
    assert digest(sim.model._replace(line=sim.model.line._replace(settings=other))) != before
