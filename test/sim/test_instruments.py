"""Instruments and faults: what they show against what is, in closed form; what they may not be asked."""

from functools import partial
from math import atan, cos, pi, radians, sin

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from underway import at_rate, cautioned, refused, scene_with

from cable_sim_ros import Simulator, WinchCommand
from cable_sim_ros.io.bags.bag import read_bag
from cable_sim_ros.io.messages.channels import channel_of, decode, numbers_of
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.sensor_models import DEVICES, SIGNALS, TARGETS, FaultKind
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.controller import SHEAVE
from cable_sim_ros.sim.checks.instrument_checks import OF_PATH
from cable_sim_ros.sim.inputs import ShipMotion
from cable_sim_ros.sim.live_parameters import set_live
from cable_sim_ros.sim.rebase import carried_over
from cable_sim_ros.sim.statics.route import StartError
from verification.shipped import started

pytestmark = pytest.mark.trust

TOW = load_scene("full_scale")
ABOARD = {f"instruments.{name}.on": True for name in DEVICES}
MOVING = {"heave": (1.0, 8.0), "duration": 12.0, "step": "fixed", "winch": "5 rate 0.3"}
TICK = 0.01


scene = partial(scene_with, **ABOARD)


def run(motion=None, **values):
    return offline.run(scene(**values), **(MOVING | (motion or {}))).frames


@pytest.fixture(scope="module")
def ideal():
    return run()


def test_ideal_instruments_show_the_truth(ideal):
    f = ideal
    rest = f.ship_position[0, 2]
    for shown, true in (
        (f.mru_heave, f.ship_position[:, 2] - rest),
        (f.mru_heave_rate, f.ship_velocity[:, 2]),
        (f.encoder_payout, f.payout_counter),
        (f.metering_payout, f.payout_counter),
        (f.metering_rate, f.encoder_rate),
        (f.depth_reading, -f.body_position[:, 2]),
        (f.fish_heading, 2.0 * np.arctan2(*f.body_quaternion[:, 2:].T)),
        (f.mru_sheave_position, f.sheave_position),
        (f.mru_sheave_velocity, f.sheave_velocity),
        (f.load_pin[:1], f.contact_resultant[:1]),
        (f.load_pin_tension[:1], f.tension[:1]),
    ):
        assert shown == pytest.approx(true, abs=1e-3, rel=1e-3)
    assert np.ptp(f.payout) > 1.0 and np.ptp(f.mru_heave) > 1.0
    fixes = f.readings_new & 16 > 0
    assert (f.readings_new & 47 == 47).all() and fixes.sum() == 12 and (f.tick[fixes] % 100 == 0).all()
    assert (f.usbl_position[fixes] == f.body_position[fixes]).all()


def test_instruments_change_nothing_but_what_they_show(ideal):
    without = offline.run(TOW, **MOVING).frames
    same = [name for name in without.dtype.names if (ideal[name] == without[name]).all()]
    names = {name if not name.startswith("usbl") else "usbl_position" for name, *_ in SIGNALS}
    assert set(without.dtype.names) - set(same) <= names | {
        "load_pin_tension",
        "readings_new",
        *(f"mru_{name}" for name in SHEAVE),
    }


def rolled(roll, pitch, yaw):
    """Rz Ry Rx of a ship's attitude, and what its rates do in its axes."""
    cr, sr, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch)
    turn = Rotation.from_euler("ZYX", (yaw, pitch, roll)).as_matrix()
    return turn, [[1, 0, -sp], [0, cr, sr * cp], [0, -sr, cr * cp]]


def moved(seed, **values):
    """Tick outputs of a ship that a sum of sines moves in all six directions about a track over ground."""
    what = scene(ship__start_blend=0.5, **values)
    sim, rng = Simulator(what), np.random.default_rng(seed)
    sim.start()
    yaw, speed = radians(what.ship.heading_deg), what.ship.tow_speed
    size = np.array([0.6, 0.6, 1.0, 0.1, 0.05, 0.1]) * rng.uniform(0.3, 1.0, 6)
    w, phase = 2.0 * pi / rng.uniform(6.0, 12.0, 6), rng.uniform(0.0, 2.0 * pi, 6)
    mean = np.array([speed * cos(yaw), speed * sin(yaw), 0.0, 0.0, 0.0, 0.0])
    for i in range(220):
        t = 0.02 * i
        x, v = size * np.sin(w * t + phase) + mean * t + (0, 0, 0, 0, 0, yaw), size * w * np.cos(w * t + phase) + mean
        gyro = rolled(*x[3:])[1] @ v[3:]
        place, attitude, velocity = tuple(x[:3]), tuple(x[3:]), tuple(v[:3])
        stamp = round(t * 1e9)
        sim.push(ShipMotion(time_ns=stamp, position=place, attitude=attitude, velocity=velocity, rate=tuple(gyro)))
    sim.push(WinchCommand(rate=0.4))
    return sim.run(400)[100:]


def level(f, names):
    """Three numbers ahead, to port and up of the ship in the axes of odom."""
    x, y, z, w = f.ship_quaternion.T
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    ahead, port, up = (f[name] for name in names)
    return np.column_stack([np.cos(yaw) * ahead - np.sin(yaw) * port, np.sin(yaw) * ahead + np.cos(yaw) * port, up])


BENT = {  # instruments that are wrong without noise and steps, on a ship that heads south-west
    "ship__heading_deg": 218.0,
    "instruments__mru__position": [3.0, 1.0, 2.0],
    "instruments__mru__lever_error": [2.0, -1.0, 0.5],
    "instruments__mru__heave_period": 25.0,
    "instruments__mru__turn_leak": 0.5,
    "instruments__mru__turn_settling": 2.0,
    "instruments__encoder__slip": 0.03,
    "instruments__metering_sheave__gain": 1.02,
    "instruments__usbl__position": [5.0, -2.0, -4.0],
    "instruments__usbl__lever_error": [0.5, 0.3, -0.2],
    "instruments__usbl__angle_error": [0.01, -0.005, 0.02],
}


@pytest.fixture(scope="module")
def bent():
    return moved(2, **BENT)


@pytest.mark.parametrize("values", [{}, BENT], ids=["ideal", "bent"])
def test_every_rate_is_the_derivative_of_its_place(values, bent):
    f, mru = bent if values else moved(1), ("mru_surge", "mru_sway", "mru_heave")
    without = "usbl_position", "vehicle_position"  # a fix has no rate; there is no vehicle
    placed = [name for name in f.dtype.names if name.endswith("_position") and name not in without]
    pairs = {name: (f[name], f[name.replace("position", "velocity")]) for name in placed}
    pairs |= {name: (f[name], f[f"{name}_rate"]) for name in ("mru_roll", "mru_pitch", "payout")}
    pairs |= {name: (f[f"{name}_payout"], f[f"{name}_rate"]) for name in ("encoder", "metering")}
    pairs["mru"] = level(f, mru), level(f, [f"{name}_rate" for name in mru])
    assert set(placed) == {"ship_position", "sheave_position", "mru_sheave_position", "body_position"}
    for name, (place, rate) in pairs.items():
        wrong = np.diff(place, axis=0) / TICK - 0.5 * (rate[1:] + rate[:-1])
        assert np.abs(wrong).max() < 1e-3 * np.abs(rate).max(), name


@pytest.mark.parametrize("kind", ["", "mru_"])
def test_speeds_ahead_to_port_and_up_are_those_less_the_mean_speed_on_any_heading(bent, kind):
    yaw = 2.0 * np.arctan2(bent.ship_quaternion[:, 2], bent.ship_quaternion[:, 3])  # roll and pitch are small
    x, y, up = bent[f"{kind}sheave_velocity"].T
    assert bent[f"{kind}sheave_ahead_rate"] == pytest.approx(
        np.cos(yaw) * x + np.sin(yaw) * y - TOW.ship.tow_speed, abs=0.02
    )
    assert bent[f"{kind}sheave_port_rate"] == pytest.approx(np.cos(yaw) * y - np.sin(yaw) * x, abs=0.02)
    assert (bent[f"{kind}sheave_up_rate"] == up).all()
    assert abs(bent[f"{kind}sheave_ahead_rate"].mean()) < 0.2 < 1.5 < -x.mean(), "ahead is south-west"


def test_a_fix_is_wrong_by_place_and_attitude_of_its_transducer(bent):
    names = ("position", "lever_error", "angle_error")
    place, off, turn = (np.array(BENT[f"instruments__usbl__{name}"]) for name in names)
    for f in bent[bent.readings_new & 16 > 0]:
        ship = Rotation.from_quat(f.ship_quaternion).as_matrix()
        way = ship.T @ (f.body_position - f.ship_position) - place - off
        reckoned = f.ship_position + ship @ (place + rolled(*turn)[0].T @ way)
        assert f.usbl_position == pytest.approx(reckoned, abs=1e-9)
        assert np.linalg.norm(f.usbl_position - f.body_position) > 3.0, "a hundredth of the slant range is"


def test_a_pressure_cell_feels_the_waves():
    waves = {"kind": "airy", "height": 2.0, "period": 12.0}
    what = scene().model_dump(mode="json")
    what["water"] |= {"waves": waves, "ramp": 0.1}
    f = offline.run(type(TOW).model_validate(what), duration=16.0, step="fixed").frames[200:]
    k, head = (2.0 * pi / 12.0) ** 2 / TOW.gravity, f.depth_reading + f.body_position[:, 2]
    assert head.max() == pytest.approx(np.exp(k * f.body_position[head.argmax(), 2]), rel=1e-2)


def test_heave_of_an_mru_is_high_passed():
    f = run({"duration": 64.0, "winch": None}, instruments__mru__heave_period=16.0)[-1600:]
    w, w0, zeta = 2.0 * pi / 8.0, 2.0 * pi / 16.0, 0.7
    turn = np.exp(-1j * w * f.time * 1e-9)
    expected = -w * w / (w0 * w0 - w * w + 2j * zeta * w0 * w)
    for shown, true in ((f.mru_heave, f.ship_position[:, 2]), (f.mru_heave_rate, f.ship_velocity[:, 2])):
        found = ((shown - shown.mean()) * turn).sum() / ((true - true.mean()) * turn).sum()
        assert abs(found - expected) < 1e-4


def test_each_imperfection_is_what_it_says(ideal):
    f = run(
        instruments__mru__latency=0.1,
        instruments__mru__rate=25.0,
        instruments__encoder__resolution=0.002,
        instruments__encoder__slip=0.05,
        instruments__metering_sheave__gain=1.02,
        instruments__load_pin__zero=30.0,
        instruments__load_pin__gain=1.1,
        instruments__load_pin__noise=4.0,
        instruments__depth__resolution=0.25,
        instruments__usbl__rate=10.0,
        instruments__usbl__noise=2.0,
    )
    new = np.flatnonzero(f.readings_new & 1)
    new = new[new > 10]
    assert (np.diff(new) == 4).all()
    assert (f.mru_heave[new] == ideal.mru_heave[new - 10]).all()
    truth = ideal.payout_counter
    counted = truth[0] + 1.05 * (truth - truth[0])
    assert np.abs(f.encoder_payout - counted).max() <= 0.001 + 1e-9
    assert np.abs(f.encoder_payout / 0.002 - np.round(f.encoder_payout / 0.002)).max() < 1e-6
    assert f.metering_payout == pytest.approx(1.02 * ideal.metering_payout)
    passed = 1.0 + ideal.tension_drum[1:] / TOW.cable.axial_stiffness  # stretched as it runs over the wheel
    assert np.diff(ideal.metering_payout) == pytest.approx(passed * np.diff(ideal.payout), abs=1e-9)
    assert ideal.metering_payout[-1] - ideal.payout[-1] > 1e-4, "unstretched cable it is not"
    assert np.abs(f.depth_reading - ideal.depth_reading).max() <= 0.125
    error = f.load_pin - (30.0 + 1.1 * ideal.load_pin)
    assert abs(error.mean()) < 0.5 and abs(error.std() - 4.0) < 0.4
    assert abs(np.corrcoef(error[1:], error[:-1])[0, 1]) < 0.1
    fixes = f.readings_new & 16 > 0
    assert abs((f.usbl_position - f.body_position)[fixes].std() - 2.0) < 0.4 and fixes.sum() == 120


def test_noise_belongs_to_its_seed_and_filter_range_and_outliers(ideal):
    values = {
        "instruments__load_pin__noise": 4.0,
        "instruments__load_pin__filter_time": 0.8,
        "instruments__usbl__rate": 100.0,
        "instruments__usbl__outliers": 0.1,
        "instruments__usbl__outlier_size": 20.0,
        "instruments__load_pin__capacity": float(np.median(ideal.load_pin)),
    }
    one, same, other = (run(**values, instruments__seed=seed) for seed in (7, 7, 8))
    assert one.tobytes() == same.tobytes() and (one.load_pin != other.load_pin).mean() > 0.4
    assert one.load_pin.max() == values["instruments__load_pin__capacity"]
    wrong = np.abs(one.usbl_position - one.body_position).max(axis=1) > 1e-9
    assert 0.06 < wrong.mean() < 0.14 and 12.0 < (one.usbl_position - one.body_position)[wrong].std() < 28.0
    smooth = run(instruments__load_pin__filter_time=0.8).load_pin
    follows = np.zeros_like(smooth)
    follows[0] = smooth[0]
    for i in range(1, len(smooth)):
        follows[i] = follows[i - 1] + (1.0 - np.exp(-TICK / 0.8)) * (ideal.load_pin[i] - follows[i - 1])
    assert smooth == pytest.approx(follows)


def test_a_load_pin_measures_along_its_axis(ideal):
    f = run(instruments__load_pin__axis_deg=-20.0, instruments__load_pin__calibration=0.25)
    a = np.radians(-20.0)
    along = -np.sin(a) * f.contact_force[:, 0] - np.cos(a) * f.contact_force[:, 2]
    assert f.load_pin == pytest.approx(along) and f.load_pin_tension == pytest.approx(along / 0.25)
    with pytest.raises(StartError, match=r"instruments.load_pin.axis_deg = 170: .* along it at the static start"):
        Simulator(scene(instruments__load_pin__axis_deg=170.0)).start()


def test_an_encoder_that_counts_with_a_wrong_layer():
    layers = {"winch__lay_width": 0.6, "winch__lay_pitch": 0.02, "winch__lay_rise": 0.02}
    f = run(instruments__encoder__layer_error=2, **layers)
    counted = 1.0 + 2 * 0.02 / f.drum_lay_radius[1:]
    assert np.diff(f.encoder_payout) == pytest.approx(counted * np.diff(f.payout_counter), abs=1e-9)


def test_the_vertical_of_an_mru_leans_out_of_a_turn():
    speed, turn, leak = 5.0, 0.05, 0.6
    what = scene(
        ship__tow_speed=speed,
        ship__start_blend=1.0,
        instruments__mru__turn_leak=leak,
        instruments__mru__turn_settling=2.0,
    )
    sim = started(what)
    for i in range(400):
        t = 0.05 * i
        place = (speed / turn * np.sin(turn * t), speed / turn * (1.0 - np.cos(turn * t)), 0.0)
        way, heads, turns = (speed * np.cos(turn * t), speed * np.sin(turn * t), 0.0), (0, 0, turn * t), (0, 0, turn)
        sim.push(ShipMotion(time_ns=round(t * 1e9), position=place, velocity=way, attitude=heads, rate=turns))
    f = sim.run(1500)
    assert f.mru_roll[-1] == pytest.approx(atan(leak * speed * turn / what.gravity), rel=0.01)
    assert abs(f.mru_pitch[-1]) < 1e-6


@pytest.mark.parametrize("kind", [kind.value for kind in FaultKind])
def test_each_fault_of_a_counter(kind):
    size = {"late": 0.2, "stuck": 3.0, "noise": 0.05}.get(kind, 0.5)
    sim = started(scene())
    before = at_rate(sim, 0.3, 100)
    set_live(sim, "faults.encoder.size", size)
    set_live(sim, "faults.encoder.kind", kind)
    f = at_rate(sim, 0.3, 100)
    since, true, at = TICK * np.arange(1, 101), f.payout_counter, before.encoder_payout[-1]
    counter = np.append(before.payout_counter, true)
    expected = {
        "none": true,
        "frozen": np.full(100, at),
        "bias": true + size,
        "drift": true + size * since,
        "late": counter[100 - 20 : 200 - 20],
        "lost": np.full(100, at),
        "stuck": np.full(100, size),
        "runaway": at + size * since,
        "reset": true - at,
    }
    if kind == "noise":
        assert abs((f.encoder_payout - true).std() - size) < 0.015
    else:
        assert f.encoder_payout == pytest.approx(expected[kind], abs=1e-9)
    assert (f.readings_new & 2 > 0).any() == (kind != "lost")
    set_live(sim, "faults.encoder.kind", "none")
    assert at_rate(sim, 0.3, 2).encoder_payout[-1] == pytest.approx(sim.frame["payout_counter"])


def test_a_device_with_a_lost_value_gives_no_reading():
    f = run({"duration": 1.0, "winch": None}, faults__mru_heave__kind="lost")
    assert not (f.readings_new & 1).any() and (f.readings_new & 46 == 46).all() and np.ptp(f.mru_heave) == 0.0


def test_faults_of_the_way_of_a_command():
    rates, sizes = {}, {"frozen": 0.0, "lost": 0.0, "bias": 0.1, "late": 1.0, "drift": 0.05, "runaway": -0.4}
    for kind, size in sizes.items():
        sim = started(scene())
        rows = [at_rate(sim, 0.2, 200)]
        set_live(sim, "faults.command.size", size)
        set_live(sim, "faults.command.kind", kind)
        rows += [at_rate(sim, 0.2, 50), at_rate(sim, 0.0, 50), sim.run(200)]
        rates[kind] = np.concatenate(rows).view(np.recarray).payout_rate
    timeout = round(TOW.winch.command_timeout / TICK)
    assert rates["frozen"][-1] == pytest.approx(0.2, abs=1e-3), "the last command goes on, without a time-out"
    assert rates["lost"][200 + timeout // 2] == pytest.approx(0.2, abs=1e-2) and abs(rates["lost"][-1]) < 1e-3
    assert rates["bias"][245] == pytest.approx(0.3, abs=1e-2) and rates["bias"][299] == pytest.approx(0.1, abs=2e-2)
    assert rates["late"][330] == pytest.approx(0.2, abs=1e-2), "the change of tick 250 counts at 350"
    assert abs(rates["late"][399]) < 0.02
    assert rates["drift"][249] == pytest.approx(0.2 + 0.05 * 0.5, abs=1e-2)
    assert rates["runaway"][-1] == pytest.approx(-0.4, abs=1e-3)


def test_faults_of_the_drive():
    for kind, size, way in (("frozen", 0.0, 0.0), ("bias", 0.2, 0.2), ("runaway", 0.1, 0.1), ("drift", 0.1, 0.1)):
        sim = started(scene())
        set_live(sim, "faults.drive.size", size)
        set_live(sim, "faults.drive.kind", kind)
        f = sim.run(101)
        assert f.payout[-1] - f.payout[0] == pytest.approx(way, abs=5e-3), kind


def test_a_law_and_a_controller_get_what_the_key_says():
    law = {"setpoint__algorithm": "simplified_sheave", "setpoint__washout_period": 0.0}
    motion = {"duration": 16.0, "winch": None}
    deviation = {}
    for name, values in (
        ("truth", {"instruments__mru__latency": 0.2}),
        ("instruments", {"instruments__feed": "instruments"}),
        ("late", {"instruments__feed": "instruments", "instruments__mru__latency": 0.2}),
        ("frozen", {"instruments__feed": "instruments", "faults__mru_heave__kind": "frozen"}),
        ("held", {"setpoint__algorithm": "hold"}),
    ):
        deviation[name] = run(motion, **(law | values)).tension[800:].std()
    assert deviation["instruments"] == pytest.approx(deviation["truth"], rel=0.1)
    assert deviation["late"] > 1.5 * deviation["truth"]
    assert deviation["frozen"] == pytest.approx(deviation["held"], rel=0.1)

    seen = []
    values = {"instruments.encoder.slip": 0.1, "instruments.depth.zero": 3.0, "instruments.feed": "instruments"}
    what = override(TOW, ABOARD | values)
    f = offline.run(what, heave=(1.0, 8.0), duration=2.0, step="fixed", controller=seen.append).frames
    rows = np.array(seen).view(np.recarray)
    assert (rows.payout[1:] == f.encoder_payout[: len(rows) - 1]).all()
    assert (rows.tension[1:] == f.load_pin_tension[: len(rows) - 1]).all()
    assert (rows.body_position[1:, 2] == -f.depth_reading[: len(rows) - 1]).all()
    assert (rows.body_position[1:, 0] == f.usbl_position[: len(rows) - 1, 0]).all()


def test_readings_are_recorded_replayed_and_gone_on_with(tmp_path):
    values = {"instruments__load_pin__noise": 5.0, "instruments__mru__heave_period": 30.0}
    what = scene(**values, faults__usbl__kind="drift", faults__usbl__size=0.5)
    motion = MOVING | {"winch": None, "duration": 2.0}
    begun = offline.run(what, **motion, out=tmp_path, save=tmp_path / "a.npz")
    for name, bit in (("mru", 1), ("encoder", 2), ("metering_sheave", 4), ("load_pin", 8), ("usbl", 16), ("depth", 32)):
        messages = [m for m in read_bag(begun.bag) if m.topic.endswith(f"instruments/{name}")]
        due = begun.frames[begun.frames.readings_new & bit > 0]
        assert len(messages) == len(due) > 0
        for message, frame in zip(messages[::50], due[::50], strict=True):
            channel = channel_of(message.topic, message.msgtype)
            for field, value in decode(channel, message.data).items():
                assert np.asarray(value) == pytest.approx(frame[field], abs=1e-12), (name, field)
    assert offline.replay(begun.bag).frames.tobytes() == begun.frames.tobytes()
    on = offline.run(what, **motion, resumed=tmp_path / "a.npz").frames
    whole = offline.run(what, **(motion | {"duration": 4.0})).frames
    assert on.tobytes() == whole[-len(on) :].tobytes()


def test_the_message_of_an_mru_has_its_twist_in_the_axes_of_the_ship():
    """As nav_msgs/Odometry says of its child frame, by matrices made here; and it is read back."""
    from cable_sim_ros.io.messages import instrument_channels as instruments
    from cable_sim_ros.io.messages.channel import Context

    row = np.zeros(1, run({"duration": 0.1, "winch": None}).dtype).view(np.recarray)[0]
    roll, pitch, roll_rate, pitch_rate = 0.3, -0.2, 0.05, -0.04
    names = {"mru_roll": roll, "mru_pitch": pitch, "mru_roll_rate": roll_rate, "mru_pitch_rate": pitch_rate}
    names |= {"mru_surge_rate": 1.0, "mru_sway_rate": 2.0, "mru_heave_rate": 3.0, "mru_heave": 0.7}
    for name, value in names.items():
        row[name] = value
    message = instruments.mru(numbers_of(row), None, None, Context())

    def matrix(roll, pitch):
        return rolled(roll, pitch, 0.0)[0]

    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    body = matrix(roll, pitch).T @ [1.0, 2.0, 3.0]
    assert (linear.x, linear.y, linear.z) == pytest.approx(body)
    h = 1e-6
    turned = matrix(roll, pitch).T @ (matrix(roll + h * roll_rate, pitch + h * pitch_rate) - matrix(roll, pitch)) / h
    assert (angular.x, angular.y, angular.z) == pytest.approx((turned[2, 1], turned[0, 2], turned[1, 0]), abs=1e-6)
    assert message.header.frame_id == "mru_link" and message.child_frame_id == "base_link"
    back = instruments.read_mru(message)
    assert {name: back[name] for name in names} == pytest.approx(names)


FED = {"instruments.feed": "instruments"}
LAYERS = {"winch.lay_width": 0.6, "winch.lay_pitch": 0.05, "winch.lay_rise": 0.05}


@pytest.mark.parametrize(
    "values, text",
    [
        ({"instruments.mru.rate": 30.0}, "instruments.mru.rate = 30 Hz is no whole number of ticks of 0.01 s"),
        ({"instruments.encoder.layer_error": 1}, "without winch.lay_width the drum has no layers"),
        (LAYERS | {"instruments.encoder.layer_error": -20}, "encoder.layer_error = -20 makes the radius -"),
        (FED | {"instruments.mru.on": False}, "goes by the motion of the sheave, and no MRU is on"),
        (FED | {"setpoint.algorithm": "rigorous_sheave"}, "goes by the departure angle, which no instrument aboard"),
        (FED | {"instruments.load_pin.on": False, "setpoint.algorithm": "constant_tension"}, "and no load pin is on"),
        (FED | dict.fromkeys(ABOARD, False), "instruments.feed = instruments, but none is aboard"),
        ({"faults.load_pin.kind": "reset"}, "= reset is nothing that load_pin can have"),
        ({"faults.drive.kind": "late"}, "= late is nothing that drive can have"),
        ({"faults.mru_heave.kind": "late", "faults.mru_heave.size": 9.0}, "= 9 s is outside [0, 5] s"),
        ({"faults.encoder.kind": "bias"}, "faults.encoder.size = 0, so that bias changes nothing"),
        ({"faults.depth.kind": "noise", "faults.depth.size": -1.0}, "the deviation of a noise"),
        ({"faults.usbl.kind": "lost", "instruments.usbl.on": False}, "instruments.usbl.on is false"),
        ({"instruments.load_pin.noise": -1.0}, "outside [0, 1e+06] N"),
    ],
)
def test_what_instruments_and_faults_cannot_be_asked(values, text):
    assert text in refused(scene, **values)


def test_what_no_instrument_has_is_not_set_while_the_tow_runs_and_what_surprises_is_said():
    with pytest.raises(ValueError, match=r"faults.encoder.kind = bias, but instruments.encoder.on is false"):
        set_live(started(TOW), "faults.encoder.kind", "bias")
    said = " ".join(cautioned(scene, **FED, setpoint__algorithm="constant_tension"))
    assert "constant_tension goes by the load pin, which bears both legs" in said
    said = " ".join(cautioned(scene_with, instruments__mru__latency=0.1))
    assert "instruments.mru.latency = 0.1 s has no effect: instruments.mru.on is false" in said


def test_the_lists_of_targets_and_kinds_belong_together():
    assert set(TARGETS) == set(type(TOW.faults).model_fields)
    assert all(set(kinds) <= {kind.value for kind in FaultKind} for kinds in OF_PATH.values())


def test_a_scenario_of_faults_is_reported_and_replayed(tmp_path):
    file = tmp_path / "faults.yaml"
    file.write_text(
        "scenario: counter\nfaults:\n  wrong: {at: 2, until: 3, target: encoder, kind: bias, size: 1.5, function: "
        "pay-out, expected: alarm}\n  runs off: {at: 4, target: drive, kind: runaway, size: 0.2}\n",
        "utf-8",
    )
    motion = MOVING | {"winch": None, "duration": 6.0}
    done = offline.run(scene(), **motion, faults=file, out=tmp_path / "a")
    f = done.frames
    wrong = (f.time - f.time[0]) * 1e-9 + TICK
    assert ((np.abs(f.encoder_payout - f.payout_counter) > 1.0) == ((wrong > 2.0 + 1e-9) & (wrong <= 3.0 + 1e-9))).all()
    first, second = done.metrics["faults"]
    assert first["beside"] == ["runs off"] and second["beside"] == ["wrong"], "their figures have each other's time"
    assert (first["function"], first["failure_mode"], first["expected"]) == ("pay-out", "encoder bias 1.5", "alarm")
    assert second["failure_mode"] == "drive runaway 0.2" and second["until_s"] is None
    late = f[wrong > 4.0 + 1e-9]
    assert second["found"]["payout_travel_m"] == pytest.approx(np.ptp(late.payout)) and np.ptp(late.payout) > 0.3
    assert first["before"]["tension_std_n"] == pytest.approx(f[wrong <= 2.0 + 1e-9].tension.std())
    assert offline.replay(done.bag).frames.tobytes() == f.tobytes()


def test_faults_and_fixes_go_over_a_jump_of_the_clock():
    sim = started(scene(faults__encoder__kind="drift", faults__encoder__size=0.5, instruments__usbl__latency=0.5))
    sim.run(200)
    before = sim.frame
    off, fix = before["encoder_payout"] - before["payout_counter"], before["usbl_position"] - before["body_position"]
    later = sim.snapshot()["memory"].time.now + 3_600_000_000_000
    sim.restore(carried_over(sim.snapshot(), int(later), (5000.0, -300.0)))
    after = sim.run(1)[0]
    assert after["encoder_payout"] - after["payout_counter"] == pytest.approx(off + 0.5 * TICK, abs=1e-6)
    assert np.abs(after["usbl_position"] - after["body_position"] - fix).max() < 0.1 and after["body_position"][0] > 4e3
