"""The node: a managed (lifecycle) ROS 2 node around a Session. Topics and parameters: docs/realtime.md.

The executor thread takes inputs, services and parameters; stepping loop and publisher have threads of their own.
"""

from __future__ import annotations

import gc
import os
import sys
import threading
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType, SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.serialization import serialize_message

from ..errors import CableSimError
from ..io.messages.channels import Context, Encoder
from ..io.messages.markers import TOPIC as MARKERS
from ..io.messages.messages import CAUSES, COMMANDED, COMMANDS, JOINT_COMMAND, KINDS, VEHICLES, Event, stamp_of
from ..io.recordings.recording_place import NAMED, name_problem
from ..limits import GARBAGE
from ..sim.checks.friction_checks import slow
from ..sim.flag_rules import FAILED
from ..sim.live_parameters import changed, unfit, value_of, ways
from ..sim.tables.material import body_places
from ..sim.tables.rigid_tables import flaps_of
from ..terminal import clean, say
from . import discovery
from .executor import spin
from .graph_monitor import EVERY as NEIGHBOURS_EVERY
from .graph_monitor import Neighbours
from .lockstep import rate_problem
from .overload import write_json
from .parameters import NONE, ParameterError, Row, checked, foreign, settle
from .parts import started
from .play.clock_player import ClockTopic
from .process import Stop, autostart, refuse_unknown, start_ros
from .publisher import DirectPublisher, TickPublisher, rule_keeper
from .report.diagnostics import Watch, final_metrics, verdict_of_node
from .report.health import MSGTYPE as AGES_TYPE
from .report.health import TOPIC as AGES_TOPIC
from .services import simulation_interfaces
from .services.control import RecordingControl, SimulationControl
from .stepped import SteppedSession, session_of
from .timing import Arrivals, StampArrivals
from .topics import diagnostic_array, inputs_there, message_class, publishers_of, rows_of

NAME, NAMESPACE = "cable_sim", "/tow_sim"
INPUT_DEPTH = {False: 200, True: 5000}  # deep: a static start takes a second; in lockstep a bag may come at once
QOS = {"reliable": QoSProfile(depth=10), "sensor": QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)}
# ticks come faster than a listener takes them: so many are kept for it (PIECE of testing/node_topics.py)
STEPPED_QOS = QOS | {"reliable": QoSProfile(depth=500)}
LARGEST = 64_000  # bytes of an input; an Odometry has 720
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
TYPES = {
    float: ParameterType.PARAMETER_DOUBLE,
    int: ParameterType.PARAMETER_INTEGER,
    bool: ParameterType.PARAMETER_BOOL,
    str: ParameterType.PARAMETER_STRING,
    list: ParameterType.PARAMETER_DOUBLE_ARRAY,
}
HUGE = sys.float_info.max  # a ROS range has no open end
HUGE_INT = 2**63 - 1


def overrides_of(node) -> dict[str, Any]:
    """Values given to this node by parameter files and `-p`; {} where rclpy no longer gives them."""
    given = getattr(node, "_parameter_overrides", None)  # not public, but the only place that knows the unknown names
    return {} if given is None else {name: parameter.value for name, parameter in given.items()}


def descriptor(row: Row) -> ParameterDescriptor:
    """Descriptor with description, unit, source, range and whether a change needs a new configure."""
    text = row.doc + (f" [{row.unit}]" if row.unit not in ("", "1") else "")
    if row.nullable:
        text += f"; {'empty text' if row.kind is str else NONE[row.kind]}: none"
    if row.source:
        text += f" (source: {row.source})"
    result = ParameterDescriptor(
        name=row.name,
        type=TYPES[row.kind],
        description=text,
        read_only=row.configure,
        additional_constraints=row.range_text,
    )
    low = row.above if row.above is not None else row.low
    if row.nullable or (low is None and row.high is None):
        return result  # rclpy holds nan to be out of every range
    if row.kind is float:
        result.floating_point_range = [
            FloatingPointRange(
                from_value=float(-HUGE if low is None else low), to_value=float(HUGE if row.high is None else row.high)
            )
        ]
    elif row.kind is int:
        result.integer_range = [
            IntegerRange(
                from_value=int(-HUGE_INT if low is None else low),
                to_value=int(HUGE_INT if row.high is None else row.high),
                step=1,
            )
        ]
    return result


def declare(node, rows: list[Row]) -> None:
    """Declare every row; ParameterError where rclpy refuses a value."""
    for row in rows:
        try:
            node.declare_parameter(row.name, row.value, descriptor(row))
        except (InvalidParameterTypeException, InvalidParameterValueException) as error:
            raise ParameterError(f"parameter '{row.name}': {error}; {row.range_text}") from None


class CableSimNode(LifecycleNode):
    """Raises ParameterError, or the CableSimError of a part, at construction; nothing has been started then."""

    def __init__(self, **kwargs) -> None:
        super().__init__(NAME, namespace=NAMESPACE, **kwargs)
        self.publisher: TickPublisher | None = None
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        try:
            self.settings = settle(overrides_of(self))
            declare(self, self.settings.rows)
            self.parts = started(self)
        except BaseException:
            self.destroy_node()
            raise
        for warning in self.settings.warnings:
            self.get_logger().warning(clean(warning))
        if self.get_parameter("use_sim_time").value:
            self.get_logger().warning("use_sim_time is ignored: the clock is that of the stamps of imu/data and odom")
        self.add_on_set_parameters_callback(self._may_set)
        self.add_post_set_parameters_callback(self._was_set)
        self.session = session_of(self.settings, self.log)
        self.watch = Watch(self.session)
        self._showing = False  # of what the session has set already
        self.arrivals = StampArrivals(lambda: self.session.now()) if self.session.lockstep else Arrivals()
        self.recording = RecordingControl(self.settings, self.get_namespace())
        self.inputs: list = []
        made, self._unheard = inputs_there()
        deaf = {*(() if self.session.driven else VEHICLES), *(() if flaps_of(self.settings.scene) else ("flaps",))}
        self.heard = {kind: message for kind, message in made.items() if kind not in deaf}
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.control = SimulationControl(self)
        self.standard = simulation_interfaces.offer(self.control)
        self.create_timer(0.05, self._on_poll, clock=self._steady)
        self.create_timer(1.0, self._on_diagnostics, clock=self._steady)
        self.create_timer(NEIGHBOURS_EVERY, self._on_neighbours, clock=self._steady)
        self._neighbours = Neighbours(self)
        self.clock_topic = ClockTopic(self)
        self._ages = self.create_publisher(message_class(AGES_TYPE), AGES_TOPIC, QOS["reliable"])
        self._reported_levels: tuple = ()
        self._reported_state, self._warned_scheduler, self.ended_badly = "", False, False  # the last by close()
        self.report_state()

    # ---- life cycle

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Build the model, compile, check the static start, open the topics."""
        try:
            self.session.configure()
            self.clock_topic.open(self.session)
            self.inputs = [self._subscribe(kind, made) for kind, made in self.heard.items()]
        except Exception as error:
            self.session.fail(f"not configured: {error} ({type(error).__name__}); nothing is simulated")
            self.report_state()
            return TransitionCallbackReturn.FAILURE
        node, frames = self.settings.node, self.settings.node.frame
        links, scene = (frames.odom, frames.base_link, frames.sheave_link, frames.towbody_link), self.settings.scene
        flaps = tuple(flaps_of(scene).items())
        context = Context(*links, self.get_namespace(), body_places(scene), flaps, frames.vehicle_link)
        channels = rows_of(scene, node.publish)
        publishers, missing = publishers_of(self, context, channels, STEPPED_QOS if self.session.lockstep else QOS)
        for text in missing:
            self.get_logger().info(clean(text))
        session = self.session
        self.publisher = (DirectPublisher if session.lockstep else TickPublisher)(
            session.built_loop,
            Encoder(context, self.settings.scene.solver.tick, channels),
            publishers,
            session.offset,
            session.record_time,
            () if node.recording.markers else (f"{self.get_namespace().rstrip('/')}/{MARKERS}",),
            slow(self.settings.scene),
            [part.tick for part in self.parts if part.tick is not None],
            rule_keeper(self.settings.scene),
        )
        if isinstance(session, SteppedSession):
            session.publish_ticks = self.publisher.drain
        self.publisher.start()
        self.get_logger().info(clean(self._unheard or f"winch commands are heard as {JOINT_COMMAND} too"))
        self.report_state()
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Wait for motion; the loop starts with the first that can be used."""
        if self.settings.node.recording.enabled:
            text = self.recording.begin(self.session, self.publisher)
            if text:
                self.get_logger().error(clean(text))
                return TransitionCallbackReturn.FAILURE
        self.session.activate()
        there = " and ".join(self.resolve_topic_name(KINDS[kind][1]) for kind in ("imu", "odometry"))
        self.get_logger().info(clean(f"waiting for motion on {there}"))
        self.report_state()
        return super().on_activate(state)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the loop and finish a recording."""
        self.session.deactivate()
        self.recording.finish(self.session, self.publisher)
        self.report_state()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Give up the model and close the topics."""
        self._stop_threads()
        for subscription in self.inputs:
            self.destroy_subscription(subscription)
        for publisher in self.publisher.publishers.values() if self.publisher else ():
            self.destroy_publisher(publisher)
        self.clock_topic.close()
        self.session = session_of(self.settings, self.log)
        self.watch, self.publisher, self.inputs = Watch(self.session), None, []
        self.report_state()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """As `close`."""
        self.close()
        return TransitionCallbackReturn.SUCCESS

    def close(self) -> None:
        """Stop loop and publisher, finish the recording, report the final figures. A second call does nothing."""
        if self.session.state == "closed":
            return
        state = self.session.state
        self._stop_threads()
        self.recording.finish(self.session, self.publisher)
        metrics = final_metrics(self.session, self.publisher, self.recording.stats())
        metrics |= {"state": "stopped", "last": state}
        for rank, value in zip((50, 99, 100), self.arrivals.taken.percentiles(50, 99, 100)):
            metrics[f"sample_age_p{rank}_ms"] = value
        metrics["wall_clock_steps"] = self.arrivals.steps
        for name, value in (item for part in self.parts for item in part.metrics().items()):
            metrics.setdefault(name, value)  # a part says nothing of the node's own
        verdict = verdict_of_node(self.session, self.publisher, metrics)
        self.ended_badly = verdict.state == FAILED
        metrics["verdict"] = verdict.as_dict()
        if metrics.get("published_ticks"):
            say(
                f"{metrics['ticks']} ticks, {metrics['missed_ticks']} missed, {metrics['resyncs']} resyncs, jitter p99 "
                f"{metrics['jitter_p99_ms']:.2f} ms, stamp to tension p50 {metrics['latency_p50_ms']:.1f} ms, p99 "
                f"{metrics['latency_p99_ms']:.1f} ms, {metrics['scheduler']}",
                True,
            )
        if verdict.reasons or metrics.get("published_ticks"):
            for line in verdict.lines():
                say(line, err=True)
        self._write_statistics(metrics)
        for part in self.parts:
            part.close()

    def _stop_threads(self) -> None:
        self.session.close()
        if self.publisher is not None:
            self.publisher.close()
        if self.session.loop is not None and not (self.publisher and self.publisher.is_alive()):
            self.session.loop.close()

    # ---- inputs

    def _subscribe(self, kind: str, made: type):
        depth, own = INPUT_DEPTH[self.session.lockstep], QoSOverridingOptions.with_default_policies()
        qos = QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)
        topic, heard = KINDS[kind][1], self._input(kind)
        return self.create_subscription(made, topic, heard, qos, raw=True, qos_overriding_options=own)

    def _input(self, kind: str):
        msgtype, name = KINDS[kind]
        topic = self.resolve_topic_name(name)

        def callback(data: bytes, info: dict) -> None:
            if len(data) > LARGEST:
                self._refuse_giant(kind)
                return
            clock = self.session.clock
            stamp = None if kind in COMMANDED else stamp_of(data)
            arrival = self.arrivals.of(info, stamp, clock.offset)
            self.record(topic, msgtype, data, arrival)
            if kind in COMMANDED:
                self._command(data, arrival, kind)
            elif kind in VEHICLES:
                self.session.vehicle(Event(stamp, arrival, kind, data))
            else:
                self.session.motion(Event(stamp, arrival, kind, data))
                self.arrivals.took(clock.last_stamp, clock.offset)

        return callback

    def _refuse_giant(self, kind: str) -> None:
        (self.session.intake.commands.refused if kind in COMMANDED else self.session.refused)["size"] += 1
        text = f"{kind} of more than {LARGEST // 1000} kB refused: {CAUSES['size']}"
        self.get_logger().warning(clean(text), throttle_duration_sec=5.0)

    def _command(self, data: bytes, arrival: int, kind: str) -> None:
        cause = self.session.command(data, arrival, kind)
        if cause:
            self.get_logger().warning(clean(f"{KINDS[kind][1]} refused: {CAUSES[cause]}"), throttle_duration_sec=5.0)

    def record(self, topic: str, msgtype: str, data: bytes, arrival: int | None = None) -> None:
        """A message of this node into the recording under way, if there is one."""
        recorder = self.recording.recorder
        if recorder is not None:
            recorder.put(topic, msgtype, self.session.record_time(arrival), data)

    # ---- parameters

    def _show_faults(self) -> None:
        """What the timetable of faults has set, as parameters."""
        while self.session.unshown:
            key = self.session.unshown.popleft()
            value = value_of(self.session.scene, key)
            self._showing = True
            try:
                self.set_parameters([Parameter(key, value=getattr(value, "value", value))])
            finally:
                self._showing = False

    def _may_set(self, parameters) -> SetParametersResult:
        if self._showing:
            return SetParametersResult(successful=True)
        rows, live, scene = (
            {row.name: row for row in self.settings.rows},
            ways(self.settings.scene),
            self.settings.scene,
        )
        for parameter in parameters:  # of live ones: rclpy refuses the others, which it was told are read-only
            if parameter.name in NAMED and (text := name_problem(parameter.name, parameter.value)):
                return SetParametersResult(successful=False, reason=text)
            if parameter.name == "lockstep.rate" and (text := rate_problem(parameter.value)):
                return SetParametersResult(successful=False, reason=text)
            if parameter.name in rows:
                try:
                    checked(rows[parameter.name], parameter.value)
                except ParameterError as error:
                    reason = str(error).replace("nothing was started", "nothing was changed")
                    return SetParametersResult(successful=False, reason=reason)
            if parameter.name in live:
                scene = changed(scene, parameter.name, parameter.value)
        text = unfit(scene)
        return SetParametersResult(successful=not text, reason=text)

    def _was_set(self, parameters) -> None:
        live = ways(self.settings.scene)
        for parameter in parameters:
            if parameter.name == "recording.path":
                self.recording.wanted = parameter.value
            elif parameter.name in live:
                scene = changed(self.settings.scene, parameter.name, parameter.value)
                self.settings = self.recording.settings = self.settings._replace(scene=scene)
                when = "by faults_file"
                if not self._showing:
                    self.session.set_live(parameter.name, parameter.value)
                    when = "from the next tick on"
                self.get_logger().info(clean(f"{parameter.name} = {parameter.value}, {when}"))
            elif not foreign(parameter.name):
                block = changed(self.settings.node, parameter.name, parameter.value)
                self.settings = self.recording.settings = self.settings._replace(node=block)
                self.session.set_node(block)

    # ---- what the node says

    def _on_poll(self) -> None:
        self.arrivals.awake()
        self.session.poll()
        loop = self.session.loop
        if loop is not None and loop.warning and not self._warned_scheduler:
            self._warned_scheduler = True
            self.get_logger().warning(clean(loop.warning))
        if self.session.shown_state != self._reported_state:
            self.report_state()
        self._show_faults()
        heard = zip(self.heard, self.inputs)
        self.watch.commanders = sum(made.get_publisher_count() for kind, made in heard if kind in COMMANDED)
        levels = self.watch.levels(self.publisher, self.session.now())
        self._ages.publish(self.watch.inputs.message())
        if levels != self._reported_levels:
            self._reported_levels = levels
            self._on_diagnostics()

    def _on_neighbours(self) -> None:
        outputs = [*(self.publisher.publishers if self.publisher else ()), self.resolve_topic_name(AGES_TOPIC)]
        inputs = {kind: self.resolve_topic_name(KINDS[kind][1]) for kind in self.heard}
        winch = [topic for kind, topic in inputs.items() if kind in COMMANDS]
        for problem in self._neighbours.step(outputs, list(inputs.values()), winch):
            self.get_logger().warning(clean(problem))
        self.watch.neighbours, self.watch.nodes = self._neighbours.problems, len(self.get_node_names())
        self.session.hold(self.clock_topic.taken())

    def _on_diagnostics(self) -> None:
        statuses = self.watch.statuses(self.publisher, self.recording.stats(), self.recording.recorder is not None)
        statuses += [status for part in self.parts for status in part.statuses()]
        data = serialize_message(diagnostic_array(self.get_name(), statuses, self.session.log_time()))
        self._diagnostics.publish(data)
        self.record("/diagnostics", DIAGNOSTICS, data)

    def report_state(self) -> None:
        """Write the state to statistics_file, for whoever started this process."""
        self._reported_state = self.session.shown_state
        self._write_statistics({"state": self.session.shown_state, "problem": self.session.problem, "pid": os.getpid()})

    def _write_statistics(self, tree: dict) -> None:
        if self.settings.node.statistics_file:
            try:
                write_json(self.settings.node.statistics_file, tree)
            except OSError as error:
                text = f"statistics_file cannot be written: {error}"
                self.get_logger().error(clean(text), throttle_duration_sec=10.0)

    def log(self, level: str, text: str) -> None:
        """A line in the log; level: error, warn or info."""
        # one call site each: rclpy ties a site to its level
        logger = self.get_logger()
        if level == "error":
            logger.error(clean(text))
        elif level == "warn":
            logger.warning(clean(text))
        else:
            logger.info(clean(text))


def main(args: list[str] | None = None) -> int:
    """Entry point: 0 after SIGINT or SIGTERM, also where the verdict is doubtful: a service that is stopped did what
    it was asked to; 1 when the start failed or the run had halted, 2 for parameters that cannot be used."""
    node, code, stop = None, 0, Stop()
    args, reach = discovery.limit(sys.argv if args is None else args)
    say(reach, err=True)
    try:
        start_ros(args)
        refuse_unknown(args)
        node = CableSimNode()
        node.control.on_quit = stop.ask
        if node.settings.node.autostart and not autostart(node, stop):
            code = 1
        elif not stop.asked:
            spin(node, stop)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except CableSimError as error:
        say(f"error: {error}", err=True, lines=error.lines)
        code = 2
    finally:
        if node is not None:
            node.close()
            code = code or int(node.ended_badly)
        if any(thread.name == "configure" for thread in threading.enumerate()):
            sys.stderr.flush()
            os._exit(code)  # the compiler cannot be interrupted, and has nothing to lose
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
        stop.restore()
    return code


if __name__ == "__main__":
    gc.set_threshold(*GARBAGE)
    sys.exit(main())
