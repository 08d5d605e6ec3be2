"""What a step calls and copies, with each option of a scene absent, off and on: ``cable-sim bench --account``.

Counted, not timed: the same figures on every machine, however busy. A call is one by symbol (compiler/by_symbol.py),
its words are what the caller lays down for it; bytes are those that checkpoints copy. Work inside a kernel has no count
here: ``--features`` and ``--water`` time it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import llvmlite.ir as ir
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from cable_sim_ros.compiler import by_symbol, kernel_form
from cable_sim_ros.physics.state import SLOTS, State
from cable_sim_ros.runs.message_run import Progress
from cable_sim_ros.sim.inputs import WinchCommand
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.simulator import Simulator
from cable_sim_ros.terminal import markdown_table

from ..shipped import started
from .features import STEP, hung
from .water_cost import OPTIONS as OF_WATER
from .water_cost import Changes, changed

TICKS = 20
CHECKPOINTS = ("integrate._predict", "tick._tick")  # each call copies one slot of the state
MOTOR = {"drive.inertia": 50.0, "drive.curve_speed": [0.0, 6.0], "drive.curve_pull": [9e3, 9e3]}
# option: what has its keys there but switched off, what switches it on
OPTIONS: dict[str, tuple[Changes | None, Changes]] = OF_WATER | {
    "wind": ({"air.wind": [0.0, 0.0], "air.density": 1.1}, {"air.wind": [10.0, 0.0]}),
    "instruments": ({"instruments.mru.latency": 0.1}, {"instruments.mru.on": True}),
    "dead time of the drive": ({"drive.dead_time": 0.0}, {"drive.dead_time": 0.1}),
    "motor": (MOTOR, MOTOR | {"drive.model": "motor"}),
}


class Kernel(NamedTuple):
    """Calls of one kernel, and the words that one of them is handed."""

    calls: int
    words: int


class Account(NamedTuple):
    """What ``steps`` steps called by symbol, and the bytes that one checkpoint copies."""

    steps: int
    kernels: dict[str, Kernel]
    slot_bytes: int

    @property
    def calls(self) -> float:
        """Calls a step."""
        return sum(kernel.calls for kernel in self.kernels.values()) / self.steps

    @property
    def words(self) -> float:
        """Words handed over a step."""
        return sum(kernel.calls * kernel.words for kernel in self.kernels.values()) / self.steps

    @property
    def bytes(self) -> float:
        """Bytes that checkpoints copy a step."""
        return (
            self.slot_bytes * sum(self.kernels[name].calls for name in CHECKPOINTS if name in self.kernels) / self.steps
        )


@contextmanager
def counted() -> Iterator[dict[str, Kernel]]:
    """Count the calls by symbol of what is linked already; the dictionary is filled at the end.

    Callers find in the cell of a symbol, for a while, code that counts and goes on to the kernel.
    """
    context, counts, module = cpu_target.target_context, {}, ir.Module("account")
    word, names = ir.IntType(64), [symbol for symbol, cell in by_symbol._cells.items() if cell.value]
    before = {symbol: by_symbol._cells[symbol].value for symbol in names if symbol in kernel_form.asked}
    words = {}
    for symbol, address in before.items():
        arguments, result = kernel_form.asked[symbol]
        kind = context.call_conv.get_function_type(result, arguments)
        counts[symbol], words[symbol] = ctypes.c_int64(0), len(kind.args) - 2  # result and exception come before
        function = ir.Function(module, kind, f"counted.{symbol}")
        builder = ir.IRBuilder(function.append_basic_block())
        place = ir.Constant(word, ctypes.addressof(counts[symbol])).inttoptr(word.as_pointer())
        builder.store(builder.add(builder.load(place), ir.Constant(word, 1)), place)
        builder.ret(builder.call(builder.inttoptr(ir.Constant(word, address), kind.as_pointer()), function.args))
    with global_compiler_lock:
        library = context.codegen().create_library("account")
        library.add_ir_module(module)
        library.finalize()
    found: dict[str, Kernel] = {}
    try:
        for symbol in before:
            by_symbol._cells[symbol].value = library.get_pointer_to_function(f"counted.{symbol}")
        yield found
    finally:
        for symbol, address in before.items():
            by_symbol._cells[symbol].value = address
    for symbol, count in counts.items():
        if count.value:
            found[symbol.partition("physics.")[2]] = Kernel(count.value, words[symbol])


def slot_bytes(state: State) -> int:
    """Bytes that a checkpoint copies."""
    return sum(table.nbytes for table in (state.memory, state.nodes, state.attitude)) // SLOTS


def of_ticks(sim: Simulator, ticks: int = TICKS) -> Account:
    """What that many ticks of a tow that hauls call, after a first one."""
    sim.push(WinchCommand(rate=0.5))
    sim.run(1)
    with counted() as kernels:
        frames = sim.run(ticks)
    return Account(int(frames.substeps.sum()), kernels, slot_bytes(sim.state))


def of_line() -> Account:
    """What steps of a line call that hangs in the air, without ship, winch and water."""
    rig = hung()
    rig.run(STEP, STEP)
    with counted() as kernels:
        steps = rig.run(TICKS * STEP, STEP).steps
    return Account(steps, kernels, slot_bytes(rig.state))


def accounts(progress: Progress) -> dict[str, tuple[Account | None, Account]]:
    """Of full_scale, on one mesh, with each option off (None: it has no such state) and on; the first without any."""
    mesh, found = layout_of(changed({})).mesh, {}
    for k, (name, (off, on)) in enumerate(({"none": (None, {})} | OPTIONS).items()):
        progress(name, k, len(OPTIONS) + 1)
        one, other = (None if keys is None else of_ticks(started(changed(keys), mesh)) for keys in (off, on))
        assert other is not None
        found[name] = one, other
    return found


def study(_: int | None, progress: Progress) -> tuple[dict[str, Any], str]:
    """Accounts as data, and two tables: kernels of a line and of a tow, and options of the tow."""
    tows = accounts(progress)
    scenes = {"a line in air": of_line(), "`full_scale`": tows["none"][1]}
    lines = [
        (scene, kernel, f"{count.calls / account.steps:.2f}", str(count.words))
        for scene, account in scenes.items()
        for kernel, count in sorted(account.kernels.items(), key=lambda item: -item[1].calls * item[1].words)
    ]
    options = []
    for name, both in tows.items():
        off, on = ("-" if a is None else f"{a.calls:.2f}, {a.words:.0f}, {a.bytes:.0f}" for a in both)
        options.append((name, off, on))
    text = markdown_table([("scene", "kernel", "calls a step", "words a call"), *lines])
    text += "\n\n" + markdown_table([("option", "off: calls, words, bytes copied a step", "on"), *options])
    named = {name: dict(zip(("off", "on"), both, strict=True)) for name, both in tows.items()}
    data = {
        "scenes": {name.strip("`"): as_data(account) for name, account in scenes.items()},
        "options": {name: {k: a and as_data(a) for k, a in both.items()} for name, both in named.items()},
    }
    return data, text


def as_data(account: Account) -> dict[str, Any]:
    """An account for JSON, with its sums."""
    kernels = {name: kernel._asdict() for name, kernel in account.kernels.items()}
    sums = {"calls": account.calls, "words": account.words, "bytes": account.bytes}
    return account._asdict() | {"kernels": kernels} | sums
