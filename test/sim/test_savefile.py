"""Saved simulations: what goes on from a file is what would have gone on, and every refusal."""

from __future__ import annotations

import json
import os
import re
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))

from hostile_files import rewritten
from underway import sail, scene_with

import cable_sim_ros
from cable_sim_ros import WinchCommand
from cable_sim_ros.io.scenes.load import override
from cable_sim_ros.physics.block_tridiagonal import SWAP
from cable_sim_ros.physics.state import NODE_ROWS
from cable_sim_ros.physics.towbody import LineBody
from cable_sim_ros.sim.saved import savefile
from cable_sim_ros.sim.simulator import SaveError, Simulator
from verification.shipped import started

pytestmark = pytest.mark.trust
PLACE = (1e5, -3e4)  # m, in odom


def heave(sim, first: int, last: int) -> None:
    for t in 0.02 * np.arange(first, last):
        sail(sim, t, 0.5 * np.sin(0.8 * t), 0.4 * np.cos(0.8 * t), at=PLACE)


@pytest.fixture(scope="module")
def underway():
    """A tow over a seabed, 0.6 s after its start, with motion and a command still to come."""
    sim = started(scene_with(seabed__depth=150.0, setpoint__algorithm="rigorous_sheave"), time_ns=5, position=PLACE)
    heave(sim, 1, 80)
    sim.push(WinchCommand(rate=0.2))
    sim.run(60)
    sim.set_algorithm("simplified_sheave")
    return sim


@pytest.fixture(scope="module")
def saved(underway, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("saved") / "tow.npz"
    underway.save(path)
    return path


def test_a_run_from_a_file_is_the_run_that_was_not_interrupted(underway, saved):
    begun = underway.snapshot()
    assert underway.state.plan.kept[0] > 0.0 and begun["tangent_factor"].any(), "of a tick before, for later ones"
    whole = underway.run(40)
    underway.restore(begun)
    for face in (Simulator, cable_sim_ros.Simulator):
        sim = face.load(saved)
        assert type(sim) is face and sim.scene == underway.scene
        for name in ("frame", "shape", "contact"):
            assert getattr(sim, name).tobytes() == getattr(underway, name).tobytes(), name
        assert sim.run(15).tobytes() + sim.run(25).tobytes() == whole.tobytes()
        heave(sim, 80, 100)  # and it takes up inputs where it was
        assert sim.tick().tick == 101


def test_a_file_keeps_its_name_and_is_whole_or_not_there(underway, tmp_path):
    path = tmp_path / "no suffix"
    underway.save(str(path))
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    before = path.read_bytes()
    underway.save(path)
    assert path.read_bytes() == before or Simulator.load(path).state.now == underway.state.now
    text = r"gone/tow: cannot be written \(No such file or directory\); nothing was saved. Check the folder, its perm"
    with pytest.raises(SaveError, match=text):
        underway.save(tmp_path / "gone" / "tow")


def test_what_is_no_save_is_refused(saved, tmp_path):
    text = "is no saved simulation; nothing was loaded. Simulator.load takes a file of Simulator.save"
    for name, content in (("scene.yaml", b"name: tow\n"), ("empty", b"")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(SaveError, match=f"{name}: {text}"):
            Simulator.load(tmp_path / name)
    for about in (None, "{}", "3", "no JSON", np.zeros(3)):
        with pytest.raises(SaveError, match=text):
            Simulator.load(rewritten(saved, tmp_path / "other.npz", about=about))
    with zipfile.ZipFile(tmp_path / "bag.zip", "w") as archive:
        archive.writestr("metadata.yaml", "x")
    with pytest.raises(SaveError, match="bag.zip: is no saved simulation"):
        Simulator.load(tmp_path / "bag.zip")
    with pytest.raises(SaveError, match=r"nowhere: cannot be read \(No such file or directory\); nothing was loaded"):
        Simulator.load(tmp_path / "nowhere")


def test_another_layout_of_the_state_is_refused(saved, tmp_path):
    about = json.dumps({"format": savefile.FORMAT, "version": "0.0.9", "layout": "0123"})
    text = (
        r"old.npz: was saved by version 0.0.9 with the state layout 0123, this is version \S+ with [0-9a-f]{12}: its "
        r"numbers would stand for others; nothing was loaded. Load it with version 0.0.9, or start its scene again"
    )
    with pytest.raises(SaveError, match=text):
        Simulator.load(rewritten(saved, tmp_path / "old.npz", about=about))


@pytest.mark.parametrize(
    ("members", "text"),
    [
        ({"nodes": None}, rf"'nodes' is missing, expected f\[{NODE_ROWS}, \d+, 6\]"),
        ({"nodes": np.zeros((8, 2, 6))}, rf"'nodes' is f\[8, 2, 6\] of 8 bytes, expected f\[{NODE_ROWS}, .*"),
        ({"memory": np.zeros(3)}, r"'memory' is f\[3\] of 8 bytes, expected V\[\]"),
        ({"scene": None}, "its scene cannot be read, Unfit"),
        ({"scene": "{"}, "its scene cannot be read, ValidationError"),
        *(({"notes": text}, "its notes cannot be read, .*") for text in ("{", "3", "[" * 10**5, '{"a": ' * 10**5)),
    ],
    ids=lambda value: str(value)[:30],
)
def test_a_member_that_does_not_fit_is_refused(saved, tmp_path, members, text):
    with pytest.raises(SaveError, match=rf"tow.npz: is damaged \({text}\); nothing was loaded. Take another copy, or"):
        Simulator.load(rewritten(saved, tmp_path / "tow.npz", **members))


def test_a_tangent_that_names_a_row_outside_its_block_is_refused(underway, saved, tmp_path):
    factor = underway.snapshot()["tangent_factor"]
    factor[3, 2, SWAP] = 6.0
    with pytest.raises(SaveError, match="is damaged .tangent_factor: a row that no block has.; nothing was loaded"):
        Simulator.load(rewritten(saved, tmp_path / "tow.npz", tangent_factor=factor))


@pytest.mark.parametrize("fraction", [0.1, 0.5, 0.999])
def test_a_file_cut_short_is_refused(saved, tmp_path, fraction):
    data = saved.read_bytes()
    (tmp_path / "cut.npz").write_bytes(data[: int(fraction * len(data))])
    with pytest.raises(SaveError, match=r"cut.npz: is damaged \(its end is missing\); nothing was loaded"):
        Simulator.load(tmp_path / "cut.npz")


def test_a_changed_byte_is_noticed(saved, tmp_path):
    data = bytearray(saved.read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / "bit.npz").write_bytes(data)
    text = r"bit.npz: is damaged \(its checksum is not that of its content: bytes were changed\); nothing was loaded"
    with pytest.raises(SaveError, match=text):
        Simulator.load(tmp_path / "bit.npz")


def test_a_file_without_a_checksum_names_the_version_that_reads_it(saved, tmp_path):
    with np.load(saved) as archive:
        arrays = {name: archive[name] for name in archive.files}
    for name in ("about", "scene", "notes"):  # as versions before the checksum wrote them
        arrays[name] = np.array(bytes(arrays[name]).decode())
    np.savez(tmp_path / "old.npz", **arrays)
    text = (
        rf"old.npz: has no checksum at its end: it is damaged, or of a version {cable_sim_ros.__version__} that wrote "
        r"none; nothing was loaded. Load it with that version, or start its scene again with this one"
    )
    with pytest.raises(SaveError, match=text):
        Simulator.load(tmp_path / "old.npz")


def test_the_same_state_is_the_same_bytes(underway, saved, tmp_path):
    underway_again = Simulator.load(saved)
    underway_again.save(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == saved.read_bytes()


def test_a_save_writes_through_no_link(underway, tmp_path):
    outside = tmp_path / "outside"
    outside.write_text("mine")
    root = tmp_path / "root"
    root.mkdir()
    for name in ("state.npz.part", "state.npz"):
        (root / name).symlink_to(outside)
        underway.save(root / "state.npz")
        savefile.check_place(root / "state.npz")
        assert outside.read_text() == "mine" and not (root / "state.npz").is_symlink()
        assert [p.name for p in root.iterdir()] == ["state.npz"]
        (root / "state.npz").unlink()
    (root / "state.npz.part").mkdir()  # what cannot be removed is refused
    with pytest.raises(SaveError, match=r"state.npz: cannot be written \(.*\); nothing was saved"):
        underway.save(root / "state.npz")


def test_only_a_regular_file_is_read(tmp_path):
    """A pipe would be waited for, for ever; a device has no end."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "to a device").symlink_to("/dev/zero")
    for name, what in (("pipe", "it is a named pipe"), ("to a device", "it is a device"), (".", "it is a folder")):
        path = tmp_path / name
        with pytest.raises(SaveError, match=rf"cannot be read \({what}, .*\); nothing was loaded. Check the path"):
            Simulator.load(path)
    with open(tmp_path / "giant", "wb") as file:
        file.truncate(300_000_000)
    with pytest.raises(SaveError, match="it has 300000000 bytes, at most 256000000 are read"):
        Simulator.load(tmp_path / "giant")


def test_a_state_is_taken_by_a_simulator_of_its_scene_only(underway, saved):
    other = Simulator(underway.scene.model_copy(update={"name": "the same tow under another name"}))
    other.load_state(saved)
    assert other.state.now == underway.state.now and other.frame.tobytes() == underway.frame.tobytes()
    values = {"cable.diameter": 0.018, "winch.max_rate": 2.0, "ship.tow_speed": 2.5, "seabed.depth": 160.0}
    values |= {"towbody.net_weight": 600.0, "setpoint.algorithm": "hold", "water.density": 1020.0}
    other = Simulator(override(underway.scene, values))
    before = other.state.now.copy()
    with pytest.raises(SaveError) as refused:
        other.load_state(saved)
    text = str(refused.value)
    assert text.startswith(f"{saved}: is the state of another scene: ship.tow_speed is ") and "; and 2 more; " in text
    assert re.search(r"water.density is 10\d\d(\.\d)? kg/m\^3 in the file, 1020 kg/m\^3 here", text)
    assert text.endswith("loaded. Start 'full_scale' with the values of the file, or save it anew with those of here")
    other = Simulator(override(underway.scene, values).model_copy(update={"name": "mine"}))
    with pytest.raises(SaveError, match=r"scene it was saved with \('full_scale'\), or start this one \('mine'\)"):
        other.load_state(saved)
    assert other.state.now == before


def test_what_differs_between_scenes_is_named_with_both_values_and_unit(underway):
    scene = underway.scene
    assert savefile.differences(scene, scene) == []
    pod = {"pod": LineBody(at="bare", mass=20.0, net_weight=50.0)}
    found = dict(savefile.differences(scene, scene.model_copy(update={"bodies": pod, "name": "x"})))
    assert found == {"bodies.pod": "bodies.pod is absent in the file, present here"}
    found = dict(savefile.differences(scene, override(scene, {"setpoint.algorithm": "hold"})))
    assert found == {"setpoint.algorithm": "setpoint.algorithm is rigorous_sheave in the file, hold here"}
