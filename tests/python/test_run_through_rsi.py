"""`kr5 run --through-rsi` and the jobs through a link of kr5.work. What they do is tested in C++."""

import io
from types import SimpleNamespace

import pytest
from kr5 import job, rsi
from kr5.cell import load_cell
from rich.console import Console

import conftest

work = pytest.importorskip("kr5.work", reason="this kr5 was built without DART, ViSP, PCL or SQLite")

from free_ports import free_port
from kr5_tools.cli import tables
from kr5_tools.work import job_cell, job_output, linked_run, run


@pytest.fixture(scope="module")
def given(share):
    return load_cell(share / "cells/kr5_arc.yaml")


def begun(given):
    cell = job_cell.make_cell(given, job_cell.JobSetup(1, 5, "nominal"))
    options = work.work_options(cell)
    options.job.pellets = 1
    work.place_over_bin(cell, options)
    return cell, options


def test_both_ends_agree_and_the_files_of_a_real_controller_have_their_limits(given):
    cell, options = begun(given)
    linked = linked_run.make_options(options, cell, "krc2", 6008)
    assert linked.layout.port == 6008 and linked.layout.controller == rsi.Controller.Krc2
    rules = linked.emulator.controller.rules
    assert rules.cycle == linked.link.cycle == cell.cycle
    program = work.program_options(linked)
    assert program.translation_limit == rules.translation_limit
    files = rsi.controller_files(linked.layout, program)
    assert "FT.Fx" in files.unwired


def test_a_job_in_lock_step_is_stopped_at_the_controller(given, tmp_path):
    cell, options = begun(given)
    linked = work.linked_options(options, cell.believed)
    journal = job.Journal(tmp_path / "job.db", "test")
    lockstep = work.LockstepJob(cell, options, linked, journal)
    lockstep.step(60)
    assert lockstep.runs and lockstep.state.phase == job.Phase.Scan
    lockstep.controller.emergency_stop()
    done = lockstep.run()
    assert done.job.state.stop == job.StopReason.Robot
    judged = done.controller.controller.answered + done.controller.controller.unasked
    assert done.link.answered - judged in (0, 1)  # the last one is judged in a cycle that is not made any more
    assert len(done.job.rows) > 50
    job_output.write_plots(done.job, journal.records(), done, tmp_path / "plots")
    assert {file.stem for file in (tmp_path / "plots").iterdir()} == {"time_line", "force", "link_times"}


def test_a_job_through_sockets_is_stopped_by_a_person(given, tmp_path):
    cell, options = begun(given)
    linked = linked_run.make_options(options, cell, "krc4", free_port())
    journal = job.Journal(tmp_path / "job.db", "test")
    linked_job = work.LinkedJob(cell, options, linked, journal)
    shown = []

    def show(state, reading):
        shown.append(reading)
        linked_job.stop_by_operator()

    done = linked_run.work(linked_job, 1, tmp_path / "job.db", SimpleNamespace(show=show))
    assert shown and all(len(reading.joints) == 6 for reading in shown)
    assert done.job.state.stop == job.StopReason.Operator
    assert job_cell.state_file(tmp_path / "job.db").is_file()
    assert journal.belief().stop == job.StopReason.Operator


def test_faults_need_a_link(run_kr5):
    for words in ((), ("--through-rsi", "--view"), ("--through-rsi", "--tilt", 20)):
        done = run_kr5("run", "--faults", 1, *words)
        assert done.returncode == 2
        assert "--through-rsi" in done.stderr


@pytest.mark.parametrize("option", [("--controller", "krc2"), ("--port", 6008)])
def test_options_of_a_link_that_would_do_nothing_are_refused(run_kr5, option):
    alone = run_kr5("run", *option)
    assert alone.returncode == 2 and f"{option[0]}: belongs to a link; add --through-rsi" in alone.stderr
    trials = run_kr5("run", "--through-rsi", "--faults", 1, *option)
    assert trials.returncode == 2 and f"{option[0]}: faults are tried in lock step" in trials.stderr


def test_what_the_kernel_did_not_give_is_told_with_its_remedy(capsys):
    given = rsi.RealTimeStatus(priority="given", locked_memory="given")
    run.tell_real_time(SimpleNamespace(real_time=given))
    assert capsys.readouterr().err == ""
    denied = rsi.RealTimeStatus(priority="denied", locked_memory="given")
    run.tell_real_time(SimpleNamespace(real_time=denied))
    told = capsys.readouterr().err
    assert all(remedy in told for remedy in rsi.real_time_remedies(denied))


def test_a_fault_that_did_harm_is_told():
    good = {"trials": 3, "continued": 1, "stopped": 2, "max_force": 21.5, "resumed": 2}
    rows = [work.FaultRow(fault="lost", **good), work.FaultRow(fault="emergency_stop", **good)]
    assert linked_run.sound(rows)
    assert linked_run.fault_rows(rows)[1][0] == "emergency stop"
    table = tables.make_table("Faults", linked_run.FAULT_COLUMNS, linked_run.fault_rows(rows))
    console = Console(file=io.StringIO(), width=80)
    console.print(table)
    conftest.check_tables(console.file.getvalue(), 80)
    for field in ("moving", "over_limit", "astray"):
        assert not linked_run.sound([work.FaultRow(fault="lost", **good, **{field: 1})])
    assert not linked_run.sound([work.FaultRow(fault="lost", **{**good, "stopped": 1})])
