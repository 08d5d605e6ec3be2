"""Domains of tests: nobody else's, whoever else looks for one and however."""

import os
import socket
import subprocess
import sys

import pytest

from cable_sim_ros.errors import TowError
from cable_sim_ros.testing import domain


@pytest.fixture
def few(monkeypatch):
    """Two domains in all, and ports that belong to no other test's domain, so that this one is alone with them,
    nor of another run: below those that the system hands out."""
    monkeypatch.setattr(domain, "DOMAINS", range(99, 101))
    monkeypatch.setattr(domain, "PORT", 26_000 + os.getpid() % 3000 * 2 - 99)
    monkeypatch.setattr(domain, "RTPS", 10_000 + os.getpid() % 30 * 500 - 99 * domain.PORTS)


def taken(number):
    """Is the port of ros-domain-coordinator for this domain taken? As its `domain_id` tries it."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as other:
        try:
            other.bind(("", domain.PORT + number))
        except OSError:
            return True
    return False


def test_two_at_once_differ_and_a_third_is_refused(few):
    one, two = domain.reserve(), domain.reserve()
    try:
        assert {one.number, two.number} == {99, 100}
        assert taken(one.number) and taken(two.number)
        with pytest.raises(TowError, match="all ROS domains from 99 to 100 are in use on this machine: nothing was"):
            domain.reserve()
    finally:
        one.close()
        two.close()
    assert not taken(one.number)


def test_ros_domain_coordinator_finds_another():
    coordinator = pytest.importorskip("domain_coordinator")
    with_ours = domain.reserve()
    try:
        with coordinator.domain_id(selector=iter([with_ours.number, 77, 78, 79]).__next__) as number:
            assert number != with_ours.number
    finally:
        with_ours.close()


def test_a_domain_that_somebody_is_on_is_left_out(few):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as node:
        node.bind(
            ("127.0.0.1", domain.RTPS + domain.PORTS * 99 + 10)
        )  # the first participant of domain 99 listens there
        found = domain.reserve()
        found.close()
    assert found.number == 100


def test_it_stays_reserved_as_long_as_a_process_of_the_test_lives(few):
    ours = domain.reserve()
    child = subprocess.Popen(
        [sys.executable, "-c", "input()"], stdin=subprocess.PIPE, pass_fds=[ours.descriptor], stdout=subprocess.PIPE
    )
    try:
        ours.close()
        ours.close()
        assert taken(ours.number)
    finally:
        child.communicate(b"\n", timeout=600)
    assert not taken(ours.number)
