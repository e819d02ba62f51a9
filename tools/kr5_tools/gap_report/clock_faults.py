"""What to do about columns that were logged late or early."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import kr5.gap

ENTRIES = {"torques": "tau", "currents": "i", "positions": "q", "wrench": "wrench"}  # of a map of logs, by group


def clock_remedy(fault: "kr5.gap.ClockFault", source: str, of_logs: bool) -> str:
    """How to correct a kr5.gap.ClockFault. `source`: what was diagnosed, as a command takes it; `of_logs`: with a
    model."""
    entry = f"columns.{ENTRIES[fault.group]}"
    begin = f"Correct the times of the {fault.columns}, and diagnose again:"
    if of_logs:
        return f"{begin} `kr5 gap diagnose {source} --set {entry}.delay={fault.delay:.3g}`."
    return (
        f"{begin} {entry}: {{delay: {fault.delay:.3g}}} in the map from which the recording was imported, or the time"
        " stamps at their source."
    )
