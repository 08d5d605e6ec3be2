"""Simulator: a thin Python skin over the compiled tick."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable
from math import cos, radians, sin

import numpy as np

from ..compiler.jit import ahead
from ..compiler.packaged import packaged
from ..errors import RunError
from ..physics.block_tridiagonal import RHS
from ..physics.flaps import clear_attitudes
from ..physics.heave_compensation import CONSTANT_TENSION, LAWS, SetpointLaw
from ..physics.inputs import Inputs, make_inputs
from ..physics.output import Output
from ..physics.ship import NO_EPOCH
from ..physics.state import ARC, CARRIED, MEMORY, NOW, STEP
from ..physics.tick_output import SHAPE_COLUMNS, TICK_OUTPUT, Flag, strum_table
from .build import build_model, build_state, make_output
from .compensation_setup import declare, take_rest, take_slope
from .inputs import YAW, FlapCommand, InputError, ShipMotion, VehicleMotion, WinchCommand, push
from .layout import layout_of
from .loop import CONTROL_WORDS, HEADS, LAY, SETTLE, STATS_COLUMNS, TICKS, drive, needs
from .mesh.mesh_kinds import FeedMesh
from .rebase import start_problem
from .saved import savefile
from .saved.savefile import SaveError
from .scene import Scene
from .static_equilibrium import out_of_reach, settle, sunk, tension_slope, turn_bodies
from .statics.route import StartError
from .statics.vehicle_shape import declare_vehicle
from .tables.current import declare_water
from .tables.rigid_tables import flaps_of
from .tables.sensor_tables import declare_faults, keep_faults, pin_problem
from .trim import unstable
from .wake_tables import begin_wakes


class SolverError(RunError):
    """The tick could not be solved; the state is that before it. frames: of the ticks before it in the same call."""

    def __init__(self, text: str, frames: np.recarray | None = None) -> None:
        super().__init__(text)
        self.frames = np.zeros(0, TICK_OUTPUT).view(np.recarray) if frames is None else frames


class Simulator:
    """One tow of a Scene; `cable_sim_ros.Simulator` takes names, files and plain data too.

    Use: ``sim.start()``, then ``sim.push(...)`` and ``sim.tick()`` or ``sim.run(n)``.
    """

    def __init__(self, scene: Scene, mesh: FeedMesh | None = None):
        """mesh: in place of the one made for the scene, for a winch that feeds."""
        if not isinstance(scene, Scene):
            raise TypeError(
                f"scene = {scene!r:.60} is a {type(scene).__name__}, expected a Scene; nothing was built. "
                f"cable_sim_ros.Simulator takes the name or file of a scene and plain data"
            )
        self.scene, self.layout, self._mesh = scene, layout_of(scene), mesh
        self.model = build_model(self.layout, mesh)
        self.state = build_state(self.layout, mesh)
        self.inputs = make_inputs()
        self._algorithm = LAWS.index(scene.setpoint.algorithm)
        self._flaps = flaps_of(scene)
        self.nodes = len(self.state.arc)
        self.output = make_output(self.model, self.nodes, 1)
        self._chunk = make_output(self.model, self.nodes, 1)
        self._control = np.zeros(CONTROL_WORDS, np.int64)
        self._stats = np.zeros((1, STATS_COLUMNS), np.int64)
        self._all = np.zeros((0, HEADS), np.int64)
        self.start_report: dict[str, float] = {}
        self._begun = False

    def warm_up(self, progress: Callable[[str], None] | None = None) -> float:
        """Compile every kernel, or load it from package or cache. Returns the seconds it took.

        Warns where the package brings kernels that cannot be used.
        """
        begin = time.perf_counter()
        if progress:
            progress(packaged.ahead())
        twin = Simulator(self.scene, self._mesh)
        twin.start()
        twin.run(1)
        if complaint := packaged.complaint():
            warnings.warn(complaint, RuntimeWarning, 2)
        return time.perf_counter() - begin

    def start(
        self,
        time_ns: int = 0,
        position: tuple[float, float] = (0.0, 0.0),
        heading: float | None = None,
        keep_inputs: bool = False,
    ) -> None:
        """Static equilibrium wrapped on sheave and drum, at the ship's mean pose.

        time_ns: simulation time of the start; position: x y of base_link in odom [m]; heading: mean yaw of the motion
        to come [rad], None: the scene's. What was pushed before the first start counts; a later start forgets it,
        unless keep_inputs. Raises InputError where that is motion of another heading or place and no heading is given,
        StartError with the residual where it does not settle, or settles beside its sheave;
        nothing is simulated then.
        """
        if self._begun and not keep_inputs:
            for ring in self.inputs:
                ring[...] = 0
        self._begun = True
        scene, yaw = self.scene, radians(self.scene.ship.heading_deg) if heading is None else float(heading)
        now = self.set_out(time_ns, position, yaw)
        if heading is None and self.inputs.motion_head[0] and not keep_inputs:
            first = self.inputs.motion[0]
            self._fits_start(float(first[YAW]), (float(first[0]), float(first[1])))
        drum = self.model.settings[0].drum
        if problem := out_of_reach(self):
            raise StartError(f"{scene.name}: {problem}; nothing was started", 0.0)
        shape = self.layout.shape(float(drum.payout_0 - drum.inboard), yaw)
        turn_bodies(self, shape, yaw)
        try:
            self.start_report = settle(self, shape, yaw)
            for error in unstable(self):
                raise error
        except StartError as error:
            raise sunk(self, error) or error from None
        now.health.iterations = now.health.substeps = 0
        take_rest(now, scene)
        if self._algorithm == CONSTANT_TENSION:
            take_slope(now.setpoint.tension, scene, tension_slope(self))
        if problem := pin_problem(self.state, scene):
            raise StartError(f"{scene.name}: {problem}", 0.0)

    def set_out(self, time_ns: int, position: tuple[float, float], yaw: float) -> np.record:
        """What a start knows before its nodes come to rest: ship, water, winch and mesh at the mean pose, see start().

        yaw [rad]. Returns the present memory. Nodes and the flow past the bodies are left at zero.
        """
        scene, state = self.scene, self.state
        now = self._clear()
        now.time.now = now.time.start = now.ship.blend_at = time_ns
        speed = scene.ship.tow_speed
        now.frame.origin[:] = position
        now.frame.velocity[:] = (speed * cos(yaw), speed * sin(yaw))
        declare_water(now, scene.water, yaw, scene.air)
        now.ship.mean_coord[:] = (0.0, 0.0, scene.ship.reference_height, 0.0, 0.0, yaw)
        now.ship.motion.coord[:] = now.ship.mean_coord
        now.ship.epoch = NO_EPOCH
        declare_vehicle(now, scene, yaw, self.inputs)
        declare(now.setpoint, scene, self._algorithm, yaw)
        self._drive(LAY, 0, self.output)
        begin_wakes(state, scene.cable)
        declare_faults(self.state, scene)
        return now

    def _fits_start(self, yaw: float, place: tuple[float, ...]) -> None:
        problem = start_problem(self.state.now, yaw, place, self.scene.ship.start_blend)
        if problem:
            raise InputError(f"{self.scene.name}: {problem}")

    def _clear(self) -> np.record:
        """Nothing has happened yet; returns the present memory."""
        self.state.memory[:] = np.zeros((), MEMORY)
        self.state.nodes[:, :ARC] = 0.0
        clear_attitudes(self.state, self.model.line.rigid)
        self.state.delayed[:] = 0.0
        for array in self.state.sensors:
            array[...] = np.zeros((), array.dtype)
        self.state.tension[:], self.state.reaction[:] = 0.0, 0.0
        return self.state.now

    @property
    def tolerance(self) -> float:
        """Largest residual force of a solved step [N]."""
        return float(self.model.line.settings["tolerance"][0])

    @property
    def frame(self) -> np.record:
        """The tick output of the last tick, or of the start."""
        return self.output.frame.view(np.recarray)[0]

    @property
    def shape(self) -> np.ndarray:
        """Cable shape of the last tick [nodes, 5], columns SHAPE_COLUMNS."""
        return self.output.shape[0, :, : len(SHAPE_COLUMNS)]

    @property
    def strum(self) -> np.ndarray:
        """Strumming at the last tick [nodes, 8], columns STRUM_COLUMNS; no rows where viv is off."""
        return strum_table(self.output.shape[0])

    @property
    def contact(self) -> np.ndarray:
        """Contact points of the last tick [contact points, 9], columns CONTACT_COLUMNS."""
        return self.output.contact[0, : int(self.output.frame[0]["contact_stations"])]

    def push(self, item: ShipMotion | VehicleMotion | WinchCommand | FlapCommand) -> None:
        """Queue one sample of the motion of ship or vehicle, one winch command or angles of flaps. Raises InputError,
        also where the first sample of the ship is of another heading or place than the start: see
        `sim.rebase.start_problem`."""
        if isinstance(item, VehicleMotion):
            if not self.model.settings[0].vehicle.on:
                raise InputError(
                    f"{self.scene.name}: a VehicleMotion was given, and towbody.model = "
                    f"{self.scene.towbody.model.value}: nothing was pushed. Give the scene towbody.model: vehicle"
                )
            vehicle = self.scene.vehicle
            push(self.inputs, item, int(self.frame["time"]), vehicle.max_gap, max_speed=vehicle.max_speed)
            return
        if self._begun and isinstance(item, ShipMotion) and not self.inputs.motion_head[0]:
            self._fits_start(item.angles[2], item.position[:2])
        push(self.inputs, item, int(self.frame["time"]), self.scene.ship.max_gap, self._flaps)

    def tick(self, inputs: Inputs | None = None) -> np.record:
        """Advance one tick with ``inputs`` (default: self.inputs); returns its tick output. Raises SolverError."""
        if self._drive(TICKS, 1, self.output, inputs) < 1:
            raise self._halted()
        return self.frame

    def run(self, count: int, *, heads: np.ndarray | None = None) -> np.recarray:
        """Advance ``count`` ticks in one compiled call; returns their tick outputs. Raises SolverError.

        heads, int64 [count, 4]: motion samples, commands, samples of the vehicle and rows of flaps, counted from the
        first, that each tick sees of those written; default all.
        """
        if heads is not None and heads.shape != (count, HEADS):
            raise ValueError(f"heads has the shape {heads.shape}, expected {(count, HEADS)}; nothing was simulated")
        if len(self._chunk.frame) < count:
            self._chunk = make_output(self.model, self.nodes, count)
        done = self._drive(TICKS, count, self._chunk, heads=heads)
        frames = self._chunk.frame[:done].copy().view(np.recarray)
        if done:
            self.output.frame[0] = self._chunk.frame[done - 1]
            self.output.shape[0] = self._chunk.shape[done - 1]
            self.output.contact[0] = self._chunk.contact[done - 1]
        if done < count:
            raise self._halted(frames)
        return frames

    @property
    def chunk_tables(self) -> tuple[np.ndarray, np.ndarray]:
        """Shape (with what viv adds to it) and contact tables of the last run(), one row a tick; overwritten by the
        next."""
        return self._chunk.shape, self._chunk.contact

    def set_algorithm(self, law: SetpointLaw | str) -> None:
        """Choose the set-point algorithm; takes effect with the next tick. Raises StartError where it cannot hold."""
        algorithm, now = LAWS.index(SetpointLaw(law)), self.state.now
        tension = now.setpoint.tension
        if algorithm == CONSTANT_TENSION and tension.at_start > 0.0 and tension.slope == 0.0:
            take_slope(tension, self.scene, self._slope_at_rest(algorithm))
        self._algorithm = now.setpoint.algorithm = algorithm

    def _slope_at_rest(self, algorithm: int) -> float:
        """dT/dL [N/m] of the tow that this one began as."""
        twin = Simulator(self.scene, self._mesh)
        twin._algorithm = algorithm
        twin.start(heading=float(self.state.now.ship.mean_coord[5]))
        return float(twin.state.now.setpoint.tension.slope)

    @property
    def steps(self) -> dict[float, int]:
        """Steps taken since the start: length [s] -> how many, longest first."""
        taken = self.state.now.control.taken
        return {self.scene.solver.tick / 2**i: int(count) for i, count in enumerate(taken) if count}

    def bring_to_rest(self, steps: int) -> int:
        """Settle from where the nodes are; returns the steps, negative where it did not come to rest. See start()."""
        return self._drive(SETTLE, steps, self.output)

    def snapshot(self) -> dict[str, np.ndarray]:
        """Everything that changes, as copies; restore() takes it back."""
        saved = {n: getattr(self.state, n)[NOW].copy() for n in CARRIED}
        saved.update({f"step_{n}": getattr(self.state, n)[STEP].copy() for n in CARRIED})
        saved["delayed"], saved["plan"] = self.state.delayed.copy(), self.state.plan.copy()
        kept = self.state.plan.kept[0] != 0.0
        saved.update({f"tangent_{n}": a.copy() if kept else np.zeros_like(a) for n, a in self._tangent().items()})
        saved.update({f"sensors_{n}": a.copy() for n, a in self.state.sensors._asdict().items()})
        saved.update({f"frame_{n}": a[0].copy() for n, a in self.output._asdict().items()})
        saved.update({f"inputs_{n}": a.copy() for n, a in self.inputs._asdict().items()})
        return saved

    def _tangent(self) -> dict[str, np.ndarray]:
        """The tangent that is kept for later steps: what `solve_by_kept` needs of it."""
        work = self.state.work
        return {"next": work.band[:, :, 6:RHS], "lower": work.lower, "factor": work.factor, "facing": work.facing}

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Take back a snapshot() of a simulator of the same scene."""
        for name in CARRIED:
            getattr(self.state, name)[NOW] = saved[name]
            getattr(self.state, name)[STEP] = saved[f"step_{name}"]
        self.state.delayed[...], self.state.plan[...] = saved["delayed"], saved["plan"]
        for name, array in self._tangent().items():
            array[...] = saved[f"tangent_{name}"]
        for name, array in self.state.sensors._asdict().items():
            array[...] = saved[f"sensors_{name}"]
        for name, array in self.output._asdict().items():
            array[0] = saved[f"frame_{name}"]
        for name, array in self.inputs._asdict().items():
            array[...] = saved[f"inputs_{name}"]
        self._algorithm = int(self.state.now.setpoint.algorithm)
        keep_faults(self.state, self.scene)

    def save(self, path: str | os.PathLike) -> None:
        """Write scene and snapshot to one .npz file, whole or not at all. Raises SaveError."""
        savefile.write(path, self.scene, self.snapshot())

    @classmethod
    def load(cls, path: str | os.PathLike) -> Simulator:
        """The Simulator of a file of save(), to go on where it was. Raises SaveError."""
        saved = savefile.read(path)
        sim = cls(saved.scene)
        sim.restore(sim.taken(path, saved))
        return sim

    def load_state(self, path: str | os.PathLike) -> None:
        """Go on where the simulator of a file of save() was. Raises SaveError with what differs for another scene."""
        saved = savefile.read(path)
        savefile.same_scene(path, saved.scene, self.scene)
        self.restore(self.taken(path, saved))

    def taken(self, path: str | os.PathLike, saved: savefile.Saved) -> dict:
        """The snapshot of a file of this scene, of which a twin has solved one tick; nothing is changed.

        Raises SaveError.
        """
        arrays = savefile.fitting(path, saved.arrays, self.snapshot())
        twin = Simulator(self.scene, self._mesh)
        try:
            twin.restore(arrays)
            twin.run(1)
        except Exception as error:  # a kernel too raises what it likes, where the numbers are no tow
            raise savefile.damaged(
                path, f"the tick after its state cannot be solved ({type(error).__name__})"
            ) from None
        return arrays

    def _drive(
        self, what: int, count: int, output: Output, inputs: Inputs | None = None, heads: np.ndarray | None = None
    ) -> int:
        return drive(
            self.model,
            self.state,
            self.inputs if inputs is None else inputs,
            output,
            what,
            int(count),
            self._control,
            self._stats,
            self._all if heads is None else heads,
        )

    @property
    def stiffness(self) -> str:
        """What most often decides whether a step can be solved, in words."""
        solver, chosen = self.scene.solver, ""
        if solver.tension_error is not None:
            chosen = (
                f", in steps to solver.tension_error = {solver.tension_error:g} and solver.position_error = "
                f"{solver.position_error:g} m"
            )
        return (
            f"cable.axial_stiffness = {self.scene.cable.axial_stiffness:g} N and "
            f"solver.tick = {solver.tick:g} s{chosen}"
        )

    def _halted(self, frames: np.recarray | None = None) -> SolverError:
        now, settings = self.state.now, self.model.line.settings[0]
        flags, when = int(now.halted), (now.time.now - now.time.start) * 1e-9
        remedy = "a smaller solver.tick or a finer mesh where the cable bends"
        if self.scene.solver.tension_error is not None:
            remedy = (
                "fixed steps (cable-sim run --step fixed; of a scene of your own: leave solver.tension_error out, with "
                "solver.tick of 0.01 s) or a finer mesh where the cable bends"
            )
        return SolverError(
            f"{self.scene.name}: the tick after {when:.3f} s of simulation could not be solved ({Flag(flags)!r}) with "
            f"{settings.max_halvings} halvings, with {self.stiffness}; the run halted at the state before "
            f"it. Remedy: start again; if it repeats, {remedy}",
            frames,
        )


def _for_any_scene() -> tuple:
    """What a tick of any scene needs, as all have one type signature: by one that takes no static shape."""
    cable = {"diameter": 0.01, "mass_per_length": 0.4, "axial_stiffness": 1e6}
    scene = Scene.model_validate(
        {
            "name": "signature",
            "cable": {**cable, "sections": {"all": {"length": 9.0, "elements": 2}}},
            "winch": {"drum": "contact", "position": (-1.0, 0.0, 3.0), "drum_radius": 0.3},
            "sheave": {"position": (-3.0, 0.0, 3.0), "radius": 0.3},
            "towbody": {"mass": 9.0, "net_weight": 9.0},
        }
    )
    sim = Simulator(scene)
    return needs((sim.model, sim.state, sim.inputs, sim.output, LAY, 0, sim._control, sim._stats, sim._all))


ahead(_for_any_scene)

__all__ = ["TICK_OUTPUT", "InputError", "SaveError", "Simulator", "SolverError", "StartError"]
