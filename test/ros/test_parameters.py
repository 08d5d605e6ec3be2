"""Parameters from the scene: what is declared, what may change, and every error text."""

from __future__ import annotations

import math
import re

import pytest
from rcl_interfaces.srv import DescribeParameters, GetParameters

from cable_sim_ros.physics.parameter import Block, quantity
from cable_sim_ros.ros.parameters import ParameterError, checked, rows, settle
from cable_sim_ros.ros.process import refuse_unknown
from cable_sim_ros.sim.live_parameters import ways

WRONG = [  # overrides, parts of the text beside the first key
    ({"water.density": 5000.0}, ["5000", "kg/m^3", "900", "1100"]),
    ({"water.density": 1000}, ["integer 1000", "nothing was started; write 1000.0"]),
    ({"publish.marker_rate": -1}, ["= -1 Hz is out of range", "started", "from 0 Hz to 1000 Hz"]),
    ({"towbody.length": 0}, ["= 0 m is out of range", "nothing was started", "Give a value "]),
    ({"water.densty": 1000.0}, ["Did you mean 'water.density'"]),
    ({"no.such.thing.at.all": 1}, ["ros2 param list"]),
    ({"setpoint.algorithm": "fast"}, ["fast", "hold, simplified_sheave"]),
    ({"ship.tow_speed": math.nan}, ["nan", "m/s"]),
    ({"winch.position": [1.0, 2.0]}, ["3 floating-point numbers", "m"]),
    ({"winch.position": [1.0, 2.0, 400.0]}, ["400", "200 m"]),
    ({"water.current_table.depth": [0, 10]}, ["must be floating-point numbers in m", "nothing was started"]),
    ({"water.current_table.depth": [0.0, 10.0]}, ["the current there is not known"]),
    ({"water.current_table.depth": [0.0, -10.0]}, ["-10 m is out of range"]),
    ({"cable.sections.bare.length": -3.0}, ["-3"]),
    ({"cable.sections.bare.elements": 2.5}, ["integer", "2.5; nothing was started"]),
    ({"cable.sections.bare.elements": 0, "scene": "full_scale_contact"}, ["is missing", "Give the number of elements"]),
    ({"cable.sections.bare.elements": 20}, ["= 20 has no effect", "winch.drum: contact"]),
    ({"winch.cable_on_drum": 100.0}, ["winch.scope", "winch.cable_on_drum = 100 m are both given"]),
    ({"winch.most_scope": 440.0}, ["440 m", "450 m"]),
    ({"cable.sections.bare.drag_law": "ribon"}, ["ribon", "ribbon"]),
    ({"realtime.priority": 500}, ["500", "99"]),
    ({"recording.enabled": 1}, ["true or false, got 1; nothing was started"]),
    ({"recording.root": "/dev/null/x", "recording.enabled": True}, ["nothing was started"]),
    ({"recording.path": "../x"}, ["no path; nothing was started"]),
    ({"state_file": "../x"}, ["../x", "no path; nothing was started"]),
    ({"solver.tension_error": 0.005}, ["0.005", "one step a tick; nothing was started", "cable-sim run"]),
    ({"time_mode": "stepped"}, ["stepped", "realtime, lockstep"]),
    ({"lockstep.flap_period": 0.02}, ["0.02 s", "no flaps", "nothing was started", "flap_share"]),
    ({"lockstep.rate": 0.05}, ["0.05", "nothing was started", "0.1 to 1000"]),
    ({"lockstep.wait": -1.0}, ["-1 s", "from 0 s to 600 s"]),
    ({"faults_file": "/none.yaml"}, ["parameter 'faults_file'", "/none.yaml", "cannot be read"]),
    ({"scene": "nowhere"}, ["nowhere", "full_scale"]),
    ({"sheave.position": [0.0, 0.0, 0.0]}, []),  # senseless only beside the other numbers
]


@pytest.mark.parametrize("overrides, parts", WRONG, ids=[next(iter(o)) + str(i) for i, (o, _) in enumerate(WRONG)])
def test_error_texts(overrides, parts):
    with pytest.raises(ParameterError) as error:
        settle(overrides)
    for part in (next(iter(overrides)), *parts):
        assert part in str(error.value), str(error.value)
    if found := re.search(r"; write (-?[\d.e+]+)$", str(error.value)):  # what it suggests is not refused
        settle(overrides | {next(iter(overrides)): float(found[1])})


@pytest.mark.parametrize(
    "until, target, part",
    [
        ("1.004", "command", "before the next tick output, that at 1.01 s: it would never act; nothing was started"),
        (
            "2",
            "encoder",
            "faults.encoder.kind = bias, but instruments.encoder.on is false: there is nothing to be wrong; n",
        ),
    ],
)
def test_a_scenario_of_faults_that_its_scene_cannot_have(tmp_path, until, target, part):
    path = tmp_path / "a.yaml"
    path.write_text(
        f"scenario: a\nfaults:\n  b: {{at: 1.001, until: {until}, target: {target}, kind: bias, size: 7.0}}\n"
    )
    with pytest.raises(ParameterError, match=f"parameter 'faults_file': scenario a, b: .*{re.escape(part)}"):
        settle({"faults_file": str(path)})


def test_a_table_is_a_parameter_of_any_length_and_none_is_one_nan():
    none = [math.nan]
    settings = settle(
        {
            "water.current_table.depth": [0.0, 20.0, 50.0],
            "water.current_table.east": [0.2, 0.1, 0.0],
            "water.current_table.north": [0.0, 0.0, 0.0],
            "water.current_table.speed": none,
        }
    )
    assert settings.scene.water.current_table.depth == (0.0, 20.0, 50.0)
    rows = {row.name: row for row in settings.rows}
    assert rows["water.current_table.east"].value == [0.2, 0.1, 0.0]
    assert math.isnan(rows["water.current_table.speed"].value[0]), "an empty list has no type in ROS"


def test_overrides_stand_above_the_scene_file():
    settings = settle(
        {
            "scene": "full_scale_contact",
            "water.density": 1000.0,
            "setpoint.nominal_angle_deg": math.nan,
            "winch.position": [-28.0, 0.0, 3.0],
            "cable.sections.bare.elements": 20,
            "cable.sections.bare.diameter": math.nan,
            "cable.sections.bare.mass_per_length": 0.4,
            "cable.sections.faired.drag_law": "",
            "cable.sections.faired.fairing": "hair",
            "motion.convention": "ned",
            "input_delay": 0.05,
            "use_sim_time": False,
            "qos_overrides./x.subscription.depth": 3,
        }
    )
    assert settings.scene.water.density == 1000.0
    assert settings.scene.setpoint.nominal_angle_deg is None
    assert settings.scene.winch.position == (-28.0, 0.0, 3.0)
    assert settings.scene.cable.sections["bare"].elements == 20
    assert settings.scene.cable.sections["bare"].diameter is None
    assert settings.scene.cable.sections["bare"].mass_per_length == 0.4
    assert settings.scene.cable.sections["faired"].drag_law is None
    assert settings.scene.cable.sections["faired"].fairing == "hair"
    values = {row.name: row.value for row in settings.rows}
    assert values["cable.sections.faired.drag_law"] == "" and math.isnan(values["cable.sections.bare.diameter"])
    assert settings.node.motion.convention.value == "ned"
    assert settings.node.input_delay == 0.05


def test_a_number_that_is_none_gives_way_to_another():
    winch = settle({"winch.scope": math.nan, "winch.cable_on_drum": 100.0, "winch.most_scope": 520.0}).scene.winch
    assert (winch.scope, winch.cable_on_drum, winch.most_scope, winch.least_scope) == (None, 100.0, 520.0, None)


def test_every_row_says_what_it_is():
    rows = settle({}).rows
    names = [row.name for row in rows]
    assert len(names) == len(set(names)), "the node and the scene share a name"
    assert all(row.doc for row in rows)


def test_declared_parameters_and_changes_at_run_time(world):
    path = world.folder / "good.yaml"
    path.write_text("/**:\n  ros__parameters:\n    winch: {position: [-28.0, 0.0, 3.0]}\n")
    node = world.node("--params-file", str(path), water__density=1010.0).until("waiting")
    ears = world.ears()

    def values(*names):
        return ears.call(GetParameters, "cable_sim/get_parameters", GetParameters.Request(names=names)).values

    names = ["water.density", "setpoint.algorithm", "setpoint.nominal_angle_deg", "realtime.priority", "winch.position"]
    asked = DescribeParameters.Request(names=names)
    answer = ears.call(DescribeParameters, "cable_sim/describe_parameters", asked)
    about = {item.name: item for item in answer.descriptors}
    density = about["water.density"]
    assert (density.floating_point_range[0].from_value, density.floating_point_range[0].to_value) == (900.0, 1100.0)
    assert "kg/m^3" in density.description and "sea water" in density.description
    assert density.read_only and not about["setpoint.algorithm"].read_only
    assert about["realtime.priority"].integer_range[0].to_value == 99
    assert "hold" in about["setpoint.algorithm"].additional_constraints
    density, _, angle, _, position = values(*names)
    assert density.double_value == 1010.0
    assert math.isnan(angle.double_value)
    assert list(position.double_array_value) == [-28.0, 0.0, 3.0]

    assert ears.set("setpoint.algorithm", "hold") == ""
    assert "one of" in ears.set("setpoint.algorithm", "fast")
    assert ears.set("water.density", 1000.0) != ""
    assert "needs a motor and a brake" in ears.set("drive.mode", "brake")
    for name in ("winch.command_timeout", "setpoint.washout_period"):
        assert ears.set(name, 1.0) == "", name
    assert ears.set("winch.command_timeout", 1e9) != ""
    timeout, law = values("winch.command_timeout", "setpoint.algorithm")
    assert timeout.double_value == 1.0 and law.string_value == "hold"
    assert node.stop() == 0


def test_what_is_declared_live_is_live_and_nothing_else():
    settings = settle({})
    declared = {row.name for row in settings.rows if not row.configure}
    own = {row.name for row in rows(settings.node) if not row.configure}
    assert declared - own == set(ways(settings.scene))
    assert own == {"recording.path", "state_file", "lockstep.rate", "lockstep.wait", "lockstep.steps"}


def test_a_whole_number_that_may_be_left_out_is_0_in_ros():
    class One(Block):
        count: int | None = quantity(None, "1", 1, 10, "elements")

    (row,) = rows(One())
    assert (row.kind, row.value, row.nullable) == (int, 0, True)
    assert checked(row, 0) is None and checked(row, 3) == 3
    with pytest.raises(Exception, match="out of range"):
        checked(row, 11)


def test_an_argument_that_the_node_does_not_know_is_refused():
    refuse_unknown(["node", "--ros-args", "-p", "scene:=side_scan", "--", "--ros-args", "-r", "__ns:=/a"])
    with pytest.raises(ParameterError, match="--scene side_scan: no option of the node; nothing was started"):
        refuse_unknown(["node", "--scene", "side_scan"])
