"""What RViz and Foxglove draw: one visualization_msgs/MarkerArray of the whole tow, every marker in odom.

The cable is a LINE_STRIP through the shape functions: between two nodes the cubic Hermite of their places and gradients
(Shabana's ANCF cable element), straight where links are; coloured by tension. In pieces: at its real diameter on board
and at both ends, wider away from them, so that it shows in a view of the sheave, of the towbody and of the whole tow.
Its CDR bytes are made from arrays: a message object a point costs 1 ms, this a tenth.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import cache
from math import ceil, floor, log, log10, pi, sqrt
from typing import NamedTuple

import numpy as np

from ...physics.section import CableModel
from ...physics.tick_output import CONTACT_COLUMNS, SHAPE_COLUMNS, SLOPE_COLUMNS
from ...physics.towbody import BodyModel
from ...sim.scene import Scene
from ..bags.bag_writer import BagError
from .cdr import SECOND, refuse_not_finite
from .channels import Channel, Context
from .mounting import times
from .rotation import rotate
from .shapes import half_width, hull

ADD, DELETE = 0, 2
NOTHING = np.zeros((0, 3))
_NUMBERS = struct.Struct("<10d4fiI?")  # pose, scale, colour, lifetime, frame_locked


EMPTY = b"\1\0\0\0" + bytes(4)  # a string, with what aligns the next
NO_TEXTURE = EMPTY + bytes(8) + EMPTY + EMPTY + bytes(8)  # resource; header, its frame, format, data; uv_coordinates
NO_MESH = EMPTY + EMPTY + bytes(5)  # resource; name and data of the file; use_embedded_materials

MSGTYPE, TOPIC = "visualization_msgs/msg/MarkerArray", "cable/markers"
LIFETIME = 2.0  # s without a new message after which a tool takes them away; three periods where those are longer
MAX_RATE = 1000.0  # Hz
POINTS = 200  # of the cable, where its mesh has no more nodes
WIDE = 500.0  # cable lengths a line width, at most
ROUND, FINE = 6.0, 40.0  # sheave radii at the real diameter; beyond, distance from either end over the line width
STEP = 3.0  # a width over the one before
STATIONS = 64  # of the contact, at most
TALLEST = 3.0  # sheave radii, of a line of load
STANDING = (0.0, 0.0, 0.0, 1.0)
ALONG_X, ALONG_Y = (0.0, sqrt(0.5), 0.0, sqrt(0.5)), (-sqrt(0.5), 0.0, 0.0, sqrt(0.5))  # of a cylinder's axis z
# viridis (van der Walt and Smith, 2015, CC0) from 0.2 to 1 in tenths: perceptually uniform, no red against green; its
# darkest fifth is left out, which dark backgrounds swallow
SCALE = np.array(
    [
        [0.253935, 0.265254, 0.529983],
        [0.206756, 0.371758, 0.553117],
        [0.163625, 0.471133, 0.558148],
        [0.127568, 0.566949, 0.550556],
        [0.134692, 0.658636, 0.517649],
        [0.266941, 0.748751, 0.440573],
        [0.477504, 0.821444, 0.318195],
        [0.741388, 0.873449, 0.149561],
        [0.993248, 0.906157, 0.143936],
    ]
)
SLACK = (1.0, 0.2, 0.8)  # below no tension
STEEL, RIM, DRUM = (0.55, 0.60, 0.65, 0.55), (0.85, 0.88, 0.90, 1.0), (0.45, 0.40, 0.35, 0.9)
BODY, WATER = (0.95, 0.55, 0.15, 1.0), (0.35, 0.60, 0.85, 0.45)
PORT, STARBOARD, INK = (0.90, 0.25, 0.20, 1.0), (0.15, 0.75, 0.45, 1.0), (0.95, 0.95, 0.95, 1.0)
LINE_STRIP, LINE_LIST, CYLINDER, TEXT = 4, 5, 3, 9
COLUMN = {name: k for k, (name, _) in enumerate(CONTACT_COLUMNS)}


class Drawn(NamedTuple):
    """One marker: what varies of visualization_msgs/Marker."""

    ns: str
    id: int
    kind: int
    position: Sequence[float]
    quaternion: tuple[float, float, float, float]
    scale: tuple[float, float, float]
    color: tuple[float, float, float, float]
    points: np.ndarray = NOTHING  # [n, 3]
    colors: np.ndarray = NOTHING  # [n, 4] or none
    text: str = ""

    @property
    def action(self) -> int:
        """A line without points is taken away: tools complain of it."""
        return DELETE if self.kind in (4, 5) and not len(self.points) else ADD


class _Writer:
    """Bytes of plain little-endian CDR; alignment counts from the fourth byte on."""

    def __init__(self) -> None:
        self.out = bytearray(b"\0\1\0\0")

    def align(self, size: int) -> None:
        self.out += bytes((4 - len(self.out)) % size)

    def pack(self, layout: str, *values) -> None:
        self.align(4)
        self.out += struct.pack("<" + layout, *values)

    def string(self, text: str) -> None:
        data = text.encode() + b"\0"
        self.pack("I", len(data))
        self.out += data

    def array(self, rows: np.ndarray, kind: str, size: int) -> None:
        self.pack("I", len(rows))
        if len(rows):
            self.align(size)
            self.out += np.ascontiguousarray(rows, kind).tobytes()


@cache
def _head(places: int, frame_id: str, ns: str, number: int, kind: int, action: int) -> bytes:
    """From behind the stamp up to the pose; places: bytes of the message before it, modulo 8."""
    w = _Writer()
    w.out += bytes(places)
    begin = len(w.out)
    w.string(frame_id)
    w.string(ns)
    w.pack("3i", number, kind, action)
    w.align(8)
    return bytes(w.out[begin:])


def encode(items: list[Drawn], time: int, frame_id: str, lifetime: int) -> bytes:
    """Bytes of the array; time: ns of every header; lifetime: ns."""
    w = _Writer()
    w.pack("I", len(items))
    for item in items:
        w.pack("iI", *divmod(time, SECOND))
        w.out += _head((len(w.out) - 4) % 8, frame_id, item.ns, item.id, item.kind, item.action)
        w.out += _NUMBERS.pack(
            *item.position, *item.quaternion, *item.scale, *item.color, *divmod(lifetime, SECOND), False
        )
        w.array(item.points, "<f8", 8)
        w.array(item.colors, "<f4", 4)
        w.out += NO_TEXTURE
        w.string(item.text)
        w.align(4)
        w.out += NO_MESH
    return bytes(w.out)


def cable_points(table: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Points [m] along the cable and tension [N] there: [(nodes - 1) parts + 1, 3], [...].

    table: shape table with slopes [nodes, 8 or more]; parts: of an element.
    """
    place, tension, arc = table[:, :3], table[:, 3], table[:, 4]
    if parts == 1:
        return place, tension
    u = (np.arange(parts) / parts)[:, None]  # [parts, 1], as all below [nodes - 1, parts, 1 or 3]
    slope = table[:, len(SHAPE_COLUMNS) : len(SHAPE_COLUMNS) + len(SLOPE_COLUMNS)]
    length = np.diff(arc)[:, None, None]
    a, b = u * u * (3.0 - 2.0 * u), u * (1.0 - u)  # of the places, of the gradients
    between = (
        (1.0 - a) * place[:-1, None]
        + a * place[1:, None]
        + length * b * ((1.0 - u) * slope[:-1, None] - u * slope[1:, None])
    )
    pulled = tension[:-1, None] + u.T * np.diff(tension)[:, None]
    return np.concatenate((between.reshape(-1, 3), place[-1:])), np.append(pulled.reshape(-1), tension[-1])


VEHICLE_SIZE = 1.5, 0.8  # m, length and diameter of one whose size the scene does not say


def colours(tension: np.ndarray, maximum: float) -> np.ndarray:
    """RGBA [n, 4] of tensions [N], from none to ``maximum`` and beyond; slack in a colour of its own."""
    at = np.clip(tension / maximum, 0.0, 1.0) * (len(SCALE) - 1)
    low = np.minimum(at.astype(int), len(SCALE) - 2)
    rgba = np.ones((len(tension), 4), np.float32)
    rgba[:, :3] = SCALE[low] + (at - low)[:, None] * (SCALE[low + 1] - SCALE[low])
    rgba[tension < 0.0, :3] = SLACK
    return rgba


def body_size(scene: Scene) -> tuple[float, float]:
    """Length and diameter [m] of the towbody as it is drawn."""
    body, volume = scene.towbody, 0.0
    if body.model is BodyModel.VEHICLE:
        return body.length or VEHICLE_SIZE[0], body.diameter or VEHICLE_SIZE[1]
    if scene.gravity > 0.0:
        volume = (body.mass - body.net_weight / scene.gravity) / scene.water.density
    volume = max(volume, 1e-3 * body.mass / scene.water.density)  # a body of heavy metal still shows
    if body.diameter is None and body.length is not None:
        return body.length, sqrt(4.0 * volume / (pi * body.length))
    diameter = body.diameter or (0.4 * volume / pi) ** (1.0 / 3.0)
    return body.length or 10.0 * diameter, diameter


class Colours(NamedTuple):
    """The colour scale: its top [N], and how tensions are written."""

    maximum: float
    unit: str
    divisor: float

    def text(self, tension: float) -> str:
        return f"{tension / self.divisor:.3g} {self.unit}"


def colour_scale(scene: Scene, maximum: float | None) -> Colours:
    """maximum: top of the scale [N], None: 1.25 times the working tension of the scene."""
    top = 1.25 * scene.contact.working_tension if maximum is None else maximum
    return Colours(top, *(("kN", 1e3) if top >= 1e3 else ("N", 1.0) if top >= 1.0 else ("mN", 1e-3)))


class TowDrawing:
    """Markers of one scene, from a tick output's numbers and tables.

    rate: Hz, for the lifetime; maximum: top of the colour scale [N], None: from the scene.
    """

    def __init__(self, scene: Scene, rate: float, maximum: float | None = None) -> None:
        self.scene, self.scale = scene, colour_scale(scene, maximum)
        self.lifetime = round(max(LIFETIME, 3.0 / rate) * SECOND)
        self.links = scene.cable.model is CableModel.SEGMENTS
        self.diameter, self.radius = scene.cable.diameter, scene.sheave.radius
        self.length, self.thick = body_size(scene)
        cable = sum(section.length for section in scene.cable.sections.values())
        self.widths = 1 + max(0, ceil(log(cable / WIDE / self.diameter, STEP)))
        self.rims = self._rims()
        self.wheel = (2.0 * self.radius, 2.0 * self.radius, 2.0 * float(self.rims[-1, 1]))
        r = scene.winch.drum_radius
        self.ship = self._ship()
        self.spokes = np.array([[x, y, z] for y in (-r, r) for x, z in ((-r, 0.0), (r, 0.0), (0.0, -r), (0.0, r))])
        # the drum turns about y: what hauls in comes from the sheave over its top
        self.turn = 1.0 if scene.sheave.position[0] < scene.winch.position[0] else -1.0

    def _ship(self) -> np.ndarray:
        """Lines of the hull, a symbol, in base_link: its deck, ribs down to the water, the frame of the sheave."""
        symbol = hull(self.scene)
        ribs = np.stack(np.split(symbol.mesh.corners, 3)[:2], axis=1)  # of the rings at deck, water and keel
        return np.concatenate((symbol.edges, ribs, symbol.legs)).reshape(-1, 3)

    def _rims(self) -> np.ndarray:
        wheel = self.scene.sheave
        angle = np.linspace(0.0, 2.0 * pi, 37)
        circle = (wheel.radius + wheel.groove_depth) * np.column_stack((np.sin(angle), 0.0 * angle, np.cos(angle)))
        side = np.array([0.0, half_width(self.scene, self.diameter), 0.0])
        return np.concatenate((circle - side, circle + side))

    def items(self, f, shape: np.ndarray, contact: np.ndarray) -> list[Drawn]:
        """Markers of a tick, always the same (ns, id) in the same order; what has nothing to show is taken away."""
        names = SHAPE_COLUMNS + SLOPE_COLUMNS
        refuse_not_finite(shape[:, : len(names)], names, "cable/shape", f.time)
        table = contact[: f.contact_stations]
        refuse_not_finite(table, CONTACT_COLUMNS, "sheave/contact", f.time)
        ship = f.ship_quaternion
        winch = np.add(f.ship_position, rotate(ship, self.scene.winch.position))
        half = 0.5 * self.turn * f.drum_angle
        drum = times(ship, (0.0, float(np.sin(half)), 0.0, float(np.cos(half))))
        radius = self.scene.winch.drum_radius
        body = times(f.body_quaternion, ALONG_X)
        thin = 0.02 * self.radius
        seen = max(f.scope / 2000.0, thin)
        (x, y, z) = f.body_position
        plumb = np.array([(x, y, z), (x, y, 0.0)])
        return [
            *self._cable(f, shape),
            Drawn("sheave", 0, CYLINDER, f.sheave_position, times(ship, ALONG_Y), self.wheel, STEEL),
            Drawn("sheave", 1, LINE_STRIP, f.sheave_position, ship, (thin, 0.0, 0.0), RIM, self.rims),
            Drawn("drum", 0, CYLINDER, winch, times(ship, ALONG_Y), (2.0 * radius,) * 3, DRUM),
            Drawn("drum", 1, LINE_LIST, winch, drum, (0.04 * radius, 0.0, 0.0), RIM, self.spokes),
            Drawn("towbody", 0, CYLINDER, f.body_position, body, (self.thick, self.thick, self.length), BODY),
            Drawn("towbody", 1, LINE_LIST, (0.0, 0.0, 0.0), STANDING, (seen, 0.0, 0.0), BODY, plumb),
            Drawn("ship", 0, LINE_LIST, f.ship_position, ship, (seen, 0.0, 0.0), STEEL, self.ship),
            *self._contact(f, table),
            self._water(f),
            *self._texts(f),
        ]

    def _cable(self, f, shape: np.ndarray) -> list[Drawn]:
        parts = 1 if self.links else min(8, max(1, POINTS // (len(shape) - 1)))
        points, tension = cable_points(shape, parts)
        colour, last = colours(tension, self.scale.maximum), self.widths - 1
        from_sheave, from_body = _apart(points, f.sheave_position), _apart(points, f.body_position)
        away = np.minimum(from_sheave, from_body)
        away = np.minimum(away[:-1], away[1:])  # of what is between two points
        maximum = min(last, floor(log(max(f.scope / WIDE / self.diameter, 1.0), STEP)))
        times_real = np.where(away > ROUND * self.radius, away / (FINE * self.diameter), 1.0)
        level = np.minimum(np.ceil(np.log(np.maximum(times_real, 1.0)) / log(STEP)), maximum).astype(int)
        level[: np.argmin(from_sheave)] = 0  # on board
        outward = np.arange(len(level)) <= np.argmax(away)
        key = np.maximum.accumulate(np.where(outward, level, 2 * last - level))
        begins = np.searchsorted(key, np.arange(2 * last + 2))
        pieces = []
        for k, (a, b) in enumerate(zip(begins[:-1], begins[1:])):
            part = slice(a, b + 1 if b > a else a)
            scale = (self.diameter * STEP ** min(k, 2 * last - k), 0.0, 0.0)
            pieces.append(
                Drawn("cable", k, LINE_STRIP, (0.0, 0.0, 0.0), STANDING, scale, INK, points[part], colour[part])
            )
        return pieces

    def _contact(self, f, table: np.ndarray) -> list[Drawn]:
        """Line load of either flank, outwards and to its side: a sheave radius for working tension over radius."""
        kept = table[:: max(1, ceil(len(table) / STATIONS))]
        foot = kept[:, :3]
        out = foot * (1.0, 0.0, 1.0)
        out = out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
        drawn = []
        for k, (name, side, colour) in enumerate((("load_port", 1.0, PORT), ("load_starboard", -1.0, STARBOARD))):
            load = kept[:, COLUMN[name]] * self.radius / self.scene.contact.working_tension
            tall = np.clip(load, 0.0, TALLEST)[:, None] * self.radius
            tip = foot + tall * sqrt(0.5) * (out + (0.0, side, 0.0))
            lines = np.stack((foot, tip), axis=1).reshape(-1, 3)
            scale = (0.02 * self.radius, 0.0, 0.0)
            drawn.append(Drawn("contact", k, LINE_LIST, f.sheave_position, f.ship_quaternion, scale, colour, lines))
        return drawn

    def _water(self, f) -> Drawn:
        """A grid on the mean surface over ship and towbody, at rest in odom."""
        (x, y, _), (bx, by, _) = f.sheave_position, f.body_position
        cell = max(1.4 * f.layback, 0.3 * f.scope, self.radius) / 10.0
        decade = 10.0 ** floor(log10(cell))
        cell = next(n * decade for n in (1.0, 2.0, 5.0, 10.0) if n * decade >= cell)
        middle = cell * np.round(np.array([x + bx, y + by]) / (2.0 * cell))
        span = np.arange(-5, 6) * cell
        ends = np.stack((np.repeat(span, 2), np.tile((-5.0 * cell, 5.0 * cell), 11), np.zeros(22)), axis=1)
        lines = np.concatenate((ends, ends[:, (1, 0, 2)])) + (*middle, 0.0)
        width = max(f.scope / 2000.0, 0.02 * self.radius)
        return Drawn("water", 0, LINE_LIST, (0.0, 0.0, 0.0), STANDING, (width, 0.0, 0.0), WATER, lines)

    def _texts(self, f) -> list[Drawn]:
        """What is read off, at sheave and towbody, and the colours over the sheave as a bar."""
        s, tall = self.scale, max(f.scope / 50.0, 0.3 * self.radius)
        (x, y, z), (bx, by, bz) = f.sheave_position, f.body_position
        said = (
            ((x, y, z + 2.0 * tall), f"tension {s.text(f.tension)}\npay-out {f.payout:.1f} m"),
            ((x, y, z + 10.0 * tall), f"0 to {s.text(s.maximum)}"),
            ((bx, by, bz - 2.0 * tall), f"towbody, {-bz:.1f} m deep"),
        )
        height = np.linspace(3.8, 9.0, len(SCALE)) * tall
        bar = np.column_stack((0.0 * height, 0.0 * height, height))
        colour = np.ones((len(SCALE), 4))
        colour[:, :3] = SCALE
        return [
            *(
                Drawn("text", k, TEXT, place, STANDING, (0.0, 0.0, tall), INK, text=text)
                for k, (place, text) in enumerate(said)
            ),
            Drawn("text", 3, LINE_STRIP, (x, y, z), STANDING, (0.8 * tall, 0.0, 0.0), INK, bar, colour),
        ]

    def data(self, f, shape: np.ndarray, contact: np.ndarray, context: Context) -> bytes:
        """CDR bytes of the message of a tick."""
        return encode(self.items(f, shape, contact), f.time, context.odom, self.lifetime)


def check_rate(rate: float) -> None:
    """Raise BagError where a rate of cable/markers [Hz] in a bag is not 0 (none) to MAX_RATE."""
    if not 0.0 <= rate <= MAX_RATE:
        raise BagError(
            f"markers = {rate:g} Hz is outside [0, {MAX_RATE:g}] Hz; nothing was simulated. Give messages a second, "
            f"10 for example, or leave --markers out for none"
        )


def markers_channel(scene: Scene, rate: float, maximum: float | None = None) -> Channel:
    """The row of cable/markers; arguments as of TowDrawing. Nothing is read back: all of it is in other channels."""
    drawing = TowDrawing(scene, rate, maximum)
    return Channel("cable_markers", TOPIC, MSGTYPE, None, None, rate, template=lambda: drawing.data, optional=True)


def _apart(points: np.ndarray, place) -> np.ndarray:
    return np.sqrt(((points - place) ** 2).sum(axis=1))
