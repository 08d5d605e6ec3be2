"""The turns of the executor: what is waited for between two of them. Counted, on a clock that is made up."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
import rclpy
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from cable_sim_ros.ros import executor
from cable_sim_ros.ros.executor import Waiter, drain
from cable_sim_ros.testing.domain import reserve

pytestmark = pytest.mark.check

MS = 1_000_000


@pytest.mark.parametrize(
    "awaits, turns, waits", [(True, 4, 20), (False, 20, 0)], ids=["in a step", "between steps, paused, in real time"]
)
def test_inside_a_step_its_inputs_alone_are_waited_for_between_two_turns(monkeypatch, awaits, turns, waits):
    """20 ms in which an input comes each millisecond: a turn each 5 ms; else one each time, for a service may come."""
    now, counts = [0], {"turn": 0, "wait": 0}

    def passed(what: str) -> None:
        counts[what] += 1
        now[0] += MS * (what == "wait" or not awaits)

    class Turns:
        def add_node(self, node) -> None:
            pass

        def spin_once(self, timeout_sec) -> None:
            passed("turn")

        def shutdown(self, timeout_sec) -> None:
            pass

    def wait(subscriptions, nanoseconds, clients=()) -> bool:
        assert 0 < nanoseconds <= executor.TURN
        passed("wait")
        return False

    monkeypatch.setattr(executor, "SingleThreadedExecutor", Turns)
    monkeypatch.setattr(executor, "Waiter", lambda context: SimpleNamespace(wait=wait))
    monkeypatch.setattr(executor, "time", SimpleNamespace(monotonic_ns=lambda: now[0]))
    monkeypatch.setattr(executor.rclpy, "ok", lambda: now[0] < 20 * MS)
    session = SimpleNamespace(awaits=awaits, steps_left=0, advance=lambda now: 0.02)
    block = SimpleNamespace(realtime=SimpleNamespace(priority=0))
    node = SimpleNamespace(session=session, inputs=[], context=None, settings=SimpleNamespace(node=block))
    executor.spin(node, SimpleNamespace(asked=False))
    assert counts == {"turn": turns, "wait": waits}


def test_a_message_that_waits_already_ends_the_wait_and_an_answer_is_told_from_it():
    hour, heard = 3600 * 1000 * MS, []
    domain = reserve()
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain.number)
    node = rclpy.create_node("waiter", context=context)
    try:
        subscription = node.create_subscription(Clock, "t", lambda data, info: heard.append(data), 10, raw=True)
        publisher = node.create_publisher(Clock, "t", 10)
        waiter = Waiter(context)
        publisher.publish(Clock())
        assert waiter.wait([subscription], hour) is False and drain([subscription]) == 1 and len(heard) == 1
        node.create_service(Trigger, "s", lambda request, response: response)
        client = node.create_client(Trigger, "s")
        executor = rclpy.executors.SingleThreadedExecutor(context=context)
        executor.add_node(node)
        future = client.call_async(Trigger.Request())
        executor.spin_once()  # the service answers
        assert waiter.wait([subscription], hour, [client]) is True and not future.done()
        rclpy.spin_until_future_complete(node, future, executor)
    finally:
        node.destroy_node()
        context.try_shutdown()
        domain.close()
