"""Faults of a job that inserts a pellet: what each of them is, and how it is brought about.

A fault is prepared before the job begins (limits that the insertion will reach), comes at an instant of the insertion
(at the controller, on the way of the telegrams, from a person, on the disk), or meets the program that goes on after
one that was killed at that instant."""

import math
import random
import resource
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import kr5.work
from kr5 import rsi

from telegram_way import Change, TelegramWay, nothing

if TYPE_CHECKING:
    from collections.abc import Mapping

MOST_MESSAGES = 20  # in succession that have a fault of the network
LONGEST_DELAY = 0.1  # [s]
LONGEST_JUMP = 3600.0  # [s]
SHARES = (0.4, 0.9)  # of what the insertion reaches, that a limit lies at
MISMATCH = (5.0, 30.0)  # of an axis [deg]
WRONG_WAY = 20.0  # of the correction that a second client asks for [mm]
BEYOND = 3000.0  # of a correction that no controller takes [mm]
TURNED = 3.0  # of an axis in one cycle [deg]


@dataclass
class Reached:
    """What an insertion without faults reaches."""

    duration: float  # from the beginning of the search to the pellet in the tube [s]
    force: float  # [N]
    torque: float  # [N m]
    currents: list[float]  # [A]
    lowest: float  # of the tool in the base, while it searches and inserts [m]
    highest: float  # [m]
    search_time: float  # [s]


@dataclass
class Scene:
    """Where a fault happens."""

    job: kr5.work.LinkedJob | None  # none before it begins
    way: TelegramWay
    layout: rsi.TelegramLayout
    journal: Path

    def running(self) -> kr5.work.LinkedJob:
        assert self.job is not None
        return self.job


Act = Callable[[Scene], None]


@dataclass
class Plan:
    """A fault of one trial, drawn."""

    instant: float  # from the beginning of the search [s]
    options: dict[str, object] = field(default_factory=dict)  # of the job, by their path, that differ
    act: Act | None = None
    may_go_on: bool = False  # whether the job may be done in spite of it
    lasting: bool = False  # the next program meets it, too, and no stop can be written
    kill: bool = False  # the program, at the instant
    after_kill: Act | None = None  # before the program that goes on begins
    journal_of: str = ""  # another job, of which that program takes the database to be
    clock_jump: float = 0.0  # of the clock of the computer [s]; in lock step, since nobody may set the real one


def rewrite(layout: rsi.TelegramLayout, sender: str, change: Callable[[dict[str, float]], object]) -> Change:
    """Each good telegram of a sender with other values; IPOC as it was."""
    codec = rsi.TelegramCodec(layout, rsi.Sender(sender))

    def changed(data: bytes) -> Iterable[bytes]:
        fault, values, ipoc = codec.decode(data)
        if fault != rsi.TelegramFault.None_:
            return [data]
        change(values)
        return [codec.encode(values, int(ipoc))]

    return changed


def add(name: str, value: float) -> Callable[[dict[str, float]], None]:
    def change(values: dict[str, float]) -> None:
        values[name] += value

    return change


def once(change: Change) -> Change:
    """For the next datagram only."""
    left = [True]

    def changed(data: bytes) -> Iterable[bytes]:
        if not left[0]:
            return [data]
        left[0] = False
        return change(data)

    return changed


def network(fault: str, reached: Reached, chance: random.Random) -> Plan:
    """Some messages in succession, of the controller or of the computer."""
    way = chance.choice(("telegrams", "answers"))
    count, delay = chance.randint(1, MOST_MESSAGES), chance.uniform(0.012, LONGEST_DELAY)

    def act(scene: Scene) -> None:
        timed = [rsi.TimedFault(fault=fault, time=0.0, count=count)]
        scene.way.faults[way] = rsi.FaultyWay(rsi.LinkFaults(delay=delay, timed=timed))

    return Plan(chance.uniform(0, reached.duration), act=act, may_go_on=True)


def jitter(reached: Reached, chance: random.Random) -> Plan:
    """Of every message of one way from an instant on, up to more than a cycle."""
    way, most = chance.choice(("telegrams", "answers")), chance.uniform(0.001, 0.02)

    def act(scene: Scene) -> None:
        scene.way.faults[way] = rsi.FaultyWay(rsi.LinkFaults(jitter=most, seed=1 + int(1e6 * most)))

    return Plan(chance.uniform(0, reached.duration), act=act, may_go_on=True)


def at_instant(act: Act, may_go_on: bool = False) -> Callable[[Reached, random.Random], Plan]:
    return lambda reached, chance: Plan(chance.uniform(0, reached.duration), act=act, may_go_on=may_go_on)


def limited(change: "Callable[[Reached, random.Random], Mapping[str, object]]") -> Callable[..., Plan]:
    """A limit that the insertion will reach."""
    return lambda reached, chance: Plan(reached.duration, options=dict(change(reached, chance)))


def at_restart(act: Act) -> Callable[[Reached, random.Random], Plan]:
    return lambda reached, chance: Plan(chance.uniform(0, reached.duration), kill=True, after_kill=act)


def wrong_port(scene: Scene) -> None:
    scene.way.port += 1


def second_client(scene: Scene) -> None:
    """Another computer answers, too, and before; and another controller sends what this one does."""
    answer = rsi.TelegramCodec(scene.layout, rsi.Sender.Computer)
    telegram = rsi.TelegramCodec(scene.layout, rsi.Sender.Controller)

    def telegrams(data: bytes) -> Iterable[bytes]:
        _, values, ipoc = telegram.decode(data)
        scene.way.to_controller(answer.encode({"RKorr.X": WRONG_WAY}, int(ipoc)))
        scene.way.to_link(telegram.encode({**values, "RIst.X": values["RIst.X"] + WRONG_WAY}, int(ipoc)))
        return [data]

    scene.way.telegrams = telegrams


def other_version(scene: Scene) -> None:
    """The configuration of a KR C2 without sensor and state."""
    ours = rsi.TelegramCodec(scene.layout, rsi.Sender.Controller)
    other = rsi.TelegramCodec(rsi.usual_layout(rsi.Controller.Krc2), rsi.Sender.Controller)
    known = {f"{f.element}.{f.attribute}" for f in other.telegram_fields if f.attribute}

    def telegrams(data: bytes) -> Iterable[bytes]:
        _, values, ipoc = ours.decode(data)
        return [other.encode({name: v for name, v in values.items() if name in known}, int(ipoc))]

    scene.way.telegrams = telegrams


def controller_clock_jump(reached: Reached, chance: random.Random) -> Plan:
    """The stamps of the controller go on elsewhere; it knows those of the answers again."""
    ahead = round(1000 * chance.uniform(1.0, LONGEST_JUMP))

    def act(scene: Scene) -> None:
        controller = rsi.TelegramCodec(scene.layout, rsi.Sender.Controller)
        computer = rsi.TelegramCodec(scene.layout, rsi.Sender.Computer)

        def shifted(codec: rsi.TelegramCodec, by: int) -> Change:
            def change(data: bytes) -> Iterable[bytes]:
                fault, values, ipoc = codec.decode(data)
                return [codec.encode(values, int(ipoc) + by)] if fault == rsi.TelegramFault.None_ else [data]

            return change

        scene.way.telegrams, scene.way.answers = shifted(controller, ahead), shifted(computer, -ahead)

    return Plan(chance.uniform(0, reached.duration), act=act)


def computer_clock_jump(reached: Reached, chance: random.Random) -> Plan:
    return Plan(chance.uniform(0, reached.duration), clock_jump=chance.uniform(1.0, LONGEST_JUMP))


def beyond_limits(scene: Scene) -> None:
    scene.way.answers = rewrite(scene.layout, "computer", add("RKorr.X", BEYOND))


def speed(scene: Scene) -> None:
    scene.way.telegrams = once(rewrite(scene.layout, "controller", add("AIPos.A1", TURNED)))


def current(reached: Reached, chance: random.Random) -> Plan:
    """Of one motor, beyond limits that are not reached otherwise."""
    limits = [2 * most + 1 for most in reached.currents]
    joint = chance.randrange(len(limits))

    def act(scene: Scene) -> None:
        scene.way.telegrams = rewrite(scene.layout, "controller", add(f"MACur.A{joint + 1}", 2 * limits[joint]))

    return Plan(chance.uniform(0, reached.duration), options={"job.stop.sensor.current": limits}, act=act)


def mismatched_axes(reached: Reached, chance: random.Random) -> Plan:
    """An axis is counted from elsewhere than the cell says."""
    name, by = f"AIPos.A{chance.randint(1, 5)}", chance.choice((-1, 1)) * chance.uniform(*MISMATCH)

    def act(scene: Scene) -> None:
        scene.way.telegrams = rewrite(scene.layout, "controller", add(name, by))

    return Plan(chance.uniform(0, reached.duration), kill=True, after_kill=act)


def radian_axes(scene: Scene) -> None:
    """Axis values in radians, where the wire has degrees."""

    def change(values: dict[str, float]) -> None:
        for k in range(1, 7):
            values[f"AIPos.A{k}"] = math.radians(values[f"AIPos.A{k}"])

    scene.way.telegrams = rewrite(scene.layout, "controller", change)


def degree_axes(scene: Scene) -> None:
    """Axis values as if radians had been sent in degrees, 57 times what they are."""

    def change(values: dict[str, float]) -> None:
        for k in range(1, 7):
            values[f"AIPos.A{k}"] = math.degrees(values[f"AIPos.A{k}"])

    scene.way.telegrams = rewrite(scene.layout, "controller", change)


def cut_cable(scene: Scene) -> None:
    scene.way.telegrams = scene.way.answers = nothing


def fill_disk(scene: Scene) -> None:
    """The log of the database cannot grow: this process may write no longer file."""
    size = scene.journal.with_name(scene.journal.name + "-wal").stat().st_size
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))


def free_disk() -> None:
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))


def share_of(name: str, path: str) -> Callable[[Reached, random.Random], dict[str, object]]:
    return lambda reached, chance: {path: chance.uniform(*SHARES) * getattr(reached, name)}


def deep_floor(reached: Reached, chance: random.Random) -> dict[str, object]:
    """The lowest place of the tool within the way that the insertion takes."""
    way = reached.highest - reached.lowest
    return {"job.stop.lowest": [-2.0, -2.0, reached.lowest + (1 - chance.uniform(*SHARES)) * way]}


FAULTS: "dict[str, Callable[[Reached, random.Random], Plan]]" = {
    "wrong port": at_instant(wrong_port),
    "second client": at_instant(second_client, may_go_on=True),
    "XML of another version": at_instant(other_version),
    "clock of the controller jumps": controller_clock_jump,
    "clock of the computer jumps": computer_clock_jump,
    "controller restarted midway": at_instant(lambda scene: scene.running().controller.reset_program()),
    "correction beyond limits": at_instant(beyond_limits),
    "cell does not match the axis values": mismatched_axes,
    "axis values in degrees for radians": at_restart(degree_axes),
    "axis values in radians for degrees": at_restart(radian_axes),
    "database of another job": lambda reached, chance: Plan(
        chance.uniform(0, reached.duration), kill=True, journal_of="another job"
    ),
    "full disk": lambda reached, chance: Plan(chance.uniform(0, reached.duration), act=fill_disk, lasting=True),
    "late": lambda *given: network("late", *given),
    "lost": lambda *given: network("lose", *given),
    "doubled": lambda *given: network("double", *given),
    "reordered": lambda *given: network("reorder", *given),
    "truncated": lambda *given: network("truncate", *given),
    "jitter": jitter,
    "stop by force": limited(share_of("force", "job.stop.sensor.force")),
    "stop by torque": limited(share_of("torque", "job.stop.sensor.torque")),
    "stop by current": current,
    "stop by speed": at_instant(speed),
    "stop by workspace": limited(deep_floor),
    "stop by timeout": limited(share_of("search_time", "search timeout")),
    "lost link": at_instant(cut_cable),
    "stop by the operator": at_instant(lambda scene: scene.running().stop_by_operator()),
    "emergency stop": at_instant(lambda scene: scene.running().controller.emergency_stop()),
    "drives off": at_instant(lambda scene: scene.running().controller.set_drives(False)),
}
