"""From which instant the times of a log are counted."""

import numpy as np

from kr5_tools.log_import.log import Log


def beginning(log: Log, column: str) -> float:
    """The stamp from which time is counted, in the unit of a column of times: the least of the log's streams, which
    share a clock."""
    columns = set(log.clocks.values()) if column in log.clocks.values() else {column}
    return min(float(np.nanmin(log.columns[c])) for c in columns)
