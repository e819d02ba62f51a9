"""The page about a diagnosis (kr5-gap/2): verdict, map of the cell, causes with evidence, residuals before and
after."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import kr5
import kr5.cell
import kr5.gap
import numpy as np
from kr5.files import writing
from kr5.gap import column_text, dependence_text, effect_text, joint_name, notes, part_of, part_text
from kr5.logs.compared_source import command_of, name_of

from kr5_tools.cli import terminal
from kr5_tools.cli.numbers import format_percent
from kr5_tools.gap_report.diagnosis_file import DiagnosisFile
from kr5_tools.gap_report.messages import capitalised, effect_row, group_of, join_list, next_steps
from kr5_tools.gap_report.model_warnings import model_warnings
from kr5_tools.gap_report.mujoco_sentences import check_rows, check_sentences
from kr5_tools.gap_report.parameter_rows import parameter_rows

if TYPE_CHECKING:
    from kr5_tools.calibrate.plots import Plot
    from kr5_tools.gap_report.evidence_data import Evidence

TITLE = "Why simulation and cell disagree"
SEARCHED = 3  # causes in whose place other effects are tried; each takes a search of its own
SAID = 1.15  # a gap below this is coloured, but not written beside the part
LOOK = {
    "no_gap": ("good", "✓", "No gap"),
    "explained": ("good", "✓", "Explained"),
    "partly_explained": ("doubtful", "!", "Partly explained"),
    "unknown": ("unusable", "?", "Unknown"),
}


def write_gap_report(
    diagnosis: DiagnosisFile,
    source: Path,
    output: Path,
    png: Path | None = None,
    folder: Path | None = None,
    recording: kr5.cell.Recording | None = None,
) -> list[Path]:
    """Writes the page and, if asked, the plots; returns the files of the plots. `folder`: of the recording;
    `recording`: that was diagnosed, where it was read already."""
    import matplotlib.pyplot as plt

    from kr5_tools.gap_report.evidence_data import Evidence, find_recording
    from kr5_tools.gap_report.insertion_impact import task_terms
    from kr5_tools.gap_report.plots import plots_of
    from kr5_tools.pages.plot_style import STYLE
    from kr5_tools.pages.rendering import write_png

    found = diagnosis.found
    recording = recording or find_recording(diagnosis.input, source, folder)
    if recording is None:
        what = "logs and their model were" if diagnosis.of_logs else "recording was"
        warnings.warn(
            f"the {what} not found, so the page shows no curves; specify a recording with --recording",
            kr5.Caution,
            stacklevel=2,
        )
    drawn: list[Any] = []
    try:
        with terminal.spinner("Simulating and drawing …"):
            evidence = Evidence(found, recording) if recording else None
            parts, q = parts_of(evidence, found), first_posture(recording) if recording else []
            task = (
                task_terms(recording.cell, evidence.cell) if evidence and found.causes and not evidence.unset else None
            )
            drawn = plots_of(evidence, found, parts, q)
            with plt.rc_context(STYLE):
                page = make_page(diagnosis, source, evidence, parts, q, drawn, task)
                writing.write_text(page, output)
                return write_png(drawn, png) if png else []
    except (TypeError, ValueError, KeyError, AttributeError, IndexError) as error:
        if recording is None or not _fits(found, recording):
            raise kr5.FileError(
                source,
                f"does not fit its recording ({type(error).__name__}: {error}); specify the right one with --recording",
            ) from error
        raise
    finally:
        for plot in drawn:
            plt.close(plot.figure)


def _fits(found: kr5.gap.Diagnosis, recording: kr5.cell.Recording) -> bool:
    """Whether the recording has the columns the diagnosis speaks of."""
    kinds = {str(e.kind) for e in recording.experiments}
    return all(place.experiment in kinds for place in found.where)


def first_posture(recording: kr5.cell.Recording) -> list[float]:
    """In which the cell is drawn: the middle one of a measured motion, where the arm is in the open."""
    from kr5_tools.cell.rest_posture import rest_posture

    n = recording.cell.robot.joints
    for kind in ("motion", "poses", "views"):
        for e in recording.experiments:
            if str(e.kind) == kind and all(f"q{i + 1}" in e.data for i in range(n)):
                q = np.column_stack([e[f"q{i + 1}"] for i in range(n)])
                return [float(x) for x in q[np.argmin(np.sum((q - np.median(q, axis=0)) ** 2, axis=1))]]
    return rest_posture(recording.cell, recording)


def parts_of(evidence: "Evidence | None", found: kr5.gap.Diagnosis) -> list[dict[str, Any]]:
    """Every part of the cell that a column shows, with the widest gap before and after, and its colour."""
    from kr5_tools.gap_report.plots import gap_colour

    if evidence is None:
        return []

    named = {
        "before": {group_of(p) for p in found.where},
        "after": {group_of(p) for p in found.unexplained},
    }
    causes = {part_of_target(c.target): effect_text(c.effect, c.target) for c in found.causes}
    parts: dict[str, dict[str, Any]] = {}
    for group in evidence.groups:
        part = parts.setdefault(
            part_of(group),
            {
                "id": part_of(group),
                "words": part_text(part_of(group)),
                "groups": [],
                "cause": causes.get(part_of(group)),
            },
        )
        part["groups"].append(group)
    for part in parts.values():
        for which in ("before", "after"):
            above = [g for g in part["groups"] if g in named[which]]
            rest = part["groups"] if which == "before" else [part["before"]["group"]]
            gaps = {g: evidence.gap(g, which) for g in above or rest}
            group = max(gaps, key=lambda g: gaps[g])
            gap = float(gaps[group])
            part[which] = {
                "gap": gap if np.isfinite(gap) else None,
                "above": bool(above),
                "label": bool(above) and gap >= SAID,
                "group": group,
                "column": column_text(group),
                "colour": gap_colour(gap, bool(above)),
            }
        part["shown"] = part["before"]["above"] or part["after"]["above"] or bool(part["cause"])
    above_first = sorted(parts.values(), key=lambda p: p["words"])
    return sorted(above_first, key=lambda p: -(p["before"]["gap"] or 0) if p["before"]["above"] else 0)


def themed_parts(parts: list[dict[str, Any]]) -> Any:
    """The parts with colours that follow the page's theme."""
    from kr5_tools.pages.rendering import theme_variable

    return writing.to_plain(
        [
            {**part, **{k: {**part[k], "colour": theme_variable(part[k]["colour"])} for k in ("before", "after")}}
            for part in parts
        ]
    )


def floor_text(found: kr5.gap.Diagnosis, evidence: "Evidence | None") -> str:
    """Of a recording without gap: how near the floor its columns are."""
    if evidence is None or str(found.verdict) != "no_gap":
        return ""
    return f" {kr5.gap.floor_text(evidence.told.columns)}"


def part_of_target(target: str) -> str:
    """The part that an effect's target is drawn as."""
    if target.startswith("motor"):
        return target.replace("motor", "joint")
    own = {"force_torque": "sensor", "gripper": "tool", "base": "joint1"}.get(target)
    return own or ("sensor" if part_of(f"motion.{target}") == "sensor" else target)


def depends_text(place: kr5.gap.ColumnExcess) -> str:
    return capitalised("; ".join(dependence_text(d, place.experiment) for d in place.depends_on))


def place_rows(found: kr5.gap.Diagnosis) -> list[dict[str, Any]]:
    """The table of columns above the floor."""
    left = {group_of(p) for p in found.unexplained}
    after = {column.column: column.after for column in found.reduction.columns}
    rows = []
    for place in found.where:
        group = group_of(place)
        rows.append(
            {
                "group": group,
                "words": capitalised(column_text(group)),
                "gap": place.gap,
                "share": format_percent(place.share),
                "after": after.get(group),
                "left": group in left,
                "depends": depends_text(place),
            }
        )
    return rows


def cause_rows(found: kr5.gap.Diagnosis, evidence: "Evidence | None") -> list[dict[str, Any]]:
    """What is said of each cause, and what other effects do in its place."""
    out = []
    for k, cause in enumerate(found.causes):
        row, joint = effect_row(cause.effect), joint_name(found.joint_names, cause.target)
        parameters = parameter_rows(cause, evidence.recording.cell if evidence else None)
        reasons = kr5.gap.cause_reasons(found, k, evidence.told) if evidence else kr5.gap.cause_reasons(found, k)
        out.append(
            {
                "name": capitalised(effect_text(cause.effect, cause.target)),
                "id": f"{cause.effect} on {cause.target}{f' ({joint})' if joint else ''}",
                "sure": format_percent(cause.probability),
                "what": capitalised(row.description) if row else "An effect that is not in the catalogue",
                "shows": row.shows_in if row else "",
                "remedy": row.remedy if row else "",
                "parameters": parameters,
                "nominal": any(p["nominal"] for p in parameters),
                "for": reasons.in_favour,
                "against": reasons.against,
                "rivals": rival_texts(k, evidence),
            }
        )
    return out


def rival_texts(k: int, evidence: "Evidence | None") -> list[str]:
    """What other effects do in the place of a cause."""
    if not evidence or not evidence.explained:
        return []
    if k >= SEARCHED:
        return [f"Other effects were tried in the place of the first {SEARCHED} causes only."]
    rivals = kr5.gap.rival_effects(evidence.found, evidence.told, k, evidence.recording, evidence.simulator)
    return kr5.gap.rival_texts(rivals, evidence.told)


def unexplained_rows(found: kr5.gap.Diagnosis) -> list[dict[str, Any]]:
    """Columns that no cause explains."""
    return [
        {"words": capitalised(column_text(group_of(p))), "gap": p.gap, "depends": depends_text(p)}
        for p in found.unexplained
    ]


def tie_texts(found: kr5.gap.Diagnosis) -> list[str]:
    """Causes with the effects that the data do not tell from them."""
    return [
        f"{effect_text(c.effect, c.target)} and {join_list([effect_text(t.effect, t.target) for t in c.tied_with])}"
        for c in found.causes
        if c.tied_with
    ]


def make_page(
    diagnosis: DiagnosisFile,
    source: Path,
    evidence: "Evidence | None",
    parts: list[dict[str, Any]],
    q: list[float],
    drawn: "list[Plot]",
    task: dict[str, Any] | None = None,
) -> str:
    """The HTML of the page."""
    from kr5_tools.gap_report.evidence_data import named_inputs
    from kr5_tools.pages.rendering import embed_plot, render_page, script_json
    from kr5_tools.replay.page import cell_scene

    plots = {p.name: embed_plot(p) for p in drawn if p.name != "map"}
    found = diagnosis.found
    look, icon, word = LOOK[str(found.verdict)]
    if str(found.verdict) == "no_gap" and found.scope:
        word = "No gap in what the recording can show"
    inputs = named_inputs(diagnosis.input, evidence)
    scene = None
    if evidence:
        scene = {**cell_scene(evidence.recording.cell), "q": q, "parts": themed_parts(parts)}
    return render_page(
        "gap.html",
        brand="kr5 gap diagnose",
        title=TITLE,
        data=diagnosis,
        source=source.name,
        look=look,
        icon=icon,
        word=word,
        verdict=found.headline,
        details=found.details + floor_text(found, evidence),
        warnings=model_warnings(found, evidence.recording.cell, inputs.get("model")) if evidence else [],
        steps=next_steps(diagnosis, command_of(inputs), inputs.get("model"), evidence.cell if evidence else None),
        places=place_rows(found),
        causes=cause_rows(found, evidence),
        unexplained=unexplained_rows(found),
        ties=tie_texts(found),
        conditions=evidence.parts() if evidence else [],
        experiment=found.next_experiment.text,
        notes=notes(found, diagnosis.noise_declared),
        mujoco=check_sentences(diagnosis.mujoco) if diagnosis.mujoco else [],
        mujoco_rows=check_rows(diagnosis.mujoco) if diagnosis.mujoco else [],
        parts=parts,
        heat=[plots[n] for n in ("heat_before", "heat_after") if n in plots],
        shrink=plots.get("shrink"),
        curves=[plots[n] for n in plots if n.startswith(("rows_", "against_"))],
        recording=name_of(inputs),
        made_of="Log" if "logs" in inputs else "Recording",
        shown=evidence is not None,
        unset=evidence.unset if evidence else [],
        columns=len(evidence.groups) if evidence else None,
        scene=script_json(scene),
        task=task,
    )
