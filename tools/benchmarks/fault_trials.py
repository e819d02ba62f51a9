"""One fault of a job that inserts a pellet through an RSI link over loopback, in real time, with its database on the
disk: what came of it, by the truth of the simulator."""

import contextlib
import dataclasses
import gc
import random
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import kr5.robot
import kr5.work
import numpy as np
from kr5 import job

from fault_plans import FAULTS, Act, Plan, Reached, Scene, free_disk
from kr5_tools.work.job_cell import JobSetup, make_cell, work_options
from telegram_way import HERE, THERE, TelegramWay

PAUSE = 0.002  # [s] between two looks
WATCHED = 1.0  # [s] of the cell after a stop
AT_REST, IN_TIME = 5e-4, 0.25  # way [m] of an arm that stands, in so long [s] before the end of the watch
LONGEST = 60.0  # [s] of a trial
REST = 100  # cycles in which an arm or a pellet comes to rest
MOST_RELEASES = 3
MOST_CYCLES, STEP = 20_000, 50  # of a job that goes on
SENSOR_ERROR = (0.05, 1.0)  # by which a force may be above a limit that the sensor does not see [-, N]
JOB = "insertion"
INSERTING = (job.Phase.Search, job.Phase.Insert)
AFTER = (*INSERTING, job.Phase.Next, job.Phase.Done, job.Phase.Stopped)


@dataclasses.dataclass
class Trial:
    """What came of one fault."""

    fault: str
    number: int
    ended: str = "went on"  # | stopped | refused | hung
    reason: str = "none"  # of the stop, or of the refusal
    moving: bool = False  # after the stop
    unharmed: bool = True  # it did not go on in spite of a fault that must stop it
    held: bool = False  # until a person had released it: latched in the journal, or refused while the fault lasts
    releases: int = 0  # by a person
    resumed: bool = False  # after them, to the end of the job
    astray: bool = False  # journal and cell do not agree on the pellets
    max_force: float = 0.0  # [N]
    over_limit: bool = False  # for more than a cycle

    def sound(self) -> bool:
        ends = self.ended == "went on" or (
            self.ended != "hung" and (self.held or self.ended == "refused") and self.resumed
        )
        return ends and self.unharmed and not (self.moving or self.astray or self.over_limit)


@dataclasses.dataclass
class TruthWatch:
    """Force and place of the tool, cycle by cycle."""

    limit: float  # [N]
    cycle: float  # [s]
    max_force: float = 0.0  # [N]
    over_limit: bool = False
    begun: float | None = None  # when the force went above the limit [s]
    places: list[tuple[float, np.ndarray]] = dataclasses.field(default_factory=list)

    def look(self, truth: "kr5.sim.WorkCellTruth") -> None:
        if self.places and truth.time <= self.places[-1][0]:
            return
        self.places.append((truth.time, truth.T_base_tool[:3, 3].copy()))
        force = float(np.linalg.norm(truth.contact[:3]))
        self.max_force = max(self.max_force, force)
        if force <= (1 + SENSOR_ERROR[0]) * self.limit + SENSOR_ERROR[1]:
            self.begun = None
            return
        self.begun = truth.time if self.begun is None else self.begun
        self.over_limit |= truth.time - self.begun > 1.5 * self.cycle

    def moving(self) -> bool:
        end, place = self.places[-1]
        return any(np.linalg.norm(p - place) > AT_REST for t, p in self.places if t >= end - IN_TIME)


class Insertion:
    """A job of one pellet that has come to the tube, from where each trial begins."""

    def __init__(self, cell_file: Path, seed: int, folder: Path) -> None:
        setup = JobSetup(1, seed, "usual")
        self.seed, self.folder = seed, folder
        self.cell = make_cell(kr5.cell.load_cell(cell_file), setup)
        self.options = work_options(self.cell, setup)
        kr5.work.place_over_bin(self.cell, self.options)
        lockstep = kr5.work.LockstepJob(self.cell, self.options, self.linked(self.options), self.journal("begin.db"))
        while not lockstep.finished and lockstep.state.phase != job.Phase.Search:
            lockstep.step()
        self.state = self.cell.state()
        del lockstep
        self.reached = self._undisturbed()

    def journal(self, name: str = "trial.db", of: str = JOB) -> job.Journal:
        return job.Journal(self.folder / name, of)

    def linked(self, options: kr5.work.WorkOptions) -> kr5.work.LinkedOptions:
        return kr5.work.linked_options(options, self.cell.believed)

    def begin_again(self) -> None:
        self.cell.restore(self.state)
        for file in self.folder.glob("trial.db*"):
            file.unlink()
        shutil.copy(self.folder / "begin.db", self.folder / "trial.db")

    def _undisturbed(self) -> Reached:
        self.begin_again()
        lockstep = kr5.work.LockstepJob(self.cell, self.options, self.linked(self.options), self.journal())
        while not lockstep.finished:
            lockstep.step()
        run = lockstep.result().job
        if run.state.phase != job.Phase.Done:
            raise SystemExit(f"error: seed {self.seed}: its pellet is not inserted without faults")
        rows, names = run.rows, list(job.Phase.__members__)
        phase = rows["phase"]
        during = np.isin(phase, [names.index(p.name) for p in INSERTING])
        heights, times = rows["tool_z"][during], rows["time"][during]
        searching = rows["time"][phase == names.index(job.Phase.Search.name)]
        return Reached(
            duration=float(times[-1] - times[0]),
            force=_largest([rows[f"f{axis}"][during] for axis in "xyz"]),
            torque=_largest([rows[f"t{axis}"][during] for axis in "xyz"]),
            currents=[float(np.abs(rows[f"i{k}"]).max()) for k in range(1, 7)],
            lowest=float(heights.min()),
            highest=float(heights.max()),
            search_time=float(searching[-1] - searching[0]),
        )

    def options_of(self, plan: Plan) -> kr5.work.WorkOptions:
        given: dict[str, Any] = self.options.to_dict()
        for path, value in plan.options.items():
            if path == "search timeout":
                next(row for row in given["job"]["phases"]["rows"] if row["phase"] == "search")["timeout"] = value
                continue
            *parts, last = path.split(".")
            place = given
            for part in parts:
                place = place[part]
            place[last] = value
        return kr5.work.WorkOptions.from_dict(given)

    def try_fault(self, fault: str, number: int) -> Trial:
        """The same fault and number draw the same plan."""
        plan = FAULTS[fault](self.reached, random.Random(f"{self.seed} {fault} {number}"))
        self.begin_again()
        trial, watch = Trial(fault, number), self._watch(plan)
        if plan.clock_jump:
            self._jump(plan, watch, trial)
        else:
            with TelegramWay() as way:
                self._through_link(plan, way, watch, trial)
        trial.max_force, trial.over_limit = watch.max_force, watch.over_limit
        trial.unharmed = plan.may_go_on or trial.ended != "went on"
        if trial.ended != "went on":
            self._release(trial)
        self._rest(fingers=not (trial.ended == "went on" or trial.resumed))
        truth, belief = kr5.work.judge_job(self.cell), self.journal().belief()
        trial.astray = truth.lost > 0 or truth.in_tube != belief.inserted
        return trial

    def _watch(self, plan: Plan) -> TruthWatch:
        return TruthWatch(self.options_of(plan).job.stop.sensor.force, self.cell.cycle)

    def _rest(self, fingers: bool) -> None:
        """The arm is held, as by a controller without a program; the fingers keep what they have, or let go."""
        command = kr5.robot.RobotCommand(stop=True, gripper=kr5.robot.GripperCommand(fingers=fingers))
        for _ in range(REST):
            self.cell.read()
            self.cell.send(command)

    def _jump(self, plan: Plan, watch: TruthWatch, trial: Trial) -> None:
        lockstep = kr5.work.LockstepJob(self.cell, self.options, self.linked(self.options), self.journal())
        began, jumped = None, False
        while not lockstep.finished:
            lockstep.step()
            truth = self.cell.truth()
            watch.look(truth)
            if began is None and lockstep.state.phase in AFTER:
                began = truth.time
            if began is not None and not jumped and truth.time - began >= plan.instant:
                lockstep.jump_clock(plan.clock_jump)
                jumped = True
        for _ in range(round(WATCHED / self.cell.cycle)):
            lockstep.step()
            watch.look(self.cell.truth())
        note_state(trial, lockstep.state, watch)

    def _through_link(self, plan: Plan, way: TelegramWay, watch: TruthWatch, trial: Trial) -> None:
        try:
            with self._program(self.options_of(plan), way) as scene:
                run_until(scene, plan, watch)
                if not plan.kill:
                    note_end(scene, watch, trial)
            if plan.kill:
                self._begin_with_fault(plan, way, watch, trial)
            if plan.lasting:
                again = Trial(trial.fault, trial.number)
                self._begin_with_fault(plan, way, watch, again)
                trial.held, trial.moving = again.ended != "went on", trial.moving or again.moving
        finally:
            free_disk()

    @contextlib.contextmanager
    def _program(
        self, options: kr5.work.WorkOptions, way: TelegramWay, of: str = JOB, before: Act | None = None
    ) -> Iterator[Scene]:
        """A program; one that is left unfinished is killed."""
        linked = self.linked(options)
        layout, link = linked.layout, linked.link
        layout.address, layout.port, link.listen = THERE, way.controller_port, HERE
        linked.layout, linked.link = layout, link
        scene = Scene(None, way, layout, self.folder / "trial.db")
        if before:
            before(scene)
        journal = self.journal(of=of)
        scene.job = kr5.work.LinkedJob(self.cell, options, linked, journal)
        try:
            yield scene
        finally:
            scene.job = None
            gc.collect()

    def _begin_with_fault(self, plan: Plan, way: TelegramWay, watch: TruthWatch, trial: Trial) -> None:
        """The program that begins after one that was killed meets the fault before anything has moved."""
        self._rest(fingers=True)
        place = self.cell.truth().T_base_tool[:3, 3].copy()
        try:
            with self._program(self.options, way, plan.journal_of or JOB, plan.after_kill) as scene:
                run_until(scene, Plan(LONGEST), watch)
                note_end(scene, watch, trial)
        except kr5.IoError as error:
            trial.ended, trial.reason = "refused", str(error).split(": ", 1)[-1].split(",")[0]
        trial.moving |= bool(np.linalg.norm(self.cell.truth().T_base_tool[:3, 3] - place) > AT_REST)

    def _release(self, trial: Trial) -> None:
        """A person looks, releases the stop, and the job goes on without faults; where it stops once more, again."""
        trial.held = trial.held or self.journal().belief().stop != job.StopReason.None_
        while not trial.resumed and trial.releases < MOST_RELEASES:
            trial.releases += 1
            self._rest(fingers=True)
            trial.resumed = self._go_on()
            gc.collect()  # a journal that is open keeps every other program out

    def _go_on(self) -> bool:
        """Whether the job comes to its end, once a stop is released."""
        journal = self.journal()
        if journal.belief().stop != job.StopReason.None_:
            journal.release("a person")
        truth, seen = kr5.work.judge_job(self.cell), job.RestartMeasurements()
        seen.station, seen.tube = truth.on_stand > 0, truth.in_tube
        again = kr5.work.LockstepJob(self.cell, self.options, self.linked(self.options), journal, seen)
        for _ in range(MOST_CYCLES // STEP):
            if again.finished:
                break
            again.step(STEP)
        return again.decision.status == job.RestartStatus.Finished or (
            again.runs and again.state.phase == job.Phase.Done
        )


def _largest(components: list[np.ndarray]) -> float:
    return float(np.linalg.norm(components, axis=0).max())


def run_until(scene: Scene, plan: Plan, watch: TruthWatch) -> None:
    """Until the job has ended, or its program is to be killed."""
    running, began, acted = scene.running(), None, False
    end = time.monotonic() + LONGEST
    while not running.finished and time.monotonic() < end:
        running.serve()
        truth = running.cell_truth()
        watch.look(truth)
        if began is None and running.state.phase in AFTER:
            began = truth.time
        if began is not None and not acted and truth.time - began >= plan.instant:
            if plan.kill:
                return
            acted = True
            if plan.act:
                plan.act(scene)
        time.sleep(PAUSE)


def note_end(scene: Scene, watch: TruthWatch, trial: Trial) -> None:
    """How a program has ended, and whether the arm stands then."""
    running = scene.running()
    if not running.finished:
        trial.ended = "hung"
        return
    running.serve()  # to the state at the end
    until = time.monotonic() + (WATCHED if running.state.phase == job.Phase.Stopped else 0.0)
    while time.monotonic() < until:
        running.serve()
        watch.look(running.cell_truth())
        time.sleep(PAUSE)
    note_state(trial, running.end().job.state, watch)


def note_state(trial: Trial, state: job.JobState, watch: TruthWatch) -> None:
    if state.phase == job.Phase.Done:
        return
    trial.ended, trial.reason, trial.moving = "stopped", str(state.stop), watch.moving()
    if state.stop == job.StopReason.CellFault:
        trial.reason = f"cell fault: {state.cell_fault}"
