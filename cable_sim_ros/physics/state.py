"""The types that kernels work on: what the scene fixes (models) and what changes (state), by name.

Everything that a halved step, a rolled back tick, save and fork must restore lies in two arrays: a record MEMORY and
one block of what stands on nodes. Each has three slots, so that keeping is two copies and nothing can be forgotten.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.jit import driver, inline
from .attitude import ATTITUDE, copy_attitudes
from .contact import CONTACT_POINT, CONTACT_POINTS_PER_ELEMENT, DETECTED, EVENTS
from .contact_surface import SURFACE, check_surfaces
from .heave_compensation import SETPOINT
from .hermite import LINK
from .rigid_model import Rigid
from .sea import SEA, Sea
from .sensor_models import SensorModel, Sensors, make_sensors
from .ship import SHIP, SHIP_TIMES, TIME, TOW_FRAME
from .swivel import SWIVEL, SWUNG
from .vehicle import VEHICLE
from .winch import DRUM, WINCH
from .winch_drive import DRIVE, DRIVING
from .workspace import POWERS, Work, make_work

# numpy integers: a literal argument compiles a version of its own
NOW, STEP, TICK = np.arange(3)  # slots: the present, the beginning of the step, that of the tick
SLOTS = 3

# rows of State.nodes, six numbers a node: position and gradient, their rates, accelerations, auxiliary
# accelerations, first to fourth backward difference of the accelerations (GAIN: what they gained in the step before),
# the running mean of the material's rates, of a body how the water flows past it (see towbody.py), how the element that
# begins at the node strums (columns: viv_amplification.py), the wake it sheds (see wake_oscillator.py), and arc length
# with its first and second rate (columns 0 to 2) and the kind of the element that begins there (column hermite.LINK)
NODE_ROWS = 13
Q, V, A, X, GAIN, GAIN_2, GAIN_3, GAIN_4, MEAN, FLOW, STRUM, WAKE, ARC = np.arange(NODE_ROWS)

HEALTH = np.dtype(
    [
        ("iterations", "i8"),  # Newton corrections of the tick
        ("substeps", "i8"),
        ("tangents", "i8"),  # that the last step needed
        ("residual", "f8"),  # N
        ("strain", "f8"),  # J
        ("last_step", "f8"),  # s
        # least and largest of the steps of the tick: tension at the sheave and along the cable, N
        ("tension_min", "f8"),
        ("tension_max", "f8"),
        ("cable_min", "f8"),
        ("cable_max", "f8"),
        ("contact_max", "f8"),  # N, resultant on the sheave
        ("depth_max", "f8"),  # m, of drum and sheave
        ("pull_max", "f8"),  # N, at the drum
        ("power_min", "f8"),  # W, of the winch on the cable
        ("power_max", "f8"),
    ],
    align=True,
)
ACCOUNT = np.dtype(
    [
        ("work", "f8", POWERS),  # J since the start
        ("power", "f8", POWERS),  # W
        ("stored", "f8"),  # J at the start
        ("supplied", "f8"),  # J, work_supplied and energy_residual of the last tick output
        ("residual", "f8"),
        ("turned", "f8"),  # J since the start: work supplied, in and out both positive
        ("gained", "f8"),  # J of the residual while the cable was slack
        ("ringing", "f8"),  # J that the integration took from ringing and that would still be there, see ringing.py
        ("compliance", "f8"),  # m/N, of the cable along itself
        ("material", "f8"),  # s, axial damping over EA
    ],
    align=True,
)
LEVELS = 32
CONTROL = np.dtype(  # the choice of the step, counts since the start
    [
        ("level", "i8"),  # halvings of a tick that the next step begins with
        ("wait", "i8"),  # steps to take before a longer one is tried
        ("taken", "i8", LEVELS),  # steps by their halvings of a tick
        ("refused", "i8"),  # steps refused for their error
        ("unsolved", "i8"),  # steps refused by Newton or the rules of a step
        ("position", "f8"),  # m, N: estimated errors of the last step
        ("tension", "f8"),
        ("age", "f8"),  # s that what follows has been watched; of the tension averaged along the cable:
        ("tension_last", "f8"),  # N, after the last step
        ("tension_mean", "f8"),  # N, running mean
        ("variance", "f8"),  # N^2 about it, over DEVIATION_TIME and over RATE_TIME, see step_error.py
        ("variance_now", "f8"),
        ("rate_square", "f8"),  # N^2/s^2, mean square of its rate over RATE_TIME
    ],
    align=True,
)
SHEAVE = np.dtype([("position", "f8", 3), ("velocity", "f8", 3)])  # of its centre, tow frame
# what instruments showed at the last tick; rad, rad with a sign (see setpoint.lead_of) and its rate, when [ns], N
MEASURED = np.dtype(
    [
        ("departure_angle", "f8"),
        ("departure", "f8"),
        ("departure_rate", "f8"),
        ("departure_stamp", "i8"),
        ("tension", "f8"),
    ],
    align=True,
)
KNOWN = np.dtype(  # of the mean flow, see mean_flow.py
    [
        ("east", "f8", 4),  # two stages of the mean speed of the sheave, x and y, tow frame [m/s, m/s^2]
        ("north", "f8", 4),
        ("wound", "f8", 4),  # of the commanded rate, and of the sheave's waves, upward and along the cable
        ("heave", "f8", 4),
        ("surge", "f8", 4),
        ("waves", "f8"),  # m/s, envelope of the last two
        ("taken", "f8", 2),  # m/s: speed and rate as far as the running mean has them
        ("winch", "f8"),  # m/s: what it has not of the rate, and for how long that has its sign [s]
        ("kept", "f8"),
        ("faster", "f8"),  # 1/s, by which the mean is faster than cable.mean_flow_time has it
        ("begun", "i8"),  # 1: speed is known
    ],
    align=True,
)
MEMORY = np.dtype(
    [
        ("time", TIME),
        ("halted", "i8"),  # flags of a halted run
        ("frame", TOW_FRAME),
        ("current", "f8", 4),  # surface current relative to the tow frame [m/s], its gradient [1/s]
        ("wind", "f8", 2),  # relative to the tow frame, m/s
        ("sea", SEA),
        ("ship", SHIP),
        ("vehicle", SHIP),  # at the far end of the cable, see vehicle.py
        ("vehicle_off", "f8"),  # m, from its attachment to the end of the cable
        ("sheave", SHEAVE),
        ("seen", SHEAVE),  # as the instruments have it
        ("swung", SWUNG),  # the block of the sheave, where it swivels
        ("winch", WINCH),
        ("drive", DRIVING),
        ("setpoint", SETPOINT),
        ("measured", MEASURED),
        ("known", KNOWN),
        ("events", EVENTS),
        ("account", ACCOUNT),
        ("health", HEALTH),
        ("control", CONTROL),
    ],
    align=True,
)

LINE_SETTINGS = np.dtype(
    [
        ("gravity", "f8"),  # m/s^2
        ("tolerance", "f8"),  # N
        ("mass_damping", "f8"),  # 1/s
        ("rho_inf", "f8"),
        ("mean_flow_time", "f8"),  # s
        ("amplified", "i8"),  # 1: a section has a drag factor other than 1, by hand or computed
        ("max_turn", "f8"),  # change of a gradient in one step
        ("leave_step", "f8"),  # s, a longer step must not leave a groove
        ("step_position", "f8"),  # m, N: errors that a step may bring; 0: a tick is one step
        ("step_tension", "f8"),
        ("step_deviation", "f8"),  # rms change of the tension in one step over its deviation
        ("max_iterations", "i8"),
        ("max_halvings", "i8"),
        ("air", "f8", 2),  # of cable and bodies: what their drag in water is multiplied by, see wind.py; 0: no wind
        ("jumps", "i8"),  # 1: tension or stretch may jump at a node inside, see observe.fill_shape
    ],
    align=True,
)
TOW_SETTINGS = np.dtype(
    [
        ("sheave", "i8"),  # its row among the surfaces
        ("tick_ns", "i8"),
        ("reseat_ns", "i8"),
        ("penetration_limit", "f8"),  # m
        ("groove_depth", "f8"),  # m
        ("energy_share", "f8"),  # see energy.slack_gain
        ("instrumented", "i8"),  # 1: the set-point laws get what instruments show
        ("max_ringing", "f8"),  # N of ringing lost to the integration, above which the tick is flagged
        ("bending_length", "f8"),  # m, sqrt(EI/T) at working tension
        ("ship", SHIP_TIMES),
        ("drum", DRUM),
        ("drive", DRIVE),
        ("swivel", SWIVEL),
        ("vehicle", VEHICLE),
    ],
    align=True,
)
LOAD = np.dtype([("node", "i8"), ("force", "f8", 3), ("moment", "f8", 3)])  # N, N m on the tangent
# a rigid or elastic load between a node and the next: its mass matrix is [[aa, ab], [ab, bb]]
STRUT = np.dtype([("node", "i8"), *((name, "f8") for name in ("length", "stiffness", "aa", "ab", "bb"))])  # m, N, kg


class Change(NamedTuple):
    """What velocity [1/s], acceleration [1/s^2] and running mean of the velocity [1] of a node change by with its
    position in one step, and the mass damping of a static start [1/s]."""

    velocity: float
    acceleration: float
    damping: float
    fraction: float


AT_REST = Change(0.0, 0.0, 0.0, 0.0)
PLAN = np.dtype(
    [
        ("done", "f8"),
        ("fraction", "f8"),
        ("level", "i8"),
        ("halved", "i8"),
        ("used", "i8"),
        ("factored", "i8"),
        ("taken", "i8"),  # 1: the piece that was begun last has been taken
        # of the tangent that the work space keeps, see kept_tangent.py: its change of acceleration, 1/s^2 (0: there is
        # none), steps until it is tried again, and how often in turn it was of no use
        ("kept", "f8"),
        ("wait", "i8"),
        ("missed", "i8"),
    ]
)


STRUM_RULES = np.dtype(
    [
        ("law", "i8"),  # place in strum.LAWS
        ("formula", "i8"),  # 1: Blevins
        ("antinode", "i8"),  # 1: rms displacement is that of an antinode
        ("every", "i8"),  # ticks from one target to the next
        ("multiplier", "f8"),
        ("band", "f8"),  # of lock-in, share of the frequency; 0: none
        ("rate", "f8"),  # 1/s, most change of the amplification
    ],
    align=True,
)
STRUM_SECTION = np.dtype(
    [
        ("end", "f8"),  # m, arc length
        ("strums", "i8"),  # 0: faired, or without drag
        ("multiplier", "f8"),
        ("mass_damping", "f8"),  # (m* + C_m) zeta
        ("reynolds", "f8"),  # of 1 m/s
        ("diameter", "f8"),  # m
        ("mass", "f8"),  # kg/m, dry
        ("added", "f8"),  # kg/m, in the water
    ],
    align=True,
)


class Strum(NamedTuple):
    """What strumming needs, see viv_amplification.py; no rows: it is not computed."""

    rules: np.ndarray  # STRUM_RULES [0 or 1]
    sections: np.ndarray  # STRUM_SECTION [0 or sections]


class LineModel(NamedTuple):
    """One cable with what holds it, hangs on it and pulls it; read-only but for loads and the element table, which
    follows from the arc lengths."""

    elements: np.ndarray  # [groups, ROWS, LANES] element table
    held: np.ndarray  # [nodes, 6] 1 where q, v and a are imposed from outside
    bodies: np.ndarray  # BODY [bodies]
    body_nodes: np.ndarray  # int64 [bodies] the node that carries each
    rigid: Rigid  # those with an attitude of their own
    beads: np.ndarray  # BEAD [beads]
    loads: np.ndarray  # LOAD [loads]
    struts: np.ndarray  # STRUT [struts]
    settings: np.ndarray  # LINE_SETTINGS [1]
    strum: Strum
    sea: Sea
    wakes: np.ndarray  # WAKE_SECTION [sections], see wake_oscillator.py; none: no section has a wake


FEED_NODE = np.dtype([("zone", "i8"), ("place", "f8")])  # zone or -1, aboard; m from the tangent point, or share of it
ZONE = np.dtype(
    [
        ("end", "f8"),  # m, arc length at which its section ends
        ("minimum", "f8"),  # m, from the last node aboard: nearer its end does not come
    ],
    align=True,
)


class Feed(NamedTuple):
    """What a winch that feeds cable needs, see mesh_motion.py; no zones: the mesh is fixed to the material."""

    nodes: np.ndarray  # FEED_NODE [nodes]
    zones: np.ndarray  # ZONE [zones], one a section
    materials: np.ndarray  # [sections, ROWS] rows of the element table
    content: np.ndarray  # int64 [elements] section that the element's rows are of now, -1: several, or not known


CARRIED = "memory", "nodes", "attitude"  # tables of State with slots, of which a snapshot has NOW and STEP


class State(NamedTuple):
    """Everything that changes, preallocated. Only memory, nodes, attitude, delayed and sensors carry over."""

    memory: np.ndarray  # MEMORY [SLOTS]
    nodes: np.ndarray  # [SLOTS, NODE_ROWS, nodes, 6]
    attitude: np.ndarray  # ATTITUDE [SLOTS, rigid bodies]
    surfaces: np.ndarray  # SURFACE [n], where they are now: made from the ship's motion
    detected: np.ndarray  # DETECTED [n], of the last step
    contact_points: np.ndarray  # CONTACT_POINT [most], those that were detected
    delayed: np.ndarray  # [rows, 2] set-points at the ends of the last ticks, see tow.late; no rows: no dead time
    sensors: Sensors  # what instruments remember
    plan: np.ndarray  # PLAN [1], how far the step asked for has come
    tension: np.ndarray  # [elements] N
    reaction: np.ndarray  # [nodes, 6] what holds the held unknowns [N, N m]
    work: Work

    @property
    def now(self) -> np.record:
        """The present MEMORY, fields as attributes."""
        return self.memory[NOW]

    @property
    def q(self) -> np.ndarray:
        """Positions [m] and gradients of the nodes [nodes, 6]."""
        return self.nodes[NOW, Q]

    @property
    def v(self) -> np.ndarray:
        """Rates of q [nodes, 6]."""
        return self.nodes[NOW, V]

    @property
    def a(self) -> np.ndarray:
        """Accelerations of q [nodes, 6]."""
        return self.nodes[NOW, A]

    @property
    def arc(self) -> np.ndarray:
        """Unstretched arc length of every node [nodes], m."""
        return self.nodes[NOW, ARC, :, 0]


class Model(NamedTuple):
    """The tow as numbers for kernels, read-only."""

    line: LineModel
    settings: np.ndarray  # TOW_SETTINGS [1]
    feed: Feed
    sensors: SensorModel


def records(count: int, kind: np.dtype) -> np.recarray:
    """Records of a kind, all zero, whose fields are attributes in plain Python as in compiled code."""
    return np.zeros(count, kind).view(np.recarray)


def make_state(
    arc: np.ndarray,
    surfaces: np.ndarray,
    sea: Sea | None = None,
    links=False,
    delayed: int = 0,
    sensed: int = 0,
    rigid: int = 0,
) -> State:
    """State of a line of elements, or of links, with these arc lengths [nodes] and SURFACE records; else zero.

    sea: None where there is no more than a linear current; delayed: its rows; sensed: ticks that instruments remember,
    0: none is aboard; rigid: bodies with an attitude of their own. Raises ValueError, see check_surfaces."""
    nodes, z = len(arc), np.zeros
    state = State(
        memory=records(SLOTS, MEMORY),
        nodes=z((SLOTS, NODE_ROWS, nodes, 6)),
        attitude=z((SLOTS, rigid), ATTITUDE).view(np.recarray),
        surfaces=check_surfaces(np.array(surfaces, SURFACE).reshape(-1)).view(np.recarray),
        detected=records(len(surfaces), DETECTED),
        contact_points=records(len(surfaces) * CONTACT_POINTS_PER_ELEMENT * (nodes - 1), CONTACT_POINT),
        delayed=z((delayed, 2)),
        sensors=make_sensors(sensed),
        plan=records(1, PLAN),
        tension=z(nodes - 1),
        reaction=z((nodes, 6)),
        work=make_work(nodes) if sea is None else make_work(nodes, len(sea.waves), not sea.rests),
    )
    state.nodes[:, ARC, :, 0] = arc
    state.attitude.quaternion[..., 3] = 1.0
    state.nodes[:, ARC, :, LINK] = links
    return state


@driver
def copy_slot(state, source, target):
    """Everything that carries over, from one slot to another."""
    nodes = state.nodes.reshape(SLOTS, state.nodes.size // SLOTS)
    for i in range(nodes.shape[1]):
        nodes[target, i] = nodes[source, i]
    state.memory[target] = state.memory[source]
    if state.attitude.shape[1] > 0:
        copy_attitudes(state.attitude, source, target)


@inline
def forget_tangent(state):
    """What comes begins anew: no tangent of a step before, and nothing known of how such ones serve."""
    plan = state.plan[0]
    plan.kept, plan.wait, plan.missed = 0.0, 0, 0


@inline
def checkpoint(state, slot):
    """Remember the present in a slot."""
    copy_slot(state, NOW, slot)


@inline
def restore(state, slot):
    """Return to what a slot remembers."""
    copy_slot(state, slot, NOW)
