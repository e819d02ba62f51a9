"""Programs of a job that are killed at random instants: what they leave on the disk, and whether the job goes on.

A killed program leaves its journal and the file of its cell (`cell_file` of kr5.work.JobRunner), which stands for a
cell that stays as it was left. Some are killed between both: the file has been written, the records have not."""

import gc
import random
import sqlite3
from dataclasses import dataclass, field
from pathlib import Path

import kr5.cell
import kr5.robot
import kr5.sim
import kr5.work
import numpy as np
from kr5 import job

from kr5_tools.work.job_cell import JobSetup, make_cell, restore_cell, state_file, work_options

TORN = 0.25  # share of the kills between the file of the cell and the records
LONGEST = 700  # cycles of a program that is killed
PROGRAM = 20_000  # cycles within which one that is not comes to the end of its job
REST = 250  # cycles in which the last pellet comes to rest


@dataclass
class KillTrial:
    """What came of jobs whose programs were killed."""

    kills: int = 0
    largest_first_step: float = 0.0  # from the measured pose to the first command of a program [m]
    problems: list[str] = field(default_factory=list)


def open_journal(file: Path) -> job.Journal:
    """The journal of whatever job it is, or a new one."""
    return job.Journal(file, job.journal_job(file) if file.exists() else "kills")


def run_program(
    cell: kr5.sim.WorkCell, setup: JobSetup, file: Path, cycles: int, trial: KillTrial
) -> job.RestartStatus | None:
    """One program, killed after so many cycles; None: the job has come to its end, or has stopped."""
    options = work_options(cell, setup)
    journal = open_journal(file)
    if journal.last_number == 0:
        kr5.work.place_over_bin(cell, options)
    runner = kr5.work.JobRunner(cell, options, journal, cell_file=str(state_file(file)))
    decision = runner.decision
    if not job.goes_on(decision.status):
        if decision.status not in (job.RestartStatus.Finished, job.RestartStatus.Latched):
            trial.problems.append(f"{decision.status}: {decision.finding}")
        return None if decision.status != job.RestartStatus.Latched else decision.status
    runner.step()
    way = runner.command.tool[:3, 3] - runner.reading.T_base_tool[:3, 3]
    trial.largest_first_step = max(trial.largest_first_step, float(np.linalg.norm(way)))
    runner.step(cycles)
    if not runner.finished:
        return decision.status
    if runner.state.phase != job.Phase.Done:
        trial.problems.append(f"stopped by {runner.state.stop} in {runner.state.stopped_in}")
    cell.state().save(state_file(file))
    return None


def tear(file: Path) -> None:
    """As if the last records had not come to the disk any more: those of one transaction are of one instant."""
    with sqlite3.connect(file) as database:
        database.execute("DELETE FROM record WHERE time = (SELECT time FROM record ORDER BY number DESC LIMIT 1)")
    database.close()


def judge(cell: kr5.sim.WorkCell, file: Path, pellets: int, trial: KillTrial) -> None:
    """Journal and cell must agree on every pellet."""
    for _ in range(REST):
        cell.read()
        cell.send(kr5.robot.RobotCommand())
    belief, truth = open_journal(file).belief(), kr5.work.judge_job(cell)
    inserted = [p for p in belief.pellets if p.state == job.PelletState.Inserted]
    if belief.phase != job.Phase.Done:
        trial.problems.append(f"the job ended in {belief.phase}")
    if not belief.inserted == len(inserted) == truth.in_tube:
        trial.problems.append(f"{belief.inserted} inserted by the journal, {truth.in_tube} in the tube")
    if truth.lost or truth.in_tube + truth.in_bin != pellets:
        trial.problems.append(f"of {pellets} pellets {truth.in_tube} are in the tube, {truth.in_bin} in the bin")


def one_job(
    given: kr5.cell.Cell, setup: JobSetup, file: Path, kills: int, chance: random.Random, trial: KillTrial
) -> None:
    """A job whose programs are killed so often, or until it ends, and one more that ends it."""
    cell = make_cell(given, setup)
    for _ in range(kills):
        status = run_program(cell, setup, file, chance.randrange(LONGEST), trial)
        gc.collect()  # a journal that is open keeps every other program out
        if status is None:
            break
        trial.kills += 1
        if chance.random() < TORN:
            tear(file)
        restore_cell(cell, file)
    else:
        run_program(cell, setup, file, PROGRAM, trial)
        gc.collect()
    judge(cell, file, setup.pellets, trial)


def kill_often(given: kr5.cell.Cell, setup: JobSetup, folder: Path, kills: int, seed: int) -> KillTrial:
    """Jobs of seeds one after the other, until as many programs were killed."""
    trial, chance, number = KillTrial(), random.Random(seed), 0
    while trial.kills < kills:
        here = JobSetup(setup.pellets, setup.seed + number, setup.errors)
        one_job(given, here, folder / f"kills{number}.db", kills - trial.kills, chance, trial)
        number += 1
    return trial
