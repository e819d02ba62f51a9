"""What a log tells of the gain of its servos: a number of the firmware, and when the motors are off."""

import re
from typing import Any

import numpy as np

from kr5.logs.log import Log

SERVO_GAIN = "servo_gain"  # column of a motion, and of a log that has none of its own
MOTOR_ON = re.compile(r"(torque|motors?|servos?|drives?|power)_?(is_)?(enabled?|on)$")
FIRMWARE_GAIN = re.compile(r"((position|pos|servo)_)?(kp|k_p|p_gain)$")


def note_servo_gain(log: Log, keeps_off: bool) -> None:
    """Where the motors are off in some rows: leaves out all but the longest part in which they are on, or, with
    `keeps_off`, those before the motors are on alone, where something else holds the arm. With `keeps_off` the log gets
    a column of the gain, too, 0 while the motors are off. Says so in notes."""
    state = motor_state(log)
    if state and keeps_off and (np.diff(log.columns[state]) < 0).any():
        _keep_from_first_on(log, state)
    elif state:
        _keep_longest_on(log, state)
    if keeps_off:
        _add_gain(log, state)


def motor_state(log: Log) -> str:
    """The column that tells when the motors are on, where they are off in some rows."""
    for name, state in log.columns.items():
        if MOTOR_ON.search(name.lower()) and np.isin(state, (0.0, 1.0)).all() and 0 < state.sum() < len(state):
            return name
    return ""


def _keep_longest_on(log: Log, name: str) -> None:
    state = log.columns[name]
    edges = np.flatnonzero(np.diff(np.concatenate([[0.0], state, [0.0]])))
    first, last = max(edges.reshape(-1, 2).tolist(), key=lambda part: part[1] - part[0])
    log.keep_rows(log.streams[name], slice(first, last))
    log.notes.append(
        f"{_off_words(log, name, state)}, in which the motor is off and no command moves it; rows {first + 1} to {last}"
        " are used"
    )


def _keep_from_first_on(log: Log, name: str) -> None:
    state = log.columns[name]
    first = int(np.flatnonzero(state)[0])
    log.keep_rows(log.streams[name], slice(first, None))
    left_out = f"; the first {first} of them are left out" if first else ""
    log.notes.append(
        f"{_off_words(log, name, state)}, in which the motor is off: no command moves the arm there, and it is"
        f" simulated so{left_out}"
    )


def _off_words(log: Log, name: str, state: np.ndarray) -> str:
    return f"{log.file.name}: {name} is 0 in {int(len(state) - state.sum())} of {len(state)} rows"


def _add_gain(log: Log, state: str) -> None:
    gain = _firmware_gain(log)
    if SERVO_GAIN in log.columns or (gain is None and not state):
        return
    name, number = gain or ("", np.ones(1))
    on = log.columns[state] if state else np.ones(1)
    if state and len(number) not in (1, len(on)):  # of another stream
        name, number = "", np.ones(1)
    values = number * on
    stream = log.streams[state or name] if (state or name in log.streams) else _main_stream(log)
    if len(values) == 1:
        values = np.full(len(log.columns[next(n for n, s in log.streams.items() if s == stream)]), values[0])
    log.add(SERVO_GAIN, values, stream)
    log.servo_gain_name = name


def _main_stream(log: Log) -> str:
    return next(iter(log.streams.values()))


def _firmware_gain(log: Log) -> tuple[str, np.ndarray] | None:
    """Name and numbers of a gain that the log states, one for all rows or one each."""
    for name, number in log.stated.items():
        if FIRMWARE_GAIN.match(name.lower()) and number > 0:
            return name, np.array([number])
    for name, values in log.columns.items():
        if FIRMWARE_GAIN.match(name.lower()) and np.isfinite(values).all() and (values > 0).all():
            return name, values
    return None


def scale_gains(parts: list[tuple[Log, dict[str, Any]]], reference: int) -> list[str]:
    """Brings the gains of several logs to that of one of them, which is the servo of the model; leaves out what says
    nothing. parts: logs with the columns of a map. reference: number of the part. Returns notes."""
    known = [log for log, columns in parts if log.servo_gain_name]
    own, _ = parts[reference]
    unit = _highest(own) if own.servo_gain_name else 1.0
    told = own.servo_gain_name and len(known) == len(parts)
    for log, columns in parts:
        if SERVO_GAIN not in columns:
            continue
        scale = 1.0 / (unit if told else _highest(log))
        columns[SERVO_GAIN] |= {"scale": scale}
        if np.allclose(scale * log.columns[SERVO_GAIN], 1.0):
            del columns[SERVO_GAIN]
    gains = list(dict.fromkeys(_highest(log) for log in known))
    if len(gains) < 2:
        return []
    if not told:
        return [
            f"logs have other gains of the firmware ({', '.join(f'{g:g}' for g in gains)}), but not every log states"
            " one; they are taken as alike"
        ]
    return [
        f"gains of the firmware ({own.servo_gain_name}) of {', '.join(f'{g:g}' for g in gains)}: the stiffness of the"
        f" servos is that of {unit:g}, and in proportion to it in the other logs"
    ]


def _highest(log: Log) -> float:
    return float(np.max(log.columns[SERVO_GAIN]))
