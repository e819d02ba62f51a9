"""`kr5 run` and kr5.work: the job from bin to tube. What it does is tested in C++."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request

import kr5
import numpy as np
import pytest
from kr5 import job, logs
from kr5.cell import load_cell, save_cell

work = pytest.importorskip("kr5.work", reason="this kr5 was built without DART, ViSP, PCL or SQLite")

from kr5 import sim

from free_ports import free_port
from kr5_tools.work import job_cell, job_log, job_tables, remedies, run_page


@pytest.fixture(scope="module")
def given(share):
    return load_cell(share / "cells/kr5_arc.yaml")


def begun(given, folder, cycles):
    """A job of one pellet, begun."""
    cell = job_cell.make_cell(given, job_cell.JobSetup(1, 5, "nominal"))
    options = work.work_options(cell)
    options.job.pellets = 1
    work.place_over_bin(cell, options)
    runner = work.JobRunner(cell, options, job.Journal(folder / "job.db", "test"))
    runner.step(cycles)
    return cell, runner


def test_a_job_runs_cycle_by_cycle(given, tmp_path):
    cell, runner = begun(given, tmp_path, 30)
    assert runner.runs and not runner.finished
    assert runner.state.phase == job.Phase.Scan
    rows = runner.result().rows
    assert len(rows) == 30
    assert np.allclose(np.diff(rows["time"]), cell.cycle)
    assert np.allclose(rows["set_z"][0], rows["tool_z"][0])
    assert work.judge_job(cell).in_bin == 1


def test_a_nominal_cell_has_no_errors_and_a_shallow_tube_is_made_deeper(given):
    errors = job_cell.exact_errors().to_dict()
    assert not np.any(np.concatenate([np.ravel(v) for v in errors.values()]))
    few = job_cell.make_cell(given, job_cell.JobSetup(2, 5, "usual"))
    many = job_cell.make_cell(given, job_cell.JobSetup(5, 5, "usual"))
    assert few.believed.tube.depth == given.tube.depth
    assert many.believed.tube.depth > 5 * many.options.pour.height_max
    assert few.options.errors.to_dict() == sim.WorkCellErrors().to_dict()


def test_clearance_and_tilt_are_those_of_cell_and_job(given):
    usual, setup = job_cell.JobSetup(1, 5, "nominal"), job_cell.make_setup(1, 5, "nominal", 0.1, 20)
    assert job_cell.make_setup(1, 5, "nominal", None, None) == usual
    assert setup.job_id(given) == f"{usual.job_id(given)}, clearance 0.1 mm, tilt 20 degrees"
    cell = job_cell.make_cell(given, setup)
    options = job_cell.work_options(cell, setup)
    bodies = options.job.insertion.bodies
    assert bodies.inner_radius - bodies.peg_radius == pytest.approx(1e-4)
    assert options.job.insertion.tilt == pytest.approx(np.radians(20)) and options.job.pellets == 1
    plain = work.work_options(job_cell.make_cell(given, usual))
    plain.job.pellets = 1
    assert job_cell.work_options(job_cell.make_cell(given, usual), usual).to_dict() == plain.to_dict()


def test_what_a_job_knows_is_told(given, tmp_path):
    cell, runner = begun(given, tmp_path, 5)
    setup = job_cell.JobSetup(1, 5, "nominal")
    records = [job.JobRecord(number=k, pellet=k, station={"visits": visits}) for k, visits in ((1, 1), (2, 2), (3, 1))]
    out = job_tables.as_dict("id", setup, runner.result(), work.judge_job(cell), records)
    assert out["clearance"] == 2.8e-4 and out["tilt"] == setup.tilt and out["laid_down"] == [2]
    figures = job.JobStatistics(pellets=[job.PelletFigures(number=1, peak_jerk=123.4)])
    assert job_tables.pellet_rows(figures)[0][job_tables.PELLET_COLUMNS.index("jerk [m/s³]")] == "123"


def test_every_stop_and_every_finding_has_a_remedy():
    for reason in job.StopReason.__members__.values():
        if reason != job.StopReason.None_:
            text = remedies.stop_text(job.JobState(stop=reason, stopped_in=job.Phase.Pick), None)
            assert remedies.words(reason) in text
    for fault in job.CellFault.__members__.values():
        if fault != job.CellFault.None_:
            state = job.JobState(stop=job.StopReason.CellFault, cell_fault=fault)
            assert remedies.CELL_FAULTS[str(fault)] in remedies.stop_text(state, None)
    decision = job.RestartDecision(status="contradiction")
    for name in remedies.FINDINGS:
        decision.finding = name
        assert remedies.FINDINGS[name] in remedies.refusal_text(decision, None)


def test_the_page_shows_phases_forces_and_pellets(given, tmp_path):
    cell, runner = begun(given, tmp_path, 60)
    done = runner.result()
    run = run_page.replay_run(done)
    assert [note for _, note in run.notes][:2] == ["check cell", "scan"]
    made = [
        job.JobRecord(number=k + 1, time=float(k), kind="enter", phase=phase, pellet=1)
        for k, phase in enumerate(("pick", "stand", "regrip"))
    ]
    assert run_page.phase_spans(made) == [(1, "pick", 0.0, 1.0), (1, "stand", 1.0, 1.0)]
    setup = job_cell.JobSetup(1, 5, "nominal")
    page = run_page.job_page(done, work.judge_job(cell), made, cell, setup, tmp_path / "cell.yaml")
    for text in ("Time line", "Force", "In truth: 1 in the bin.", "Job of 1 pellet<", "clearance 0.28 mm", "tilt 15°"):
        assert text in page


@pytest.mark.parametrize("ending", [".csv", ".mcap"])
def test_the_log_of_a_job_is_read_as_one_of_the_arm(given, share, tmp_path, ending):
    if ending == ".mcap":
        pytest.importorskip("mcap", reason="pip install 'kr5[mcap]'")
    cell, runner = begun(given, tmp_path, 900)
    rows = runner.result().rows
    file = tmp_path / f"job{ending}"
    job_log.write_job_log(rows, file)
    recording = logs.read_logs(file, share / "cells/kr5_arc.yaml").recording
    parts = recording.experiments
    read = {name: np.concatenate([part[name] for part in parts]) for name in parts[0].data.columns}
    cycles = np.round(read["t"] / cell.cycle).astype(int)
    assert len(cycles) > 800
    for joint in range(1, given.robot.joints + 1):
        assert np.allclose(read[f"qc{joint}"], rows[f"q{joint}"][cycles], atol=1e-3)  # they are smoothed
        assert np.allclose(read[f"i{joint}"], rows[f"i{joint}"][cycles], atol=1e-9)


def interrupted(*words, folder, after):
    """Exit code of a job with the journal job.db that Ctrl-C stops some seconds after its first record, and what it
    says."""
    command = [sys.executable, "-m", "kr5_tools", *map(str, words)]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        end = time.monotonic() + 120
        while not (folder / "job.db.cell").exists() and running.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        time.sleep(after)
        os.kill(running.pid, signal.SIGINT)
        _, said = running.communicate(timeout=60)
    return running.returncode, said


def test_an_interrupted_job_goes_on_where_it_was_and_ends(run_kr5, tmp_path):
    command = ("run", "--pellets", 1, "--seed", 5, "--journal", "job.db")
    code, said = interrupted(*command, folder=tmp_path, after=0.3)
    assert code not in (0, 1, 2)
    assert "stopped; the journal job.db keeps the job: the same command goes on where it was" in said
    done = run_kr5(*command, "--json", "out.json", "--report", "page.html")
    assert done.returncode == 0, done.stdout + done.stderr
    out = json.loads((tmp_path / "out.json").read_text())
    assert out["decision"]["status"] == "continue"
    assert out["done"] and out["truth"]["in_tube"] == 1 and out["statistics"]["programs"] == 2
    assert "In truth: 1 in the tube." in done.stdout
    assert (tmp_path / "page.html").stat().st_size > 10_000
    again = run_kr5(*command)
    assert again.returncode == 0 and "The job is done: 1 inserted." in again.stdout


def test_a_released_job_goes_on_without_the_link_that_it_was_stopped_in(run_kr5, tmp_path):
    command = ("run", "--pellets", 1, "--seed", 5, "--journal", "job.db")
    _, said = interrupted(*command, "--through-rsi", "--port", free_port(), folder=tmp_path, after=1.0)
    assert "the journal job.db keeps the stop by operator. Release it with `kr5 job release job.db" in said
    assert run_kr5(*command).returncode == 1  # latched
    assert run_kr5("job", "release", "job.db", "--person", "Ada Lovelace").returncode == 0
    done = run_kr5(*command)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "In truth: 1 in the tube." in done.stdout


@pytest.mark.parametrize("seed", [5, 7])
def test_the_log_of_a_clean_job_names_nothing(run_kr5, share, tmp_path, seed):
    assert run_kr5("run", "--pellets", 1, "--seed", seed, "--log", "clean.csv").returncode == 0
    model = share / "cells/kr5_arc.yaml"
    assert run_kr5("gap", "diagnose", "clean.csv", "--model", model, "-o", "clean.json").returncode == 0
    assert json.loads((tmp_path / "clean.json").read_text())["causes"] == []


def test_the_log_of_a_job_names_an_effect_of_its_cell(run_kr5, share, tmp_path):
    worn = load_cell(share / "cells/kr5_arc.yaml")
    worn.set_effect("coulomb_friction", "joint2", "coulomb", 60.0)
    save_cell(worn, tmp_path / "worn.yaml")
    assert run_kr5("run", "worn.yaml", "--pellets", 1, "--seed", 5, "--log", "worn.csv").returncode == 0
    model = share / "cells/kr5_arc.yaml"
    assert run_kr5("gap", "diagnose", "worn.csv", "--model", model, "-o", "worn.json").returncode in (0, 1)
    cause = json.loads((tmp_path / "worn.json").read_text())["causes"][0]
    assert (cause["effect"], cause["target"]) == ("coulomb_friction", "joint2")
    level = cause["parameters"]["coulomb"]
    assert abs(level["value"] - 60.0) < 4 * level["std"] + 0.5


def test_a_job_is_shown_as_it_runs_and_then_its_page(tmp_path):
    words = [sys.executable, "-m", "kr5_tools", "run", "--pellets", "1", "--seed", "5", "--view", "--log", "job.csv"]
    with subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as command:
        address = command.stdout.readline().split()[-1]
        with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(f"{address}stream") as stream:
            *told, last = [json.loads(line[6:]) for line in stream if line.startswith(b"data: ")]
        printed, _ = command.communicate(timeout=60)
    assert command.returncode == 0
    assert told[0]["phase"] != "done" and told[-1]["phase"] == "done" and told[-1]["inserted"] == 1
    assert np.all(np.diff([message["time"] for message in told]) >= 0)
    assert np.ptp([message["q"] for message in told], axis=0).max() > 0.01  # far beyond the noise of the encoders
    assert last["look"] == "good" and last["text"] in printed
    assert "job.html: open it in a browser." in printed
    assert (tmp_path / "job.html").stat().st_size > 10_000
    text = (tmp_path / "job.csv").read_text().splitlines()
    assert text[0].startswith("t,q1,") and f"job.csv: {len(text) - 1} rows." in printed


def test_a_latched_stop_is_told_with_its_remedy(run_kr5, tmp_path):
    setup = job_cell.JobSetup(1, 5, "usual")
    cell = load_cell(kr5.share("cells/kr5_arc.yaml"))
    journal = job.Journal(tmp_path / "job.db", setup.job_id(cell))
    journal.append(
        [
            job.JobRecord(number=1, kind="begin"),
            job.JobRecord(number=2, kind="stop", phase="scan", outcome="stop", stop="force", time=1.0),
        ]
    )
    del journal
    missing = run_kr5("run", "--pellets", 1, "--seed", 5, "--journal", "job.db")
    assert missing.returncode == 2 and "state of the simulated cell is missing" in missing.stderr
    made = job_cell.make_cell(cell, setup)
    work.place_over_bin(made, work.work_options(made))
    made.read()
    made.state().save(job_cell.state_file(tmp_path / "job.db"))
    stopped = run_kr5("run", "--pellets", 1, "--seed", 5, "--journal", "job.db")
    assert stopped.returncode == 1
    assert "stopped by force" in stopped.stdout and "kr5 job release job.db" in stopped.stdout


@pytest.mark.parametrize(
    "words, complaint",
    [
        (("--pellets", 0), "pellets"),
        (("--report", "page.txt"), "expected .html"),
        (("--log", "job.txt"), "expected .csv or .mcap"),
        (("none.yaml",), "none.yaml"),
        (("--clearance", 0), "clearance: found 0, expected more than 0 mm"),
        (("--tilt", 95), "tilt: found 95, expected more than 0 and less than 90 degrees"),
        (("--journal", "nowhere/job.db"), "nowhere"),
    ],
)
def test_bad_input_is_named(run_kr5, words, complaint):
    done = run_kr5("run", *words)
    assert done.returncode == 2 and complaint in done.stderr


def test_the_journal_of_another_job_and_a_cell_without_camera_are_refused(run_kr5, tmp_path, share):
    job.Journal(tmp_path / "job.db", "another")
    done = run_kr5("run", "--pellets", 1, "--journal", "job.db")
    assert done.returncode == 2 and "belongs to the job 'another'" in done.stderr
    text = (share / "cells/kr5_arc.yaml").read_text()
    begin, end = text.index("camera:"), text.index("board:")
    (tmp_path / "blind.yaml").write_text(text[:begin] + text[end:])
    done = run_kr5("run", "blind.yaml", "--pellets", 1)
    assert done.returncode == 2 and "camera: the cell has none" in done.stderr


def test_what_is_so_is_told_in_words():
    truth = work.JobTruth(in_tube=2, lost=1)
    assert job_tables.truth_text(truth) == "In truth: 2 in the tube, 1 elsewhere."


def test_ways_are_planned_in_python_too(given):
    cell = job_cell.make_cell(given, job_cell.JobSetup(1, 5, "nominal"))
    options = work.work_options(cell)
    work.place_over_bin(cell, options)
    reading = cell.read()
    tube = options.job.places.T_base_tube
    asked = job.PerceptionRequest(kind="way", stamp=3)
    asked.way = job.WayRequest(T_base_from=reading.T_base_tool, phase="approach", T_base_tube=tube)
    stops = work.stops_ahead(asked.way, options)
    assert [stop.neutral for stop in stops] == [False, True]
    plan = work.plan_ways(cell.believed, reading.joints, stops, options)
    assert plan.possible and len(plan.ways) == 2
    assert plan.duration == pytest.approx(sum(way.duration for way in plan.ways))
    found = work.plan_way(asked, cell.believed, reading.joints, options)
    assert found.found and found.stamp == 3
    assert np.allclose(found.way.at(1.0), found.way.end) and np.allclose(found.way.end, plan.ways[0].end, atol=1e-3)
    asked.way.T_base_tube = tube + np.array([[0, 0, 0, 2.0]] + 3 * [[0] * 4])
    assert not work.plan_way(asked, cell.believed, reading.joints, options).found
    options.ways = work.ArmWayOptions(margin=-1)
    with pytest.raises(kr5.InvalidArgument, match="margin"):
        options.validate()


def test_a_supervisor_of_python_is_given_ways(given, tmp_path):
    cell = job_cell.make_cell(given, job_cell.JobSetup(1, 5, "nominal"))
    options = work.work_options(cell)
    work.place_over_bin(cell, options)
    supervisor = job.Supervisor(options.job, job.RestartDecision(), job.Journal(tmp_path / "job.db", "test"))
    given_ways = 0
    for _ in range(400):
        reading = cell.read()
        cell.send(supervisor.step(reading))
        asked = supervisor.request
        if asked.kind == job.RequestKind.Sweep:
            break
        if asked.kind == job.RequestKind.Way:
            way = work.plan_way(asked, cell.believed, reading.joints, options)
            given_ways += supervisor.deliver_way(way)
            assert not supervisor.deliver_way(way)
    assert given_ways == 1 and supervisor.request.kind == job.RequestKind.Sweep
