"""Bags of others, by field path: ROS 1, SQLite, MCAP; damaged ones; what is left out is said."""

import re
import struct

import numpy as np
import pytest
import zstandard
from hostile_logs import survive
from made_bags import SECOND, START, joint_state, json_messages, load_pins, mcap_bag, ros1_bag, sqlite_bag, store

from cable_sim_ros.io.bags.bag_writer import BagWriter
from cable_sim_ros.tools.logs.containers import ros_bags
from cable_sim_ros.tools.logs.containers.leaves import Definition, codec
from cable_sim_ros.tools.logs.formats import read_log
from cable_sim_ros.tools.logs.log import LogError


def made(folder, kind, n=30):
    """A file of each kind with load pins of a user's own type."""
    messages, definitions = load_pins(n, 1 if kind.startswith("ros1") else 2)
    path = folder / f"pins.{'bag' if kind.startswith('ros1') else kind}"
    if kind == "mcap":
        mcap_bag(path, messages, definitions)
    elif kind == "db3":
        sqlite_bag(path, messages, definitions)
    else:
        path.write_bytes(ros1_bag(messages, definitions, b"lz4" if kind == "ros1_lz4" else b"none"))
    return path


KINDS = ("mcap", "db3", "ros1", "ros1_lz4")


@pytest.mark.parametrize("kind", KINDS)
def test_a_type_of_ones_own_is_read_by_field_path(kind, tmp_path):
    log = read_log(made(tmp_path, kind))
    assert (log.format, log.records, bool(log.losses), log.notices) == ("bag", 30, False, [])
    pin = log.sources["/load_pin"]
    assert pin.kind == "rig_msgs/msg/LoadPin"
    assert pin.columns["tension"].tolist() == [1000.0 + k for k in range(30)]
    assert pin.columns["flags[2]"].tolist() == [3.0] * 30
    assert np.isnan(pin.columns["raw[1]"]).tolist() == [k % 3 < 2 for k in range(30)]
    assert pin.logged.tolist() == [START + k * SECOND // 10 for k in range(30)]
    assert set(pin.logged - pin.device) == {20_000_000}


@pytest.mark.parametrize("kind", KINDS)
def test_damage_costs_what_is_damaged(kind, tmp_path):
    path = made(tmp_path, kind)
    cuts, flips = survive(ros_bags.read, path.read_bytes(), path)
    assert sum(log is not None and log.records > 0 for log in cuts) > 8
    assert sum(log is not None and log.records > 0 for log in flips) > (60 if kind == "db3" else 100)
    assert any(log and log.losses for log in flips)
    path.unlink()
    made(tmp_path, kind)
    assert not read_log(path).losses


def test_a_bag_of_ros_1_without_its_index_is_whole(read):
    log = read(ros1_bag(*load_pins(20, 1), indexed=False), "a.bag.active")
    assert log.records == 20 and not log.losses
    assert log.notices == ["a.bag.active ends without its index, as of a recording that was cut off"]


def test_a_chunk_of_ros_1_that_is_damaged_costs_that_chunk(read):
    data = bytearray(ros1_bag(*load_pins(32, 1)))
    second = [found.start() for found in re.finditer(b"op=\x05", data)][1]
    data[second - 4 : second] = struct.pack("<I", 2**31)  # the length of a field
    log = read(data)
    assert log.records == 24
    assert log.losses.counts == {"record that cannot be read": 1}


@pytest.mark.parametrize("size", [2**31, 2**32 - 1])
def test_no_memory_is_taken_for_a_size_that_a_file_says(read, size):
    data = ros1_bag(*load_pins(8, 1), b"lz4")
    said = data.index(b"size=") + 5
    log = read(data[:said] + struct.pack("<I", size) + data[said + 4 :])
    assert log.records == 0 and "above the limit" in str(log.losses)


def test_joints_are_columns_by_name(tmp_path):
    types = store()
    kind = "sensor_msgs/msg/JointState"
    names = (("payout", "tension"), ("tension", "payout"), ("payout", "payout"))
    states = (types.serialize_cdr(joint_state(types.types, k, own), kind) for k, own in enumerate(names))
    messages = [("/joints", kind, START + k, bytes(state)) for k, state in enumerate(states)]
    path = tmp_path / "a.mcap"
    mcap_bag(path, messages, {kind: types.generate_msgdef(kind, ros_version=2)[0]})
    columns = read_log(path).sources["/joints"].columns
    assert columns["position[payout]"].tolist()[:2] == [0.0, 2.0]
    assert columns["position[tension]"].tolist()[:2] == [1.0, 1.0]
    assert columns["position[0]"][2] == 2.0 and np.isnan(columns["position[payout]"][2])  # a name that is there twice


def test_a_type_without_a_definition_is_that_of_the_installed_ones_or_is_named(tmp_path):
    types = store()
    pin, definitions = load_pins(2)
    kind = "std_msgs/msg/Float64"
    data = bytes(types.serialize_cdr(types.types[kind](1.5), kind))
    path = tmp_path / "a.db3"
    sqlite_bag(path, [*pin, ("/tension", kind, START, data)], {})
    log = read_log(path)
    assert log.sources["/tension"].columns["data"].tolist() == [1.5]
    (notice,) = log.notices
    assert notice.startswith("/load_pin: 2 messages are left out (rig_msgs/msg/LoadPin: its type")
    assert definitions and "/load_pin" not in log.sources


def test_pictures_services_and_long_arrays_are_left_out_and_said(tmp_path):
    types = store()
    kind = "std_msgs/msg/Float64MultiArray"
    layout = types.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    messages = [
        ("/long", kind, START, types.serialize_cdr(types.types[kind](layout, np.zeros(65)), kind)),
        ("/short", kind, START, types.serialize_cdr(types.types[kind](layout, np.zeros(64)), kind)),
        ("/cam", "sensor_msgs/msg/Image", START, b"\0\1\0\0"),
        ("/add/_service_event", "example/srv/Add_Event", START, b""),
    ]
    path = tmp_path / "a.mcap"
    mcap_bag(path, messages, {kind: types.generate_msgdef(kind, ros_version=2)[0]})
    log = read_log(path)
    assert list(log.sources["/long"].columns) == ["layout.data_offset"]
    assert len(log.sources["/short"].columns) == 65
    said = "\n".join(log.notices)
    for what in ("/long: left out, above 64 elements: data with up to 65", "/cam: 1 messages", "hidden topic"):
        assert what in said
    assert set(log.sources) == {"/long", "/short"}


def test_json_channels_are_read_and_protobuf_ones_named(tmp_path):
    path = tmp_path / "a.mcap"
    mcap_bag(path, json_messages(3), {}, "json", "jsonschema")
    fish = read_log(path).sources["/fish"]
    assert fish.columns["depth"].tolist() == [0.0, 1.5, 3.0] and set(fish.columns) == {"depth", "ok"}
    assert fish.device.tolist() == [(5 + k) * SECOND + 7 for k in range(3)]
    mcap_bag(path, [("/p", "foxglove.Pose", START, b"\x08\x01")], {}, "protobuf", "protobuf")
    log = read_log(path)
    assert not log.sources and "encoded as protobuf" in log.notices[0]


def test_folders_whole_damaged_and_compressed(tmp_path):
    types = store()
    kind = "std_msgs/msg/Float64"
    folder = tmp_path / "bag"
    bag = BagWriter(folder)
    for k in range(5):
        bag.add("/tension", kind, START + k, types.serialize_cdr(types.types[kind](float(k)), kind))
    bag.close()
    assert read_log(folder).sources["/tension"].columns["data"].tolist() == [0, 1, 2, 3, 4]
    (folder / "metadata.yaml").write_text("half: [")
    log = read_log(folder)
    assert log.records == 5 and "metadata.yaml is not used" in log.notices[0]
    (folder / "metadata.yaml").unlink()
    (file,) = folder.glob("*.mcap")
    (folder / (file.name + ".zstd")).write_bytes(zstandard.compress(file.read_bytes()))
    file.unlink()
    assert read_log(folder).records == 5
    with pytest.raises(LogError, match="holds no bag|is of no format"):
        read_log(tmp_path)


def test_a_folder_with_one_damaged_file_gives_the_others(tmp_path):
    for k in range(3):
        made(tmp_path, "mcap").rename(tmp_path / f"part_{k}.mcap")
    (tmp_path / "part_1.mcap").write_bytes(b"nothing")
    log = read_log(tmp_path)
    assert log.records == 60 and list(log.sources) == ["/load_pin"]
    assert log.losses.first["file of the bag that cannot be read"].startswith("part_1.mcap")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("float64[99999999999] x", "array that no message can hold"),
        ("string[100000] x", "array of 100000"),
        ("Own x", "contains itself"),
        ("Empty[] x\n" + "=" * 80 + "\nMSG: a/Empty\n", "list of messages of no bytes"),
        ("?? x", "cannot be read"),
        ("float64 x\n" * 30_000, "more than 200000"),
    ],
)
def test_definitions_that_no_code_is_made_of(text, why):
    with pytest.raises(Definition, match=why):
        codec("a/Own", "ros1", "ros1msg", text)


@pytest.mark.parametrize("name", ["a'/msg/b", "a/b\nimport os", "x", "", "a/msg/__import__('os')"])
def test_names_that_no_code_is_made_of(name):
    with pytest.raises(Definition, match="no name that a type can have"):
        codec(name, "cdr", "ros2msg", "float64 x")


def test_files_are_closed(tmp_path):
    import os

    paths = [made(tmp_path / kind, kind) for kind in KINDS if not (tmp_path / kind).mkdir()]
    before = len(os.listdir("/proc/self/fd"))
    for path in paths * 5:
        read_log(path)
    assert len(os.listdir("/proc/self/fd")) == before
