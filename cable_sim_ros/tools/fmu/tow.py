"""The tow inside an FMU, without FMI: inputs by name, a communication step in ticks, outputs by name."""

from __future__ import annotations

import json
import tempfile
import warnings
from collections import Counter
from math import atan2, cos, isfinite, radians, sin
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import CableSimError, RunError
from ...io.scenes.load import override, scene_from_text
from ...physics.towbody import BodyModel
from ...runs.settings import apply_to_scene, refuse_without_bag, settings_of
from ...sim.inputs import ShipMotion, VehicleMotion, WinchCommand
from ...sim.saved import savefile
from ...sim.scene import Scene
from ...sim.simulator import Simulator
from ...sim.statics.vehicle_shape import pose_of
from ...sim.verdict import judge_counts, overload
from ...version import __version__
from .variables import DOUBTFUL, FAILED, LENGTH, NO_COMMAND, OK, RATE

SCENE_FILE, ABOUT_FILE = "scene.yaml", "about.json"  # in the resources of the FMU
VERDICT = "health.verdict"
VERDICTS = {"ok": OK, "doubtful": DOUBTFUL, "failed": FAILED}
CLOCK = 1000  # ns, by which the master's time in s may differ from ours
MISFIT = (0.2, 0.1)  # m/s, rad/s: mean rate of a step against the mean of the rates at its ends
SPEED = 0.1  # m/s, of the ship at the start beside ship.tow_speed
STEP_TEXT = (
    "communication step of {h:.9g} s at {t:.9g} s: {why}; nothing was simulated. Take a multiple of {tick:g} s (the "
    "tick, solver.tick of the scene), at most {most:g} s"
)


class FmuError(CableSimError, ValueError):
    """What the FMU was given cannot be served; the text is one line."""


class Tow:
    """One instance. Use: values[...] = ..., start(t0), step(t, h), output(name)."""

    def __init__(self, resources: str | Path):
        folder = Path(resources)
        self.about = json.loads((folder / ABOUT_FILE).read_text("utf-8"))
        text = (folder / SCENE_FILE).read_text("utf-8")
        with warnings.catch_warnings(record=True) as found:
            self.base = scene_from_text(text, f"scene of the FMU {self.about['name']}")
        self.scene: Scene = self.base
        self.values: dict[str, Any] = start_values(self.base, self.about["parameters"])
        self.said = [str(one.message) for one in found]  # warnings that nobody has been told yet
        self.begin = 0  # ns
        self.sim: Simulator | None = None
        self.initialized = False
        self.statuses: Counter[int] = Counter()
        self.peaks = (0.0, 0.0)
        self.largest = 0.0  # N
        self.misfit = 0.0
        self.problem = ""
        self._used: dict[str, Any] = {}
        self._last: ShipMotion | None = None
        self._out: dict[str, Any] = {}
        if self.about["version"] != __version__:
            self.said.append(f"made by cable_sim_ros {self.about['version']}, run by {__version__}: figures may differ")

    def set(self, name: str, value: Any) -> None:
        """Give an input or a parameter."""
        self.values[name] = value

    def begin_at(self, seconds: float) -> None:
        """The time of the start. Raises FmuError."""
        if not 0.0 <= seconds < 9e9:
            raise FmuError(f"start time of {seconds:g} s is outside [0, 9e9) s; nothing was started. Shift the clock")
        self.begin = round(seconds * 1e9)

    def start(self) -> None:
        """End of the initialization: as `_solve`. Steps may follow."""
        self._solve()
        self.initialized = True

    def _solve(self) -> None:
        """Static equilibrium at the pose of the inputs; again where they were changed since. Raises CableSimError."""
        if self.sim is not None and self._used == self.values:
            return
        values, scene = dict(self.values), self.base
        own = {key: values[key] for key in self.about["parameters"] if values[key] != _value_of(self.base, key)}
        if own:
            scene = override(scene, own)
        if text := str(values["settings"]).strip():
            asked = settings_of(part for part in text.split(";") if part.strip())
            refuse_without_bag(asked, {}, "that of the inputs ship.*")
            scene = apply_to_scene(scene, asked)
        if (scene.towbody.model is BodyModel.VEHICLE) is not (self.base.towbody.model is BodyModel.VEHICLE):
            raise FmuError(
                f"settings make towbody.model {scene.towbody.model.value} of {self.base.towbody.model.value}: the "
                f"variables of the FMU are those of the scene it was made of; nothing was started. Make another FMU"
            )
        sim = Simulator(scene)
        self._push_vehicle(sim, scene, self.begin)
        if values["ship.from_scene"]:
            self._last = None
            sim.start(self.begin)
        else:
            motion = self._motion(self.begin)
            yaw = motion.angles[2]
            sim.start(self.begin, motion.position[:2], yaw)
            sim.push(motion)
            self._last = motion
            self._check_speed(scene, motion, yaw)
        self.scene, self.sim, self._used = scene, sim, values
        self.statuses.clear()
        self.problem, self.misfit, self._out = "", 0.0, {}
        self.peaks, self.largest = (float(sim.frame.tension),) * 2, float(sim.frame.tension_most)

    def seconds(self) -> float:
        """Simulation time [s]."""
        return 1e-9 * (self.begin if self.sim is None else int(self.sim.frame.time))

    def step(self, t: float, h: float) -> None:
        """Simulate from t to t + h [s]. Inputs ship.*: motion at t + h. Raises CableSimError; then nothing moved."""
        if not self.initialized:
            raise FmuError(
                f"communication step of {h:.9g} s at {t:.9g} s before the end of the initialization; nothing was "
                f"simulated. Call exitInitializationMode first: with it the static start takes the inputs"
            )
        sim = self.sim
        assert sim is not None
        if self.problem:
            raise FmuError(f"the simulation had ended: {self.problem}")
        ticks, end = self._ticks(sim, t, h)
        command = self._command()
        if command is not None and h > self.scene.winch.command_timeout and self.values["winch.mode"] == RATE:
            raise FmuError(
                f"communication step of {h:g} s is longer than winch.command_timeout = "
                f"{self.scene.winch.command_timeout:g} s, in which a rate has to be repeated; nothing was simulated. "
                f"Take a shorter step, or a larger winch.command_timeout"
            )
        if not self.values["ship.from_scene"]:
            motion = self._motion(end)
            self._check_fit(motion, h)
            sim.push(motion)
            self._last = motion
        self._push_vehicle(sim, self.scene, end)
        if command is not None:
            sim.push(command)
        self._out = {}
        try:
            frames = sim.run(ticks)
        except RunError as error:
            self.problem = str(error)
            raise
        status, counts = np.unique(frames["status"], return_counts=True)
        self.statuses.update(dict(zip(map(int, status), map(int, counts))))
        self.peaks = float(frames["tension_tick_min"].min()), float(frames["tension_tick_max"].max())
        self.largest = max(self.largest, float(frames["tension_most"].max()))

    def start_once(self) -> None:
        """Solve the start for outputs of the initialization, where that is not done yet."""
        if self.sim is None:
            self._solve()

    def output(self, name: str) -> Any:
        """An output by name, at the end of the last step."""
        self.start_once()
        assert self.sim is not None
        if not self._out:
            self._out = self._outputs()
        if name == VERDICT and VERDICT not in self._out:  # costs more than all others, and few ask each step
            self._out[VERDICT] = self._verdict(int(self.sim.frame.status))
        return self._out[name]

    def state(self) -> dict[str, Any]:
        """Everything that changes, as copies."""
        self.start_once()
        assert self.sim is not None
        own = {"values": dict(self.values), "used": dict(self._used), "begin": self.begin, "problem": self.problem}
        own |= {"statuses": dict(self.statuses), "peaks": self.peaks, "largest": self.largest, "misfit": self.misfit}
        return {"own": own, "last": self._last, "scene": self.scene, "arrays": self.sim.snapshot()}

    def restore(self, state: dict[str, Any]) -> None:
        """Take back a state() of this FMU, or what from_bytes() gives. Raises SaveError, CableSimError."""
        own = state["own"]
        self.values = dict(own["used"])
        self.begin = own["begin"]
        self.start()
        assert self.sim is not None
        if "arrays" in state:
            self.sim.restore(state["arrays"])
        else:
            with tempfile.TemporaryDirectory(prefix="cable_sim_fmu_") as folder:
                path = Path(folder) / "state.npz"
                path.write_bytes(state["file"])
                self.sim.load_state(path)
        self.values, self.problem, self.misfit = dict(own["values"]), own["problem"], own["misfit"]
        self.statuses = Counter({int(k): int(v) for k, v in own["statuses"].items()})
        self.peaks, self.largest, self._last = tuple(own["peaks"]), own["largest"], state["last"]
        self._out = {}

    @staticmethod
    def to_bytes(state: dict[str, Any]) -> bytes:
        """A state as bytes: the file of Simulator.save behind a line of JSON."""
        if "bytes" not in state:
            file = state.get("file")
            if file is None:
                with tempfile.TemporaryDirectory(prefix="cable_sim_fmu_") as folder:
                    path = Path(folder) / "state.npz"
                    savefile.write(path, state["scene"], state["arrays"])
                    file = path.read_bytes()
            last = state["last"]
            said = {"own": state["own"], "last": None if last is None else _plain(last)}
            state["bytes"] = json.dumps(said).encode() + b"\n" + file
        return state["bytes"]

    @staticmethod
    def from_bytes(data: bytes) -> dict[str, Any]:
        """A state of to_bytes(); what is wrong with its numbers is found when it is restored. Raises FmuError."""
        head, _, file = bytes(data).partition(b"\n")
        try:
            said = json.loads(head)
            last = said["last"]
            motion = None if last is None else ShipMotion(**last)
            names = ("values", "used", "begin", "problem", "statuses", "peaks", "largest", "misfit")
            return {"own": {name: said["own"][name] for name in names}, "last": motion, "file": file}
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise FmuError(
                f"serialized state: is none of this FMU ({type(error).__name__}); nothing was taken"
            ) from None

    def _push_vehicle(self, sim: Simulator, scene: Scene, when: int) -> None:
        """The pose of the vehicle at a time [ns], where the scene has one."""
        if scene.towbody.model is BodyModel.VEHICLE:
            sim.push(self._motion(when, "vehicle", VehicleMotion))

    def _motion(self, when: int, of: str = "ship", kind: type[ShipMotion] = ShipMotion) -> ShipMotion:
        def vector(name: str, axes=("x", "y", "z")) -> tuple[float, ...]:
            return tuple(float(self.values[f"{of}.{name}.{axis}"]) for axis in axes)

        return kind(
            time_ns=when,
            position=vector("position"),  # type: ignore[arg-type]
            velocity=vector("velocity"),  # type: ignore[arg-type]
            attitude=vector("attitude", ("roll", "pitch", "yaw")),  # type: ignore[arg-type]
            rate=vector("rate"),  # type: ignore[arg-type]
        )

    def _command(self) -> WinchCommand | None:
        mode = self.values["winch.mode"]
        if mode == NO_COMMAND:
            return None
        if mode == RATE:
            return WinchCommand(rate=self.values["winch.rate"])
        if mode == LENGTH:
            return WinchCommand(payout=self.values["winch.length"])
        raise FmuError(f"winch.mode = {mode}: is none of 0 (no command), 1 (rate), 2 (length); nothing was simulated")

    def _ticks(self, sim: Simulator, t: float, h: float) -> tuple[int, int]:
        tick, now = int(sim.model.settings[0].tick_ns), int(sim.frame.time)
        limits = {"h": h, "t": t, "tick": tick * 1e-9, "most": self.scene.ship.max_gap}
        length = round(h * 1e9) if isfinite(h) and abs(h) < 1e9 else 0
        ticks = round(length / tick)
        if ticks < 1 or abs(length - ticks * tick) > 1:
            raise FmuError(STEP_TEXT.format(why="is no multiple of the tick", **limits))
        gap = self.scene.vehicle.max_gap
        if h > gap and self.scene.towbody.model is BodyModel.VEHICLE:
            why = "is longer than vehicle.max_gap, above which poses are not interpolated"
            raise FmuError(STEP_TEXT.format(why=why, **limits | {"most": gap}))
        if h > self.scene.ship.max_gap and not self.values["ship.from_scene"]:
            why = "is longer than ship.max_gap, above which samples are not interpolated"
            raise FmuError(STEP_TEXT.format(why=why, **limits))
        if not (isfinite(t) and abs(t * 1e9 - now) <= CLOCK):
            raise FmuError(
                f"communication point {t:.9g} s is not the end of the last step, {now * 1e-9:.9g} s; nothing was "
                f"simulated. Go on there, or set a saved state first"
            )
        return ticks, now + ticks * tick

    def _check_fit(self, motion: ShipMotion, h: float) -> None:
        """Warn once where positions and velocities contradict each other: the cubic between them would swing."""
        if self._last is None:
            return
        here, then = np.array(motion.row(0.0, self._last.angles[2])[:12]), np.array(self._last.row(0.0)[:12])
        off = np.abs((here[:6] - then[:6]) / h - 0.5 * (here[6:] + then[6:])) / np.repeat(MISFIT, 3)
        before, self.misfit = self.misfit, max(self.misfit, float(off.max()))
        if before <= 1.0 < self.misfit:
            what = ("x", "y", "z", "roll", "pitch", "yaw")[int(off.argmax())]
            self.said.append(
                f"ship motion at {motion.time_ns * 1e-9:.6g} s: {what} and its rate contradict each other by "
                f"{off.max() * MISFIT[int(off.argmax()) // 3]:.3g} {'m/s' if off.argmax() < 3 else 'rad/s'} over the "
                f"step, so that the cubic between samples swings; check that both are of the end of the step, and axes"
            )

    def _check_speed(self, scene: Scene, motion: ShipMotion, yaw: float) -> None:
        mean = (scene.ship.tow_speed * cos(yaw), scene.ship.tow_speed * sin(yaw))
        off = float(np.hypot(motion.velocity[0] - mean[0], motion.velocity[1] - mean[1]))
        if off > SPEED:
            self.said.append(
                f"ship.velocity at the start is {off:.3g} m/s off ship.tow_speed = {scene.ship.tow_speed:g} m/s, with "
                f"which the static start was found; it is taken up over ship.start_blend = {scene.ship.start_blend:g} s"
            )

    def _outputs(self) -> dict[str, Any]:
        sim = self.sim
        assert sim is not None
        frame = sim.frame
        force = np.array(frame.tension_vector)
        turn, arm = matrix(frame.ship_quaternion), np.array(self.scene.sheave.position)
        radius = float(sim.state.surfaces[int(sim.model.settings[0].sheave)]["radius"])
        angle = atan2(-force[2], -force[0])  # of wrap, from the top of the sheave, positive aft
        arm = arm + radius * np.array((-sin(angle), 0.0, cos(angle)))
        out: dict[str, Any] = {}
        if self.scene.towbody.model is BodyModel.VEHICLE:
            for name, values in (("force", frame.vehicle_force), ("moment", frame.vehicle_moment)):
                out |= {f"vehicle.{name}.{axis}": float(value) for axis, value in zip("xyz", values)}
            out["vehicle.off"] = float(frame.vehicle_off)
        for name, values in (
            ("force.world", turn @ force),
            ("force.ship", force),
            ("force.point_world", np.array(frame.ship_position) + turn @ arm),
            ("force.point_ship", arm),
            ("force.moment_ship", np.cross(arm, force)),
            ("body.position", frame.body_position),
            ("body.velocity", frame.body_velocity),
            ("body.quaternion", frame.body_quaternion),
        ):
            out |= {f"{name}.{axis}": float(value) for axis, value in zip("xyzw", values)}
        for group, fields in (
            ("cable", ("tension", "tension_drum", "tension_body", "departure_angle")),
            ("winch", ("payout", "payout_rate", "scope", "cable_on_drum")),
            ("body", ("layback",)),
            ("health", ("energy_residual", "tension_damped", "penetration")),
        ):
            out |= {f"{group}.{name}": float(frame[name]) for name in fields}
        out["body.depth"] = -float(frame.body_position[2])
        out["cable.tension_least"], out["cable.tension_largest"] = self.peaks
        out["health.motion_misfit"] = self.misfit
        out["health.status"] = int(frame.status)
        seen = int(frame.status)
        for status in self.statuses:
            seen |= status
        out["health.status_any"] = seen
        return out

    def _verdict(self, status: int) -> int:
        tick = self.scene.solver.tick
        over = overload(self.scene, self.largest)
        found = judge_counts(self.statuses, tick, status, scene=self.scene, others=over, problem=self.problem)
        return VERDICTS[found.state]


def start_values(scene: Scene, parameters: dict[str, float]) -> dict[str, Any]:
    """Inputs and parameters before they are set: the ship on the mean track of the scene, no command."""
    yaw, speed = radians(scene.ship.heading_deg), scene.ship.tow_speed
    values: dict[str, Any] = {f"ship.{name}.{axis}": 0.0 for name in ("position", "velocity", "rate") for axis in "xyz"}
    values |= {f"ship.attitude.{name}": 0.0 for name in ("roll", "pitch")} | {"ship.attitude.yaw": yaw}
    values |= {"ship.velocity.x": speed * cos(yaw), "ship.velocity.y": speed * sin(yaw)}
    values |= {"ship.position.z": scene.ship.reference_height}
    if scene.towbody.model is BodyModel.VEHICLE:
        x, y, z, *attitude = pose_of(scene, yaw)
        values |= {f"vehicle.{name}.{axis}": 0.0 for name in ("velocity", "rate") for axis in "xyz"}
        values |= {f"vehicle.position.{axis}": value for axis, value in zip("xyz", (x, y, z))}
        values |= {f"vehicle.attitude.{name}": value for name, value in zip(("roll", "pitch", "yaw"), attitude)}
        values |= {f"vehicle.velocity.{axis}": values[f"ship.velocity.{axis}"] for axis in "xy"}
    values |= {"winch.mode": NO_COMMAND, "winch.rate": 0.0, "winch.length": 0.0}
    return values | {"ship.from_scene": False, "settings": ""} | dict(parameters)


def matrix(quaternion: np.ndarray) -> np.ndarray:
    """Rotation matrix of a unit quaternion x y z w: from base_link to odom."""
    x, y, z, w = map(float, quaternion)
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        )
    )


def number_of(scene: Scene, key: str) -> float:
    """A number of the scene by its dotted key. FmuError where it is none."""
    value = _value_of(scene, key)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise FmuError(
            f"--parameter {key}: is no number of the scene {scene.name}; nothing was written. Give the dotted key of a "
            f"number, as water.density (cable-sim manual lists them); what is no number goes with --set"
        )
    return float(value)


def _value_of(scene: Scene, key: str) -> Any:
    value: Any = scene.model_dump(mode="json")
    for part in key.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    return value


def _plain(motion: ShipMotion) -> dict[str, Any]:
    return {name: getattr(motion, name) for name in ("time_ns", "position", "velocity", "rate", "attitude")}
