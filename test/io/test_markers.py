"""cable/markers: the bytes are those of the serializer, and they draw what the tick output says."""

import math

import numpy as np
import pytest
from synthetic import START, canonical, make_contact, make_frames, make_shape, serialize

from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.messages.channels import TRANSFORMS, Context, Encoder, numbers_of
from cable_sim_ros.io.messages.markers import (
    MSGTYPE,
    SLACK,
    TowDrawing,
    body_size,
    cable_points,
    colours,
    markers_channel,
)
from cable_sim_ros.io.messages.mounting import times
from cable_sim_ros.io.messages.rotation import rotate
from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.physics.section import CableModel
from cable_sim_ros.sim.simulator import Simulator

pytestmark = pytest.mark.check

CONTEXT = Context()
DELETE = 2


@pytest.fixture(scope="module")
def scene():
    return load_scene("full_scale")


@pytest.fixture(scope="module")
def tow(scene):
    """A tow that has moved: tick output, table of shape with slopes, table of contact, position and gradient of its
    nodes."""
    sim = Simulator(scene)
    sim.start()
    sim.run(5)
    return sim.frame, sim.output.shape[0], sim.output.contact[0], sim.state.q.copy()


def sloped(frame):
    """A made-up shape with slopes."""
    table = make_shape(frame)
    return np.hstack([table, np.gradient(table[:, :3], table[:, 4], axis=0)])


def drawn(scene, frame, shape, contact, rate=10.0):
    """Markers by (ns, id)."""
    row = markers_channel(scene, rate)
    message = STORE.deserialize_cdr(serialize(row, frame, shape, contact, CONTEXT), MSGTYPE)
    markers = {(m.ns, m.id): m for m in message.markers}
    assert len(markers) == len(message.markers)
    return markers


def numbers(*messages):
    return [getattr(m, part) for m in messages for part in ("x", "y", "z", "w", "r", "g", "b", "a") if hasattr(m, part)]


def points(marker):
    return np.array([(p.x, p.y, p.z) for p in marker.points]).reshape(-1, 3)


def place(marker):
    """Points of a marker in odom."""
    p, q = marker.pose.position, marker.pose.orientation
    return np.array([rotate((q.x, q.y, q.z, q.w), x) for x in points(marker)]) + (p.x, p.y, p.z)


@pytest.mark.parametrize("model", list(CableModel))
@pytest.mark.parametrize("contact_points", [0, 1, 40, 300])
def test_quick_bytes_are_those_of_the_serializer(scene, model, contact_points):
    scene = scene.model_copy(update={"cable": scene.cable.model_copy(update={"model": model})})
    encoder, drawing = Encoder(CONTEXT, 0.01, (markers_channel(scene, 10.0),)), TowDrawing(scene, 10.0)
    for frame in make_frames(3):
        frame["tick"] = 0
        contact = np.resize(make_contact(frame), (max(contact_points, 1), 9))
        frame["contact_stations"] = contact_points
        [(_, topic, data)] = encoder.encode(frame, sloped(frame), contact)
        assert topic == "/tow_sim/cable/markers"
        assert data == canonical(data, MSGTYPE)
        markers, items = (
            STORE.deserialize_cdr(data, MSGTYPE).markers,
            drawing.items(numbers_of(frame), sloped(frame), contact),
        )
        for m, item in zip(markers, items, strict=True):
            assert (m.ns, m.id, m.type, m.action, m.text) == (item.ns, item.id, item.kind, item.action, item.text)
            assert numbers(m.pose.position, m.pose.orientation, m.scale) == [
                *item.position,
                *item.quaternion,
                *item.scale,
            ]
            assert numbers(m.color, *m.colors) == np.float32([*item.color, *np.ravel(item.colors)]).tolist()
            assert np.array_equal(points(m), item.points) and not m.frame_locked


def test_the_cable_is_drawn_through_its_shape_functions(tow):
    """Against the cubic of every element, evaluated from the state: its middle and its ends."""
    frame, shape, _, q = tow
    line, _ = cable_points(shape, 6)
    arc = shape[:, 4]
    shift = shape[0, :3] - q[0, :3]
    length = np.diff(arc)[:, None]
    middle = 0.5 * (q[:-1, :3] + q[1:, :3]) + 0.125 * length * (q[:-1, 3:6] - q[1:, 3:6]) + shift
    assert np.allclose(line[3::6], middle, atol=1e-9)
    assert np.allclose(line[::6], shape[:, :3], atol=1e-12)
    chord = 0.5 * (shape[:-1, :3] + shape[1:, :3])
    assert np.abs(line[3::6] - chord).max() > 0.1  # a chord would miss the cable by so much


def test_links_are_chords():
    frame = make_frames(1)[0]
    table = make_shape(frame)
    line, tension = cable_points(table, 1)
    assert np.array_equal(line, table[:, :3]) and np.array_equal(tension, table[:, 3])


def test_the_pieces_of_the_cable_join_and_cover_it(scene, tow):
    frame, shape, contact, _ = tow
    markers = drawn(scene, frame, shape, contact)
    pieces = [m for (ns, _), m in markers.items() if ns == "cable" and m.action == 0]
    lines = [points(m) for m in pieces]
    for a, b in zip(lines, lines[1:]):
        assert np.array_equal(a[-1], b[0])
    assert np.array_equal(lines[0][0], shape[0, :3]) and np.array_equal(lines[-1][-1], shape[-1, :3])
    assert all(m.type == 4 and len(m.points) == len(m.colors) >= 2 for m in pieces)
    assert pieces[0].scale.x == pieces[-1].scale.x == scene.cable.diameter
    widest = max(m.scale.x for m in pieces)
    assert 450.0 / 1500.0 <= widest <= 450.0 / 500.0
    by_sheave = np.linalg.norm(lines[0] - frame["sheave_position"], axis=1)
    assert by_sheave.min() < 1.1 * scene.sheave.radius  # the one at the sheave is at its real diameter


def test_every_tick_has_the_same_names_and_what_has_no_points_is_taken_away(scene):
    names = set()
    for contact_points in (40, 0):
        frame = make_frames(1)[0]
        contact = make_contact(frame)
        frame["contact_stations"] = contact_points
        markers = drawn(scene, frame, sloped(frame), contact)
        names.add(tuple(markers))
        for marker in markers.values():
            line = marker.type in (4, 5)
            assert (marker.action == DELETE) == (line and not marker.points), (marker.ns, marker.id)
        assert markers["contact", 0].action == (0 if contact_points else DELETE)
    assert len(names) == 1


def test_stamp_frame_and_lifetime(scene):
    frame = make_frames(1)[0]
    frame["time"] = START + 123_456_789
    for rate, lifetime in ((10.0, 2), (0.5, 6)):
        for marker in drawn(scene, frame, sloped(frame), make_contact(frame), rate).values():
            assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == (1_700_000_000, 123_456_789)
            assert marker.header.frame_id == "odom" and marker.lifetime.sec == lifetime


def test_what_stands_where(scene, tow):
    frame, shape, contact, _ = tow
    markers = drawn(scene, frame, shape, contact)
    wheel, rims, body = markers["sheave", 0], markers["sheave", 1], markers["towbody", 0]
    p = wheel.pose.position
    assert (p.x, p.y, p.z) == tuple(frame["sheave_position"])
    assert wheel.scale.x == 2.0 * scene.sheave.radius
    out = np.linalg.norm((place(rims) - frame["sheave_position"]) * (1, 0, 1), axis=1)
    assert out == pytest.approx(scene.sheave.radius + scene.sheave.groove_depth)
    q = wheel.pose.orientation
    axis = rotate((q.x, q.y, q.z, q.w), (0.0, 0.0, 1.0))
    assert np.abs(axis) == pytest.approx(np.abs(rotate(tuple(frame["ship_quaternion"]), (0.0, 1.0, 0.0))))
    q = body.pose.orientation
    axis = rotate((q.x, q.y, q.z, q.w), (0.0, 0.0, 1.0))
    assert axis == pytest.approx(rotate(tuple(frame["body_quaternion"]), (1.0, 0.0, 0.0)))
    winch = np.add(frame["ship_position"], rotate(tuple(frame["ship_quaternion"]), scene.winch.position))
    along = rotate(tuple(frame["ship_quaternion"]), (1.0, 0.0, 0.0))
    p = markers["drum", 0].pose.position
    assert (p.x, p.y, p.z) == pytest.approx(tuple(winch))
    assert np.abs(place(markers["water", 0])[:, 2]).max() == 0.0
    assert np.ptp(place(markers["towbody", 1]), axis=0) == pytest.approx((0.0, 0.0, -frame["body_position"][2]))
    there = (place(markers["ship", 0]) - frame["ship_position"]) @ along
    assert there.min() < (winch - frame["ship_position"]) @ along < there.max()  # the drum is on the ship
    tips = place(markers["contact", 0])
    assert len(tips) and np.linalg.norm(tips - frame["sheave_position"], axis=1).min() > 0.9 * scene.sheave.radius
    tension = f"tension {frame['tension'] / 1e3:.3g} kN"
    assert markers["text", 0].text.startswith(tension) and markers["text", 1].text == "0 to 5 kN"


def test_the_drum_turns_as_the_cable_comes_in(scene):
    """Positive drum angle hauls in: over the top of the drum, away from the sheave."""
    frame = make_frames(1)[0]
    frame["ship_quaternion"] = (0.0, 0.0, 0.0, 1.0)
    turned = []
    for angle in (0.0, 0.1):
        frame["drum_angle"] = angle
        marker = drawn(scene, frame, sloped(frame), make_contact(frame))["drum", 1]
        spokes = place(marker) - [getattr(marker.pose.position, axis) for axis in "xyz"]
        turned.append(spokes[np.argmax(spokes[:, 2])])
    assert turned[1][0] - turned[0][0] == pytest.approx(scene.winch.drum_radius * math.sin(0.1))


def test_line_load_has_its_length_and_side(scene):
    frame = make_frames(1)[0]
    contact = make_contact(frame)
    contact[:, 4], contact[:, 5] = scene.contact.working_tension / scene.sheave.radius, 1e9
    markers = drawn(scene, frame, sloped(frame), contact)
    for k, (side, maximum) in enumerate(((1.0, 1.0), (-1.0, 3.0))):
        lines = points(markers["contact", k]).reshape(-1, 2, 3)
        way = lines[:, 1] - lines[:, 0]
        assert np.linalg.norm(way, axis=1) == pytest.approx(maximum * scene.sheave.radius)
        assert (np.sign(way[:, 1]) == side).all()


def test_colours_rise_in_lightness_and_slack_stands_out():
    rgba = colours(np.array([0.0, 1.0, 2.0, 3.0, 4.0, 9.0, -0.1]), 4.0)
    luminance = rgba[:-1, :3] @ (0.2126, 0.7152, 0.0722)
    assert (np.diff(luminance) >= 0.0).all() and np.diff(luminance)[:4].min() > 0.05
    assert np.array_equal(rgba[4], rgba[5])  # beyond the scale its end
    assert rgba[6, :3] == pytest.approx(SLACK) and (rgba[:, 3] == 1.0).all()


def test_the_scale_is_that_of_the_scene_or_the_one_asked_for(scene):
    assert TowDrawing(scene, 10.0).scale.maximum == 1.25 * scene.contact.working_tension
    assert TowDrawing(scene, 10.0, 7000.0).scale.text(7000.0) == "7 kN"
    assert TowDrawing(scene, 10.0, 0.02).scale.text(0.009) == "9 mN"
    assert TowDrawing(scene, 10.0, 20.0).scale.text(1.5) == "1.5 N"


def test_size_of_the_towbody(scene):
    length, diameter = body_size(scene)
    volume = (250.0 - 445.0 / scene.gravity) / 1026.0
    assert 0.25 * math.pi * diameter**2 * length == pytest.approx(volume) and length == pytest.approx(10.0 * diameter)

    def sized(**size):
        return body_size(scene.model_copy(update={"towbody": scene.towbody.model_copy(update=size)}))

    length, diameter = sized(length=2.0)
    assert length == 2.0 and 0.25 * math.pi * diameter**2 * length == pytest.approx(volume)
    assert sized(length=2.0, diameter=1.2) == (2.0, 1.2) and sized(diameter=0.5) == (5.0, 0.5)
    assert min(sized(mass=30.0, net_weight=300.0)) > 0.0  # heavier than it is: nothing displaced


def test_product_of_rotations_agrees_with_scipy():
    from scipy.spatial.transform import Rotation

    p, q = Rotation.random(2, rng=np.random.default_rng(3)).as_quat()
    assert times(tuple(p), tuple(q)) == pytest.approx(
        (Rotation.from_quat(p) * Rotation.from_quat(q)).as_quat(canonical=False)
    )


def test_what_is_not_finite_is_refused_by_name(scene):
    frame = make_frames(1)[0]
    shape, contact = sloped(frame), make_contact(frame)
    row = markers_channel(scene, 10.0)
    shape[7, 6] = math.nan
    with pytest.raises(ValueError, match="'slope_y' of cable/shape, row 7, is nan"):
        Encoder(CONTEXT, 0.01, (row,)).encode(frame, shape, contact)
    shape[7, 6], contact[5, 4] = 0.0, math.inf
    with pytest.raises(ValueError, match="'load_port' of sheave/contact, row 5, is inf"):
        Encoder(CONTEXT, 0.01, (row,)).encode(frame, shape, contact)


def test_transforms_lead_from_odom_to_every_frame():
    frame = make_frames(1)[0]
    frame["ship_quaternion"] = (0.0, 0.0, math.sin(0.3), math.cos(0.3))
    message = STORE.deserialize_cdr(serialize(TRANSFORMS, frame, None, None, CONTEXT), TRANSFORMS.msgtype)
    ship, sheave, body = message.transforms
    assert [(t.header.frame_id, t.child_frame_id) for t in message.transforms] == [
        ("odom", "base_link"),
        ("base_link", "sheave_link"),
        ("odom", "towbody_link"),
    ]
    arm = sheave.transform.translation
    there = np.add(frame["ship_position"], rotate(tuple(frame["ship_quaternion"]), (arm.x, arm.y, arm.z)))
    assert there == pytest.approx(frame["sheave_position"])
    at = body.transform.translation
    assert (at.x, at.y, at.z) == tuple(frame["body_position"])
    assert ship.header.stamp.sec == frame["time"] // 10**9


def test_ros_reads_the_bytes():
    """Where rclpy and the package are present."""
    serialization = pytest.importorskip("rclpy.serialization")
    package = pytest.importorskip("visualization_msgs.msg")
    frame = make_frames(1)[0]
    data = serialize(
        markers_channel(load_scene("full_scale"), 10.0), frame, sloped(frame), make_contact(frame), CONTEXT
    )
    markers = serialization.deserialize_message(data, package.MarkerArray).markers
    assert {m.ns for m in markers} == {"cable", "sheave", "drum", "towbody", "contact", "water", "text", "ship"}
    assert sum(len(m.points) for m in markers if m.ns == "cable") > 40


def test_one_message_allocates_no_objects_a_point(scene, tow):
    """Arrays all the way: as many Python objects for a long cable as for a short one."""
    frame, shape, contact, _ = tow
    drawing, numbers = TowDrawing(scene, 10.0), numbers_of(frame)
    items = drawing.items(numbers, shape, contact)
    assert sum(len(item.points) for item in items if item.ns == "cable") > 150
    assert all(isinstance(item.points, np.ndarray) and isinstance(item.colors, np.ndarray) for item in items)
