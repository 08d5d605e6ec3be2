"""The tow as nodes of a viser scene: made once for a scene file, moved with each moment.

Everything hangs on one node `/tow`, which stands so that what the camera follows is at the origin: single precision is
enough wherever the ship is. Numbers of the drawing: docs/view.md.
"""

from __future__ import annotations

from math import ceil, floor, log10, radians, sin
from typing import Any

import numpy as np

from ...io.messages import shapes
from ...io.messages.markers import body_size, cable_points, colour_scale, colours
from ...io.messages.rotation import rotate
from ...physics.section import CableModel
from ...plots.sea_surface import SeaSurface
from ...sim.scene import Scene
from .cameras import WHOLE, ahead, followed
from .moment import ARC, COLUMN, Moment, force, parts_of, smooth_shape

ABOARD = 25.0  # sheave radii outboard of it to which the cable is drawn with the ship
FAR = 0.03  # of the scope: length of the mark for the towbody in the whole tow
TAIL = 6.0  # lengths of the towbody about it in which the cable is drawn with it
LAST = 32  # points of the last element
STATIONS = 48  # of the contact
LOADS = [COLUMN["load_port"], COLUMN["load_starboard"]]
LEAST = 1e-3  # of the bar of a radius: shorter ones are left out
TALLEST = 3.0  # sheave radii, of a bar of line load
SPREAD = radians(30.0)  # of the two flanks' bars from the plane of the sheave
HULL, DECK, STEEL, DARK, RIM = (122, 134, 148), (70, 80, 92), (165, 172, 180), (74, 80, 88), (40, 46, 54)
LIGHT = (112, 120, 130)
ORANGE, WATER, SAND, GRID = (240, 130, 30), (70, 130, 190), (196, 172, 128), (110, 140, 170)
PORT, STARBOARD, INK, STALE = (205, 50, 45), (20, 150, 90), (30, 38, 48), (150, 150, 150)
SKY, DEEP = (250, 251, 253), (198, 214, 230)  # of the ground, top and bottom
BROAD = 0.6  # breadth over length of water and seabed
CELLS = (48, 32)  # of the water surface
LIFT = 4e-3  # of a cell, the lines of a level sheet over it
SHARP = 10.0  # cells a wave, at least
ROOT = "/tow"
# the page takes colours at points as light and shows them by the curve of a screen: this undoes it
LINEAR = np.array([c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in np.arange(256) / 255.0])
LINEAR = np.round(255.0 * LINEAR).astype(np.uint8)


def wxyz(q: Any) -> tuple[float, float, float, float]:
    """A quaternion x y z w in viser's order."""
    x, y, z, w = (float(part) for part in q)
    return w, x, y, z


def nice(value: float) -> float:
    """1, 2 or 5 times a power of ten, at or above a value."""
    decade = 10.0 ** floor(log10(max(value, 1e-12)))
    return next(n * decade for n in (1.0, 2.0, 5.0, 10.0) if n * decade >= value * (1.0 - 1e-9))


class Stage:
    """Draws moments of one scene on a viser server.

    top: of the colours [N], None: from the scene; sea: surface to draw, None where it is level.
    """

    def __init__(self, server: Any, scene: Scene, top: float | None = None, sea: SeaSurface | None = None) -> None:
        self.server, self.scene, self.sea = server, scene, sea
        self.scale = colour_scale(scene, top)
        self.body = body_size(scene)
        self.hull = shapes.hull(scene)
        self.cable_diameter, self.links = scene.cable.diameter, scene.cable.model is CableModel.SEGMENTS
        self.load_unit = nice(0.5 * scene.contact.working_tension / scene.sheave.radius)  # N/m, a radius long
        self.follow = WHOLE
        self.stale = ""
        self.moment: Moment | None = None
        self._sizes: dict[str, tuple] = {}
        self._bodies = self._line_bodies()
        self._still()

    # ---- what is made once

    def _line_bodies(self) -> list[tuple[str, float, float, float]]:
        """Name, unstretched length between it and the towbody [m], length and diameter of each body on the line."""
        names, found = list(self.scene.cable.sections), []
        for name, body in self.scene.bodies.items():
            after = names[names.index(body.at) + 1 :]
            rest = sum(self.scene.cable.sections[section].length for section in after)
            found.append((name, rest, *body_size(self.scene.model_copy(update={"towbody": body}))))
        return found

    def _mesh(self, name: str, mesh: shapes.Mesh, color: tuple, **more: Any) -> Any:
        return self.server.scene.add_mesh_simple(
            name, mesh.corners.astype(np.float32), mesh.faces.astype(np.uint32), color=color, side="double", **more
        )

    def _lines(self, name: str, lines: np.ndarray, color: tuple, thickness: float, world: bool = False) -> Any:
        units = "world" if world else "screen"
        return self.server.scene.add_line_segments(
            name, lines.astype(np.float32), color, thickness=thickness, thickness_units=units
        )

    def _still(self) -> None:
        view, scene, d = self.server.scene, self.scene, self.cable_diameter
        view.set_up_direction("+z")
        view.configure_environment_map(None)
        view.configure_default_lights(enabled=True, cast_shadow=False)
        view.add_light_hemisphere("/light/sky", sky_color=(255, 255, 255), ground_color=(150, 160, 172), intensity=1.8)
        shade = np.linspace(0.0, 1.0, 64)[:, None, None]
        ground = (1.0 - shade) * np.array(SKY) + shade * np.array(DEEP)
        view.set_background_image(np.repeat(ground, 8, axis=1).astype(np.uint8), format="png")
        self.tow = view.add_frame(ROOT, show_axes=False)
        self.ship = view.add_frame(f"{ROOT}/ship", show_axes=False)
        ship = f"{ROOT}/ship"
        r = scene.sheave.radius
        self._mesh(f"{ship}/hull", self.hull.mesh, HULL, flat_shading=True)
        self._lines(f"{ship}/edge", self.hull.edges, INK, 1.2)
        self._lines(f"{ship}/frame", self.hull.legs[:3], DARK, 0.16 * r, world=True)
        self._lines(f"{ship}/hanger", self.hull.legs[3:], DARK, 0.035 * r, world=True)
        view.add_frame(f"{ship}/sheave", show_axes=False, position=scene.sheave.position)
        self._mesh(f"{ship}/sheave/core", shapes.sheave_core(scene, d), STEEL)
        self._mesh(f"{ship}/sheave/flanges", shapes.sheave_flanges(scene, d), STEEL, opacity=0.35)
        self._lines(f"{ship}/sheave/rims", shapes.rims(scene, d), RIM, 2.0)
        self.port = self._lines(f"{ship}/sheave/load_port", np.zeros((1, 2, 3)), PORT, 0.035 * r, world=True)
        self.starboard = self._lines(
            f"{ship}/sheave/load_starboard", np.zeros((1, 2, 3)), STARBOARD, 0.035 * r, world=True
        )
        self.drum = view.add_frame(f"{ship}/drum", show_axes=False, position=scene.winch.position)
        self._mesh(f"{ship}/drum/body", shapes.drum(scene), LIGHT, flat_shading=True)
        self._lines(f"{ship}/drum/marks", shapes.drum_marks(scene), (230, 232, 235), 2.0)
        self._cradle(ship)
        # the page takes new points of a line later than a new place of a node: what is looked at closely is given in
        # the axes of the ship and from the towbody, where it hardly changes
        self.at_fish = view.add_frame(f"{ROOT}/at_fish", show_axes=False)
        self.deck, self.tail = self._cable_lines(ship, d), self._cable_lines(f"{ROOT}/at_fish", d)
        self.cable = self._cable_lines(ROOT, None)
        self.fish = view.add_frame(f"{ROOT}/fish", show_axes=False)
        self._mesh(f"{ROOT}/fish/body", shapes.torpedo(*self.body), ORANGE)
        self._mesh(f"{ROOT}/fish/fins", shapes.fins(*self.body), DARK)
        self.fish_label = view.add_label(f"{ROOT}/fish/label", "towbody", anchor="top-center", font_screen_scale=1.1,
                                         position=(0.0, 0.0, -1.2 * self.body[1]))  # fmt: skip
        self.sheave_label = view.add_label(f"{ship}/sheave/label", "sheave", anchor="top-center",
                                           font_screen_scale=1.1)  # fmt: skip
        self.hung = []
        for name, _, length, thick in self._bodies:
            frame = view.add_frame(f"{ROOT}/line_{name}", show_axes=False)
            self._mesh(f"{ROOT}/line_{name}/body", shapes.torpedo(length, thick), ORANGE)
            view.add_label(f"{ROOT}/line_{name}/label", name, anchor="top-center", position=(0.0, 0.0, -1.2 * thick))
            self.hung.append(frame)
        patch = shapes.Mesh(np.zeros((CELLS[0] * CELLS[1], 3)), shapes.lattice(CELLS))
        self.water = self._mesh(f"{ROOT}/water", patch, WATER, opacity=0.20)
        self.grid = self._lines(f"{ROOT}/grid", np.zeros((1, 2, 3)), GRID, 1.0)
        self.bed = self.bed_grid = None
        if scene.seabed.depth is not None:
            flat = shapes.Mesh(np.zeros((4, 3)), shapes.lattice((2, 2)))
            self.bed = self._mesh(f"{ROOT}/seabed", flat, SAND, flat_shading=True)
            self.bed_grid = self._lines(f"{ROOT}/seabed_grid", np.zeros((1, 2, 3)), (150, 125, 85), 1.0)
        self.plumb = self._lines(f"{ROOT}/plumb", np.zeros((1, 2, 3)), ORANGE, 1.5)
        self.mark = self._mesh(f"{ROOT}/fish_mark", shapes.torpedo(1.0, 0.45), ORANGE)
        self.notice: Any = None
        self.notice_at, self.nudge = np.zeros(3), 1e-4

    def _cable_lines(self, parent: str, diameter: float | None) -> tuple:
        """Nodes of a piece of the cable: a line some pixels wide, and one of its diameter."""
        blank, grey = np.zeros((1, 2, 3), np.float32), np.zeros((1, 2, 3), np.uint8)
        add, seen = self.server.scene.add_line_segments, {"thickness": 4.0, "thickness_units": "screen"}
        nodes = [add(f"{parent}/cable", blank, grey, **seen)]
        if diameter is not None:
            nodes.append(add(f"{parent}/cable_to_scale", blank, grey, thickness=diameter, thickness_units="world"))
        return tuple(nodes)

    def _cradle(self, ship: str) -> None:
        """What carries the drum, down to the deck."""
        x, y, z = self.scene.winch.position
        r, half = self.scene.winch.drum_radius, 1.3 * shapes.drum_half(self.scene)
        lines = [
            ((x, y + side * half, z), (x + foot * r, y + side * half, min(self.hull.deck, z)))
            for side in (-1.0, 1.0) for foot in (-1.2, 1.2)
        ]  # fmt: skip
        self._lines(f"{ship}/cradle", np.array(lines), HULL, 0.18 * r, world=True)

    # ---- what moves

    def show(self, moment: Moment) -> None:
        """Draw a moment."""
        self.moment = moment
        f = moment.frame
        anchor = np.array(f["ship_position"]) * (1.0, 1.0, 0.0)
        with self.server.atomic():
            self.tow.position = anchor - followed(self.follow, self.scene, moment)
            self.ship.position, self.ship.wxyz = f["ship_position"] - anchor, wxyz(f["ship_quaternion"])
            turn = 1.0 if self.scene.sheave.position[0] < self.scene.winch.position[0] else -1.0
            half = 0.5 * turn * float(f["drum_angle"])
            self.drum.wxyz = (float(np.cos(half)), 0.0, float(np.sin(half)), 0.0)
            self.fish.position, self.fish.wxyz = f["body_position"] - anchor, wxyz(f["body_quaternion"])
            self._draw_cable(moment, anchor)
            self._draw_loads(moment)
            self._draw_water(moment, anchor)
            self.fish_label.text = f"towbody, {-float(f['body_position'][2]):.1f} m deep"
            self.sheave_label.text = f"{force(float(f['tension']))} at the sheave"
            self._draw_far(f, anchor)

    def _draw_far(self, f: Any, anchor: np.ndarray) -> None:
        """What shows the depth where the whole tow is looked at: a line up to the surface, a mark for the towbody."""
        far = self.follow == WHOLE
        self.plumb.visible = self.mark.visible = far
        self.sheave_label.position = (0.0, 0.0, 0.16 * self.hull.length if far else -1.35 * self.scene.sheave.radius)
        if not far:
            self.fish_label.position = (0.0, 0.0, -1.2 * self.body[1])
            return
        fish = np.array(f["body_position"]) - anchor
        self.plumb.points = np.array([[fish, fish * (1.0, 1.0, 0.0)]], np.float32)
        size = max(self.body[0], FAR * float(f["scope"]))
        self.mark.position, self.mark.wxyz, self.mark.scale = fish, self.fish.wxyz, size
        self.fish_label.position = (0.0, 0.0, -0.3 * size)

    def set_stale(self, text: str) -> None:
        """Say over the picture that it is not the present, "": it is. Then the cable is grey."""
        if text == self.stale:
            if self.notice is not None:  # the page lays out a text after it drew, and draws again where something moves
                self.nudge = -self.nudge
                self.notice.position = self.notice_at + (0.0, 0.0, self.nudge)
            return
        changed, self.stale = bool(text) != bool(self.stale), text
        self._put_notice()
        if changed and self.moment is not None:
            self.show(self.moment)

    def put_notice_at(self, place: np.ndarray) -> None:
        """Where the middle of the picture is."""
        self.notice_at = place
        self._put_notice()

    def _put_notice(self) -> None:
        """A label made anew: the page does not lay out a text that changes while it is hidden."""
        if self.notice is not None:
            self.notice.remove()
            self.notice = None
        if self.stale:
            self.notice = self.server.scene.add_label(
                "/notice", self.stale, anchor="center-center", font_screen_scale=2.4, position=self.notice_at
            )

    def _draw_cable(self, moment: Moment, anchor: np.ndarray) -> None:
        parts = 1 if self.links else parts_of(moment.shape)
        smooth = smooth_shape(moment.shape)
        points, tension = cable_points(smooth, parts)
        if not self.links:  # the camera comes close to the last element
            end, pull = cable_points(smooth[-2:], LAST)
            points = np.concatenate((points[: -parts - 1], end))
            tension = np.concatenate((tension[: -parts - 1], pull))
        shade = (colours(tension, self.scale.maximum)[:, :3] * 255.0).astype(np.uint8)
        if self.stale:
            shade[:] = STALE
        shade = LINEAR[shade]
        f, r = moment.frame, self.scene.sheave.radius
        from_sheave = np.linalg.norm(points - f["sheave_position"], axis=1)
        at = int(np.argmin(from_sheave))
        deck = min(at + int(np.argmax(np.append(from_sheave[at:], np.inf) > ABOARD * r)), len(points) - 2)
        from_body = np.linalg.norm(points - f["body_position"], axis=1)
        tail = max(int(np.argmax(from_body < TAIL * self.body[0])), deck + 1)
        turned = np.array([rotate(f["ship_quaternion"], axis) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]).T
        self._put(self.deck, (points[: deck + 1] - f["ship_position"]) @ turned, shade[: deck + 1])
        self._put(self.cable, points[deck : tail + 1] - anchor, shade[deck : tail + 1])
        self._put(self.tail, points[tail:] - f["body_position"], shade[tail:])
        self.at_fish.position = self.fish.position
        arc = moment.shape[:, ARC]
        for frame, (_, rest, *_size) in zip(self.hung, self._bodies):
            where = arc[-1] - rest
            frame.position = [float(np.interp(where, arc, moment.shape[:, k])) - anchor[k] for k in range(3)]
            frame.wxyz = self.fish.wxyz

    @staticmethod
    def _put(nodes: tuple, place: np.ndarray, shade: np.ndarray) -> None:
        """A piece of the cable, as a line of a few pixels and at its own diameter."""
        if len(place) < 2:
            place, shade = np.zeros((2, 3)), np.zeros((2, 3), np.uint8)
        place = place.astype(np.float32)
        for node in nodes:
            node.points = np.stack((place[:-1], place[1:]), axis=1)
            node.colors = np.stack((shade[:-1], shade[1:]), axis=1)

    def _draw_loads(self, moment: Moment) -> None:
        """A bar outwards at each contact point for the load of either half."""
        r, table = self.scene.sheave.radius, moment.contact
        table = table[table[:, LOADS].sum(axis=1) > LEAST * self.load_unit]
        table = table[:: max(1, ceil(len(table) / STATIONS))]
        foot = table[:, :3]
        out = foot * (1.0, 0.0, 1.0)
        out = out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
        for node, name, side in ((self.port, "load_port", 1.0), (self.starboard, "load_starboard", -1.0)):
            tall = np.clip(table[:, COLUMN[name]] / self.load_unit, 0.0, TALLEST)[:, None] * r
            tip = foot + tall * (np.cos(SPREAD) * out + (0.0, side * sin(SPREAD), 0.0))
            bars = np.stack((foot, tip), axis=1)
            envelope = np.stack((tip[:-1], tip[1:]), axis=1)
            lines = np.concatenate((bars, envelope)) if len(table) else np.zeros((1, 2, 3))
            node.points = lines.astype(np.float32)

    def _draw_water(self, moment: Moment, anchor: np.ndarray) -> None:
        """Surface, level or with the waves of the scene, and seabed; what is level is moved, not sent again."""
        f = moment.frame
        reach = nice(max(1.3 * float(f["layback"]), 0.25 * float(f["scope"]), self.hull.length))
        cell = nice(reach / 10.0)
        middle = cell * np.round(0.5 * (f["sheave_position"] + f["body_position"])[:2] / cell)
        long = int(np.argmax(np.abs(ahead(moment)[:2])))  # the axis of odom that the tow lies along
        half = (reach, BROAD * reach) if long == 0 else (BROAD * reach, reach)
        if self.sea is not None and self.sea.agrees:
            self._wave(moment, anchor, middle, reach, long)
        else:
            self._level("water", self.water, self.grid, half, cell)
            for node in (self.water, self.grid):
                node.position = (*(middle - anchor[:2]), 0.0)
        if self.bed is not None and self.bed_grid is not None:
            self._level("bed", self.bed, self.bed_grid, half, cell)
            for node in (self.bed, self.bed_grid):
                node.position = (*(middle - anchor[:2]), -float(self.scene.seabed.depth or 0.0))

    def _level(self, name: str, sheet: Any, grid: Any, half: tuple[float, float], cell: float) -> None:
        """A level sheet about its own middle with lines a cell apart, each in pieces, which are clipped one by one."""
        if self._sizes.get(name) == (half, cell):
            return
        self._sizes[name] = (half, cell)
        x, y = (np.linspace(-side, side, n) for side, n in zip(half, CELLS if name == "water" else (2, 2)))
        places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        sheet.vertices = np.column_stack((places, np.zeros(len(places)))).astype(np.float32)
        lines = [cell * np.arange(-round(side / cell), round(side / cell) + 1) for side in half]
        both = np.meshgrid(*lines, indexing="ij")
        table = np.stack((*both, np.full_like(both[0], LIFT * cell)), axis=-1)
        grid.points = _lattice_lines(table)

    def _wave(self, moment: Moment, anchor: np.ndarray, middle: np.ndarray, reach: float, long: int) -> None:
        assert self.sea is not None
        half = np.array([reach, BROAD * reach])
        widest = 0.5 * self.sea.length / SHARP * np.array(CELLS)
        if (half > widest).any():
            half = np.minimum(half, widest)
            middle = np.array(moment.frame["ship_position"][:2])
        along, across = (middle[k] + np.linspace(-h, h, n) for k, h, n in zip((long, 1 - long), half, CELLS))
        both = np.meshgrid(along, across, indexing="ij")
        places = np.stack(both if long == 0 else both[::-1], axis=-1)
        z = self.sea(places[..., 0], places[..., 1], self.sea.at(moment.frame))
        table = np.concatenate((places - anchor[:2], z[..., None]), axis=-1)
        self.water.vertices = table.reshape(-1, 3).astype(np.float32)
        self.grid.points = np.concatenate(
            (_lattice_lines(table[::2], along=1), _lattice_lines(table[:, ::2], along=0)), axis=0
        )
        if self._sizes.pop("water", None):  # it was level until the waves were known
            self.water.position = self.grid.position = (0.0, 0.0, 0.0)

    def legend_text(self) -> str:
        """How long a bar of line load is."""
        return f"line load on the groove: a bar as long as the sheave's radius is {self.load_unit / 1e3:g} kN/m"


def _lattice_lines(table: np.ndarray, along: int | None = None) -> np.ndarray:
    """Pieces [n, 2, 3] of the lines of a lattice of points [n, m, 3]; along: those of one direction only."""
    ways = (
        np.stack((table[:-1], table[1:]), axis=2).reshape(-1, 2, 3),
        np.stack((table[:, :-1], table[:, 1:]), axis=2).reshape(-1, 2, 3),
    )
    return (np.concatenate(ways) if along is None else ways[along]).astype(np.float32)
