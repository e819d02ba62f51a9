"""Findings on a link in words: what is wrong, and what a user can do about it."""

from collections.abc import Callable

from kr5 import rsi

from kr5_tools.cli.numbers import format_count

Words = tuple[str, str]  # what is wrong, what to do
UNITS = "the unit of the correction: degrees and millimetres on the wire"


def finding_words(finding: rsi.LinkFinding, layout: rsi.TelegramLayout) -> Words:
    """What is wrong, and its remedy."""
    return WORDS[str(finding.kind)](finding, layout)


def verdict_sentence(diagnosis: rsi.LinkDiagnosis, seen: rsi.LinkObservations) -> str:
    """The first sentence of a diagnosis."""
    good, time = diagnosis.telegrams.good, f"{seen.duration:.1f} s"
    if str(diagnosis.verdict) == "faulty":
        faults = sum(str(f.severity) == "fault" for f in diagnosis.findings)
        return f"{format_count(faults, 'fault')} in {time}, {format_count(good, 'good telegram')}."
    if str(diagnosis.verdict) == "undecided":
        return f"only {format_count(good, 'good telegram')} in {time}; listen longer with --for."
    cycle = f", one every {_ms(diagnosis.cycle)}" if diagnosis.cycle else ""
    return f"{format_count(good, 'good telegram')} in {time}{cycle}."


def _ms(seconds: float | None) -> str:
    return "–" if seconds is None else f"{seconds:.2f} s" if seconds >= 1 else f"{1e3 * seconds:.3g} ms"


def _mm(metres: float | None) -> str:
    return "–" if metres is None else f"{1e3 * metres:.1f} mm"


def _of(f: rsi.LinkFinding, noun: str) -> str:
    share = f" of {f.of}" if f.of else ""
    return f"{format_count(f.count, noun)}{share}"


def _first(f: rsi.LinkFinding) -> str:
    return "" if f.first is None else f", first after {f.first:.2f} s"


def _no_telegrams(f: rsi.LinkFinding, layout: rsi.TelegramLayout) -> Words:
    return (
        f"nothing came to port {f.found} in {_ms(f.measured_time)}, nor to another port of this computer",
        f"check that the program on the controller runs up to RSI_ON, that IP_NUMBER ({layout.address}) is this"
        f" computer in the network of the controller, that a ping arrives, and that no firewall drops"
        f" {str(layout.transport).upper()} (Linux: sudo ufw allow {f.found}/{layout.transport})",
    )


def _wrong_port(f: rsi.LinkFinding, layout: rsi.TelegramLayout) -> Words:
    return (
        f"nothing came to port {f.found}, but {format_count(f.count, 'datagram')} to ports on which nobody listens",
        f"the controller sends to another PORT; the layout says {layout.port}: listen there with --port, or correct"
        " PORT on the controller and load its file again",
    )


def _other_port(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return f"the layout sends to port {f.found}, and port {f.expected} was listened on", f"use --port {f.found}"


def _other_address(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"the layout sends to {f.found}, which is no address of this computer",
        "correct IP_NUMBER on the controller, or give the network card that address",
    )


def _foreign(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{_of(f, 'datagram')} from {', '.join(f.names)} were no telegrams{_first(f)}: '{f.found}'",
        "another program uses this port: take another PORT for the controller, or end that program",
    )


def _wrong_type(f: rsi.LinkFinding, layout: rsi.TelegramLayout) -> Words:
    if "answers" in f.names:
        return (
            f"{_of(f, 'answer')} had Type '{f.found}', expected '{f.expected}'",
            "answer with the SENTYPE of the controller's configuration",
        )
    return (
        f"{_of(f, 'telegram')} had <{f.found}>, expected <{f.expected}>",
        "a telegram <Sen> is the answer of a computer: is the port that of its other end? Else correct the name in the"
        " program that sends",
    )


def _missing(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{_of(f, 'telegram')} lacked {', '.join(f.names)}",
        "use the file that the controller has loaded, or add these elements to its <SEND> and start the program again",
    )


def _unknown(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{_of(f, 'telegram')} held {', '.join(f.names)}, which the layout does not have",
        "they are passed over; to read them, use the file that the controller has loaded",
    )


def _order(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"the elements stand in another order: {f.found}, expected {f.expected}",
        "it is read all the same, but this is not the file that the controller has loaded",
    )


def _damaged(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{_of(f, 'datagram')} were damaged ({', '.join(f.names)}){_first(f)}: '{f.found}'",
        "check cable and switch, and that nothing between controller and computer changes or cuts datagrams",
    )


def _rate(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"a telegram came every {_ms(f.measured_time)}, expected every {_ms(f.expected_time)}",
        "set the mode of RSI_ON (#IPO: 12 ms, #IPO_FAST: 4 ms) and the --cycle of this computer alike",
    )


def _lost(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{_of(f, 'telegram')} were lost, by the gaps of IPOC{_first(f)}",
        "use a direct cable or a switch of its own for the controller, and no wireless link",
    )


def _repeated(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{_of(f, 'telegram')} came twice{_first(f)}",
        "look for a loop in the network, two paths between the same ends, or a program that mirrors the port",
    )


def _reordered(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{_of(f, 'telegram')} came after a later one{_first(f)}",
        "use one path between controller and computer, without routers",
    )


def _jitter(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"one telegram in a hundred came more than {_ms(f.measured_time)} early or late (limit {_ms(f.expected_time)})",
        "switch off power saving of card and processor, keep other traffic off the cable, run a kernel for real time",
    )


def _interrupted(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{format_count(f.count, 'pause')} without telegrams, the longest {_ms(f.measured_time)}{_first(f)}",
        "check whether the program left RSI_MOVECORR, was stopped, or the cable was unplugged",
    )


def _stopped(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"the controller stopped sending after {f.first or 0.0:.2f} s",
        "read its messages: a timeout of answers, a correction beyond its limit, or the end of the program; then start"
        " the program again",
    )


def _restarted(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"the controller began anew {format_count(f.count, 'time')}, after at most {_ms(f.measured_time)}{_first(f)}",
        "nothing is wrong with the network; corrections hold until the link is told to resume",
    )


def _controller_clock(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"IPOC jumped by {_ms(f.measured_time)} against the arrivals{_first(f)}",
        "do not set the clock of the controller while RSI runs; where nobody did, look for a second program that sends",
    )


def _computer_clock(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"the clock of this computer jumped by {_ms(f.measured_time)}{_first(f)}",
        "the link goes by another clock, but logs with the time of day are off: set the clock before",
    )


def _second(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{', '.join(f.names[1:])} sent {format_count(f.count, 'telegram')} to the port of the controller"
        f" {f.names[0]}{_first(f)}",
        "end the second controller or emulator, or give each a port; only the first one gets answers",
    )


def _late(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{_of(f, 'answer')} left after the deadline of {_ms(f.expected_time)}; one in a hundred took more than"
        f" {_ms(f.measured_time)}",
        "end other work on this computer and permit real-time priority (kr5 rsi monitor says how)",
    )


def _ipoc(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{_of(f, 'answer')} had IPOC '{f.found}' for '{f.expected}'",
        "send the digits of IPOC back as they came, each telegram its own",
    )


def _rejected(f: rsi.LinkFinding, layout: rsi.TelegramLayout) -> Words:
    return (
        f"the controller counted {format_count(f.count, 'answer')} as late, though {f.of} left in time{_first(f)}",
        f"compare SENTYPE ('{layout.sensor_type}') and <RECEIVE> with the file that the controller has loaded, and"
        " check that a firewall lets answers out and that they take the network card of the controller",
    )


def _radians(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"axis values are in radians: with them the pose agrees to {_mm(f.other_distance)}, with degrees it is off by"
        f" {_mm(f.distance)}",
        "send degrees, as a controller does",
    )


def _pose(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"the pose told is {_mm(f.distance)} from that of the axis values in the cell",
        "check that the cell is this robot with the signs and zeros of its axes, and that the active tool and base of"
        " the controller are those of the cell",
    )


def _ignored(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"nothing moved by corrections of {', '.join(f.names)}",
        "check that the program is in RSI_MOVECORR, drives are on, override is 100 %, and that the correction object"
        " of the signal flow is wired to these channels",
    )


def _sign(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{', '.join(f.names)} moved against the correction (gain {f.gain:.2f})",
        "turn the sign in the signal flow, or of what computes the correction",
    )


def _axis(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"a correction of {f.names[0]} moved {f.names[1]} (gain {f.gain:.2f})",
        "compare the channels (INDX) of <RECEIVE> with the wiring of the correction object, and --frame with the"
        " program",
    )


def _unit(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return f"{', '.join(f.names)} moved {f.gain:.3g} times as far as corrected", f"correct {UNITS}"


def _scale(f: rsi.LinkFinding, _: rsi.TelegramLayout) -> Words:
    return (
        f"{', '.join(f.names)} moved {f.gain:.3g} times as far as corrected",
        "check factors and filters in the signal flow, its limits, and --mode against the program (#ABSOLUTE,"
        " #RELATIVE)",
    )


WORDS: dict[str, Callable[[rsi.LinkFinding, rsi.TelegramLayout], Words]] = {
    "no_telegrams": _no_telegrams,
    "wrong_port": _wrong_port,
    "other_port": _other_port,
    "other_address": _other_address,
    "foreign_datagrams": _foreign,
    "wrong_type": _wrong_type,
    "missing_elements": _missing,
    "unknown_elements": _unknown,
    "other_order": _order,
    "damaged_telegrams": _damaged,
    "wrong_rate": _rate,
    "lost_telegrams": _lost,
    "repeated_telegrams": _repeated,
    "reordered_telegrams": _reordered,
    "jitter": _jitter,
    "interrupted": _interrupted,
    "stopped_sending": _stopped,
    "controller_restarted": _restarted,
    "controller_clock_jump": _controller_clock,
    "computer_clock_jump": _computer_clock,
    "second_sender": _second,
    "late_answers": _late,
    "ipoc_not_echoed": _ipoc,
    "answers_rejected": _rejected,
    "radian_axes": _radians,
    "pose_mismatch": _pose,
    "correction_ignored": _ignored,
    "correction_sign": _sign,
    "correction_axis": _axis,
    "correction_unit": _unit,
    "correction_scale": _scale,
}
