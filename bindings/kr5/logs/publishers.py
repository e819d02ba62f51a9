"""Positions that two publishers, or two robots, write to one place in turn."""

import numpy as np

# A reading that jumps away and comes straight back is a jump to and fro: a jump is this many times what readings change
# by, and DIGITS times the last digit of the encoder, which may flicker; it comes back to within BACK of the jump.
JUMP, DIGITS, BACK = 6.0, 8.0, 0.3
LEAST = 1e-3  # [rad, m, or a smaller unit of the log]
SHARE = 0.05  # of the readings of a log, above which jumps are no disturbance
FEWEST = 20  # readings of which anything is said


def found_in_turn(values: np.ndarray) -> bool:
    """Whether positions, in the order of the log, jump to and fro, as those of two publishers do, also of different
    rates."""
    values = values[np.isfinite(values)]
    if len(values) < FEWEST:
        return False
    step, second = np.diff(values), np.abs(values[2:] - values[:-2])
    usual = float(np.median(np.minimum(np.minimum(np.abs(step[:-1]), np.abs(step[1:])), second)))
    changes = np.concatenate([np.abs(step), second])
    digit = float(changes[changes > 0].min(initial=np.inf))
    jump = max(LEAST, JUMP * usual, DIGITS * digit)
    away = (np.abs(step[:-1]) > jump) & (np.abs(step[1:]) > jump) & (step[:-1] * step[1:] < 0)
    back = second < BACK * np.abs(step[:-1])
    return bool((away & back).mean() > SHARE)
