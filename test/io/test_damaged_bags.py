"""Damaged bags: what is said of them, both ways of reading, exit codes. Many cuts, flips and giants: stress I10, S3."""

import tracemalloc
import warnings

import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from cable_sim_ros.io.bags.bag import BagError, BagReader, BagWriter, Damage, DamageWarning, read_bag, read_metadata
from cable_sim_ros.io.bags.mcap_file import McapFile, Unreadable
from cable_sim_ros.io.recordings.recorder import MAX_MESSAGE, Recorder
from cable_sim_ros.io.recordings.recovery import recover
from cable_sim_ros.io.sources.recorded_tow import read_motion
from verification.stress.bags import IMU, TOPIC, chunks_of, known_bag, mcap_of

pytestmark = pytest.mark.check

COUNT = 600


@pytest.fixture
def bag(tmp_path):
    known_bag(tmp_path / "bag", COUNT)
    return tmp_path / "bag"


def spoil(bag, at, new=b"\xff\xff\xff\xff"):
    with open(mcap_of(bag), "r+b") as file:
        file.seek(at)
        file.write(new)


def damaged_read(bag):
    damage = Damage()
    return [m.time // 10_000_000 for m in read_bag(bag, damage)], damage


@pytest.mark.parametrize("index", ["with its index", "without"])
def test_one_bad_chunk_costs_one_chunk(bag, index):
    chunks = chunks_of(bag)
    first, _, lost = chunks[3]
    spoil(bag, first + 200)
    if index == "without":
        file = mcap_of(bag)
        file.write_bytes(file.read_bytes()[: chunks[-1][1]])
    read, damage = damaged_read(bag)
    gone = [m.time // 10_000_000 for m in lost]
    assert read == [k for k in range(COUNT) if k not in gone] and read[0] == 0 and read[-1] == COUNT - 1
    assert damage.chunks_lost == 1 and damage.bytes_lost == chunks[3][1] - first
    assert f"at byte {first} of bag_0.mcap" in damage.messages[0]
    with BagReader(bag) as reader:
        assert len(list(reader)) == len(list(reader)) and reader.damage == damage  # counted once
    assert str(damage).startswith(f"bag '{bag}' is damaged: ") and str(damage).endswith("the rest was read")


@pytest.mark.parametrize("part", ["opcode", "length", "both chunks' heads and what is between"])
def test_a_walk_finds_the_next_chunk_behind_a_bad_head(bag, part):
    chunks = chunks_of(bag)
    first, behind, _ = chunks[3]
    file = mcap_of(bag)
    file.write_bytes(file.read_bytes()[: chunks[-1][1]])
    bad = {"opcode": (first, b"\x63"), "length": (first + 3, b"\xff\xff")}
    spoil(bag, *bad.get(part, (first, bytes(behind + 1500 - first))))
    read, damage = damaged_read(bag)
    gone = {m.time // 10_000_000 for chunk in chunks[3 : 5 if part[0] == "b" else 4] for m in chunk[2]}
    assert read == [k for k in range(COUNT) if k not in gone] and damage.chunks_lost == 1


def test_a_bad_index_costs_no_message(bag):
    at = chunks_of(bag)[-1][1]
    spoil(bag, mcap_of(bag).stat().st_size - 60)
    read, damage = damaged_read(bag)
    assert read == list(range(COUNT)) and damage and damage.chunks_lost == 0
    file = mcap_of(bag)
    file.write_bytes(file.read_bytes()[:at])
    read, damage = damaged_read(bag)
    assert read == list(range(COUNT)) and "ends without its index" in str(damage)


def test_times_of_a_chunk_that_are_wrong_do_not_mix_the_order(bag):
    """An index can say what it likes: order is that of the messages."""
    with BagReader(bag) as reader:
        late = reader.files[0].pieces[2]
        reader.files[0].pieces[2] = late._replace(first=10**18)
        times = [m.time for m in reader]
        assert times == sorted(times) and "the times of a chunk are not those that it says" in str(reader.damage)


def test_messages_outside_of_chunks_are_read(tmp_path):
    from mcap.writer import Writer

    with open(tmp_path / "plain.mcap", "wb") as out:
        writer = Writer(out, use_chunking=False)
        writer.start("ros2")
        channel = writer.register_channel("/a", "cdr", writer.register_schema(IMU, "ros2msg", b""))
        for k in range(500):
            writer.add_message(channel, k, bytes(100), k)
        writer.finish()
    whole = (tmp_path / "plain.mcap").read_bytes()
    for cut in (len(whole), 30_000):
        (tmp_path / "plain.mcap").write_bytes(whole[:cut])
        damage = Damage()
        times = [m.time for m in read_bag(tmp_path / "plain.mcap", damage)]
        assert times == list(range(len(times))) and len(times) == (500 if cut == len(whole) else 228)
        assert bool(damage) == (cut < len(whole))
    data = bytearray(whole)
    data[15_003] = 0xFF  # somewhere in the middle
    (tmp_path / "plain.mcap").write_bytes(data)
    assert 497 <= len(list(read_bag(tmp_path / "plain.mcap", Damage()))) <= 500


def test_metadata_that_is_damaged_costs_no_message(bag):
    text = (bag / "metadata.yaml").read_text()
    for new, said in (
        ("", "metadata.yaml: TypeError"),
        (text.replace("- bag_0.mcap", "- other.mcap"), "names files that are not there"),
        (text.replace("- bag_0.mcap", "- 5"), "relative_file_paths is not a list of file names"),
        (text.replace("scene: made up", "scene: [1]"), "custom_data is not a table of texts"),
        (text.replace("scene: made up", "scene: other"), "metadata.yaml says another scene than the recording itself,"),
        ("a: [", "metadata.yaml: expected the node content"),
        ("[" * 20_000, "metadata.yaml: brackets or indentation are nested deeper than 50 levels in line 1"),
        ("#" * 1_100_000, "metadata.yaml is larger than"),
    ):
        (bag / "metadata.yaml").write_text(new)
        with BagReader(bag) as reader:
            assert len(list(reader)) == COUNT and said in str(reader.damage), reader.damage
            assert reader.custom_data == {"scene": "made up"}  # the MCAP file has it too
        if "names files" not in said and "another scene" not in said:
            with pytest.raises(BagError, match="is not a bag directory"):
                read_metadata(bag)
    (bag / "metadata.yaml").unlink()
    read, damage = damaged_read(bag)
    assert len(read) == COUNT and "No such file" in str(damage)


def test_who_does_not_ask_for_the_damage_is_warned(bag):
    spoil(bag, 5000)
    with pytest.warns(DamageWarning, match="is damaged: .* the rest was read"):
        list(read_bag(bag))
    with pytest.warns(DamageWarning):
        list(read_motion(bag))
    with warnings.catch_warnings(action="error"):
        list(read_bag(bag, Damage()))


def test_inputs_of_megabytes_are_left_out_and_counted(tmp_path):
    with BagWriter(tmp_path / "bag") as writer:
        for k, size in enumerate((348, 2_000_000, 348)):
            writer.add(TOPIC, IMU, k, bytes(size))
    damage = Damage()
    assert [time for time, *_ in read_motion(tmp_path / "bag", damage=damage)] == [0, 2]
    assert damage.messages == [f"messages of '{TOPIC}' above 1 MB are left out"]


def test_what_is_no_mcap_file_is_named(tmp_path):
    for content, why in ((b"", "it is empty"), (b"x" * 3000, "it is no MCAP file")):
        (tmp_path / "x.mcap").write_bytes(content)
        with pytest.raises(Unreadable, match=why):
            McapFile(tmp_path / "x.mcap")
        with pytest.raises(BagError, match=rf"x.mcap' cannot be read \(x.mcap: {why}\): nothing was read"):
            list(read_bag(tmp_path / "x.mcap"))


def test_exit_codes_of_recover(bag, tmp_path):
    def recovered(name):
        done = CliRunner().invoke(commands.main, ["recover", str(bag), str(tmp_path / name)])
        return done.exit_code, done.output

    code, said = recovered("whole")
    assert code == 0 and f"{COUNT} messages over 5.99 s" in said and "nothing is missing" in said
    spoil(bag, 5000)
    code, said = recovered("part")
    assert code == 3 and "is damaged: " in said and "the rest was read" in said
    left = [m.time for m in read_bag(tmp_path / "part")]
    assert 0 < len(left) < COUNT and left[-1] == (COUNT - 1) * 10_000_000
    code, said = recovered("part")
    assert code == 2 and "exists already" in said
    mcap_of(bag).write_bytes(mcap_of(bag).read_bytes()[:60])
    code, said = recovered("none")
    assert code == 2 and "holds no message of an .mcap file that can be read" in said
    assert not (tmp_path / "none").exists()


def test_a_recovery_to_a_full_disk_says_so(bag, tmp_path, monkeypatch):
    def full(self):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(BagWriter, "flush", full)
    with pytest.raises(BagError, match=r"cannot be written \(No space left on device\): it holds the first \d+ mess"):
        recover(bag, tmp_path / "out")


def test_a_command_that_read_a_damaged_bag_leaves_with_code_3(monkeypatch):
    def reads_twice():
        for _ in range(2):
            warnings.warn("bag 'x' is damaged", DamageWarning, stacklevel=1)
        return "figures"

    monkeypatch.setattr(commands, "manual_text", reads_twice)
    with warnings.catch_warnings(action="always"):
        done = CliRunner().invoke(commands.main, ["manual"])
    assert done.exit_code == 3 and "figures" in done.output
    assert done.output.count("warning: bag 'x' is damaged") == 1


# ---- recording


def test_a_full_disk_names_the_file(tmp_path):
    with BagWriter(tmp_path / "bag") as writer:
        writer._file._file.close()
        writer._file._file = open("/dev/full", "wb", buffering=0)
        writer.add("/a", IMU, 1, b"")
        with pytest.raises(OSError, match="No space left on device: '/dev/full'"):
            writer.flush()
        writer.abort()


def test_a_long_recording_takes_no_more_memory(tmp_path):
    """An hour has some ten thousand chunks; here a thousand, of which the library would keep 1 MB."""
    with BagWriter(tmp_path / "bag") as writer:
        data = bytes(300)
        for k in range(1200):
            for topic in range(8):
                writer.add(f"/{topic}", IMU, k, data)
            writer.flush()
            if k == 200:
                tracemalloc.start()
        grown = tracemalloc.get_traced_memory()[0]
        tracemalloc.stop()
    assert grown < 50_000
    with McapFile(mcap_of(tmp_path / "bag")) as file:
        assert len(file.pieces) == 1200 and not file.losses and not file.cut_off


def test_messages_to_be_kept_are_not_the_ones_that_are_dropped(tmp_path, monkeypatch):
    monkeypatch.setattr("cable_sim_ros.io.recordings.recorder.KEPT_SIZE", 20)
    recorder = Recorder(tmp_path / "bag", queue_size=10, poll_s=30.0)  # the thread sleeps until closed
    for k in range(100):
        recorder.put("/a", IMU, k, b"", keep=k % 10 == 0)
    assert recorder.stats()[:3] == (0, 80, 20) and recorder.stats().kept_dropped == 0
    for k in range(100, 115):
        recorder.put("/b", IMU, k, b"", keep=True)
    stats = recorder.close()
    assert (stats.written, stats.dropped, stats.kept_dropped) == (30, 85, 5)
    times = [m.time for m in read_bag(tmp_path / "bag")]
    assert times == [50, 60, 70, 80, *range(89, 115)]


def test_a_message_of_megabytes_is_refused_and_the_queue_has_a_size_in_bytes(tmp_path, monkeypatch):
    monkeypatch.setattr("cable_sim_ros.io.recordings.recorder.QUEUE_BYTES", 1000)
    recorder = Recorder(tmp_path / "bag", poll_s=30.0)
    recorder.put("/a", IMU, 0, bytes(MAX_MESSAGE + 1))
    assert "a message of '/a' has 16 MB, above the limit of 16 MB: it is not recorded" in recorder.stats().error
    for k in range(1, 6):
        recorder.put("/a", IMU, k, bytes(400))
    stats = recorder.close()
    assert (stats.written, stats.dropped, stats.errors) == (2, 4, 1)
