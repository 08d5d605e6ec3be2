"""Parameters of the telegrams, and why a set of them cannot be used."""

from __future__ import annotations

import os
from enum import Enum
from ipaddress import IPv4Address, IPv6Address, ip_address
from typing import Any

from ...physics.parameter import Block, choice, quantity
from .lci90i import Form, TensionUnit, name_problem
from .sources import FORMATS

RTPS, PORTS = 7400, 250  # UDP ports of ROS domain d: from 7400 + 250 d on. OMG DDSI-RTPS 9.6.2.3
PRIVILEGED = 1024  # ports below belong to services of the machine


def _port(what: str) -> Any:
    return quantity(0, "1", 0, 65535, f"UDP port of telegrams.address that hears {what}; 0: none are sent")


def _rate(name: str, source: str = "a choice") -> Any:
    return quantity(
        FORMATS[name].rate, "Hz", 0.01, 1000.0, "telegrams a second of simulation time, one a tick at most", source
    )


class HeaveSign(str, Enum):
    """Direction in which the heave of a telegram is positive."""

    UP = "up"
    DOWN = "down"


class Lci90i(Block):
    port: int = _port("LCI-90i: tension, speed, pay-out")
    rate: float = _rate("lci90i", "logs of NBP1406")
    number: int = quantity(1, "1", 0, 99, "number of the display, before RD")
    name: str = choice("TOW WINCH", "name of the winch; empty: no such field")
    tension_unit: TensionUnit = choice(TensionUnit.LB, "unit of the tension", "logs of NBP1406")
    plain_tension: bool = choice(False, "tension without zeros in front, with a point behind")
    speed_decimals: int = quantity(1, "1", 0, 3, "decimals of the speed in m/min", "log of the trawl winch of NBP1406")


class Psxn(Block):
    port: int = _port("PSXN,23: roll, pitch, heading, heave positive down")
    rate: float = _rate("psxn")


class Pashr(Block):
    port: int = _port("PASHR: time, heading, roll, pitch, heave")
    rate: float = _rate("pashr")
    heave: HeaveSign = choice(HeaveSign.UP, "direction in which its heave is positive: no source says it")


class Tss1(Block):
    port: int = _port("TSS1: accelerations, heave, roll, pitch")
    rate: float = _rate("tss1")


class Telegrams(Block):
    address: str = choice("127.0.0.1", "address of this host that all of them go to: 127.x.x.x or ::1, no other")
    lci90i: Lci90i = choice(Lci90i(), "winch display")
    psxn: Psxn = choice(Psxn(), "Seapath")
    pashr: Pashr = choice(Pashr(), "POS MV")
    tss1: Tss1 = choice(Tss1(), "Teledyne TSS")


def asked(block: Telegrams) -> dict[str, Any]:
    """Blocks of the telegrams that are on, by name."""
    return {name: part for name in FORMATS if (part := getattr(block, name)).port}


def form_of(part: Any) -> Any:
    """Form of the telegrams of a block; None where there is but one."""
    if isinstance(part, Lci90i):
        return Form(part.number, part.name, part.plain_tension, part.speed_decimals, part.tension_unit)
    return part.heave is HeaveSign.UP if isinstance(part, Pashr) else None


def address_of(text: str) -> IPv4Address | IPv6Address | None:
    """A loopback address; None where it is another, or none."""
    try:
        found = ip_address(text)
    except ValueError:
        return None
    plain = isinstance(found, IPv4Address) or found == IPv6Address("::1")
    return found if found.is_loopback and plain else None


def telegram_problem(block: Telegrams, tick: float) -> str:
    """ "" or why these telegrams cannot be sent; tick: s."""
    parts = asked(block)
    if parts and address_of(block.address) is None:
        return (
            f"parameter 'telegrams.address' = {block.address!r} is no loopback address: simulated instruments must not "
            f"be heard outside of this host; nothing was started. Give 127.0.0.1, another 127.x.x.x or ::1"
        )
    domain = int(text) if (text := os.environ.get("ROS_DOMAIN_ID", "0").strip()).isdecimal() else 0
    first = RTPS + PORTS * domain
    taken: dict[int, str] = {}
    for name, part in parts.items():
        key = f"parameter 'telegrams.{name}.port' = {part.port}"
        free = f"nothing was started. Give a port from {PRIVILEGED} to 65535 of its own, or 0 for no telegram"
        if part.port < PRIVILEGED:
            return f"{key}: ports below {PRIVILEGED} belong to services of this machine; {free}"
        if first <= part.port < first + PORTS:
            return f"{key}: ports {first} to {first + PORTS - 1} are those of ROS domain {domain}, this node's; {free}"
        if part.port in taken:
            return f"{key} is that of telegrams.{taken[part.port]} too: a receiver could not tell them apart; {free}"
        taken[part.port] = name
        if part.rate * tick > 1.0 + 1e-9:
            return (
                f"parameter 'telegrams.{name}.rate' = {part.rate:g} Hz is more than one telegram a tick of {tick:g} s; "
                f"nothing was started. Give at most {1.0 / tick:g} Hz, or a smaller solver.tick"
            )
    if block.lci90i.port and (why := name_problem(block.lci90i.name)):
        return (
            f"parameter 'telegrams.lci90i.name' = {block.lci90i.name!r} does not fit: nothing was started. Give {why}"
        )
    return ""
