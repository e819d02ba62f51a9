"""The state machine of a job as text for Mermaid and Graphviz, from the table that the supervisor runs by."""

from collections.abc import Callable, Iterator

from kr5 import job


def exits(table: job.PhaseTable) -> Iterator[tuple[str, str, str]]:
    """Phase, the one that follows, and why; stops stand in `stop_note`, once for all."""
    for row in table.rows:
        for leave in row.exits:
            if leave.outcome == job.Outcome.Stop:
                continue
            why = _words(leave.outcome)
            if not leave.retry:
                yield str(row.phase), str(leave.next), why
                continue
            yield str(row.phase), str(leave.next), f"{why} (at most {row.retries} times)"
            yield str(row.phase), str(leave.exhausted), f"{why}, no retry left"


def stop_note(table: job.PhaseTable) -> str:
    """From where a stop is possible."""
    phases = [_words(row.phase) for row in table.rows if any(e.outcome == job.Outcome.Stop for e in row.exits)]
    return f"A stop leads from each of these to stopped: {', '.join(phases)}."


def mermaid(table: job.PhaseTable) -> str:
    """A state diagram, as pages of Markdown show it."""
    lines = ["stateDiagram-v2", f"  [*] --> {table.rows[0].phase}"]
    lines += [f"  {begin} --> {end}: {why}" for begin, end, why in exits(table)]
    lines += [f"  {row.phase}: {label}" for row in table.rows if (label := _label(row, "<br/>"))]
    lines += [f"  {row.phase} --> [*]" for row in table.rows if not row.exits]
    lines += ["  note right of stopped", f"    {stop_note(table)}", "  end note"]
    return "\n".join(lines) + "\n"


def graphviz(table: job.PhaseTable) -> str:
    """A graph for `dot -Tsvg`."""
    lines = ["digraph job {", "  node [shape=box, style=rounded];"]
    lines += [f'  {row.phase} [label="{_label(row, chr(92) + "n")}"];' for row in table.rows]
    lines += [f'  {begin} -> {end} [label="{why}"];' for begin, end, why in exits(table)]
    lines += [f'  label="{stop_note(table)}";', "}"]
    return "\n".join(lines) + "\n"


FORMS: dict[str, Callable[[job.PhaseTable], str]] = {"mermaid": mermaid, "graphviz": graphviz}


def _label(row: job.PhaseRow, line_break: str) -> str:
    """Name of a phase, and its limits."""
    limits = [f"{row.timeout:g} s"] if row.timeout else []
    limits += [f"{row.force:g} N"] if row.force else []
    return line_break.join([_words(row.phase), *([", ".join(limits)] if limits else [])])


def _words(value: object) -> str:
    return str(value).replace("_", " ")
