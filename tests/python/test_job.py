"""kr5.job and `kr5 job`: the table of phases, the journal, a restart, a job step by step."""

import json

import kr5
import numpy as np
import pytest
from kr5 import job, robot

from kr5_tools.work import diagram


def record(number, kind, **fields):
    return job.JobRecord(number=number, kind=kind, time=float(number), **fields)


@pytest.fixture
def stopped(tmp_path):
    """The journal of a job that has inserted one pellet and stopped with the second."""
    file = tmp_path / "monday.db"
    journal = job.Journal(file, "monday")
    journal.append(
        [
            record(1, "begin"),
            record(2, "enter", phase="scan"),
            record(3, "enter", phase="pick", pellet=1),
            record(4, "enter", phase="search", pellet=1, pellet_state="regripped", outcome="hole_found"),
            record(5, "pellet", phase="next", pellet=1, pellet_state="inserted"),
            record(6, "enter", phase="pick", pellet=2),
            record(7, "stop", stop="force"),
        ]
    )
    return file


def test_a_diagram_shows_every_exit_of_the_table():
    table = job.usual_phases()
    exits = [(str(row.phase), e) for row in table.rows for e in row.exits if str(e.outcome) != "stop"]
    for text, arrow in ((diagram.mermaid(table), "-->"), (diagram.graphviz(table), "->")):
        lines = [line.strip() for line in text.splitlines()]
        for phase, leave in exits:
            why = str(leave.outcome).replace("_", " ")
            begins = f"{phase} {arrow} {leave.next}"
            assert any(line.startswith(begins) and why in line for line in lines), (phase, leave)
        assert "A stop leads from each of these to stopped: check cell, look, scan, pick" in text


def test_a_changed_table_changes_the_diagram():
    table = job.usual_phases()
    rows = table.rows
    rows[2].retries = 17
    table.rows = rows
    assert "(at most 17 times)" in diagram.mermaid(table)
    assert "(at most 17 times)" not in diagram.mermaid(job.usual_phases())


def test_a_table_that_cannot_be_run_is_refused():
    table = job.usual_phases()
    table.rows = table.rows[:-1]
    with pytest.raises(kr5.InvalidArgument, match="^rows: found 11, expected one a phase: 12$"):
        table.validate()


def test_the_journal_of_another_job_is_refused(stopped):
    assert job.journal_job(stopped) == "monday"
    with pytest.raises(kr5.IoError, match="belongs to the job 'monday', expected 'tuesday'"):
        job.Journal(stopped, "tuesday")


def test_a_stop_stays_until_a_person_is_named(stopped):
    reading = robot.RobotReading(status=robot.RobotStatus(gripped=False))
    journal = job.Journal(stopped, "monday")
    measured = job.RestartMeasurements(reading=reading, station=False, tube=1)
    assert job.decide_restart(journal.belief(), measured).status == job.RestartStatus.Latched
    with pytest.raises(kr5.InvalidArgument, match="name the person"):
        journal.release("")
    journal.release("Ada")
    decision = job.decide_restart(journal.belief(), measured)
    assert (str(decision.status), str(decision.phase), decision.inserted) == ("continue", "scan", 1)


def test_a_supervisor_asks_and_goes_on(tmp_path):
    down = np.diag([1.0, -1.0, -1.0, 1.0])
    down[:3, 3] = [0.4, 0, 0.3]
    places = job.JobPlaces(T_base_scan=down, T_base_scan_end=down)
    options = job.JobOptions(places=places)
    options.insertion = kr5.force.InsertionOptions(
        bodies=kr5.force.PegTube(peg_radius=0.008, inner_radius=0.0083, outer_radius=0.012)
    )
    journal = job.Journal(tmp_path / "job.db", "a")
    reading = robot.RobotReading(T_base_tool=down, status=robot.RobotStatus(gripped=False))
    supervisor = job.Supervisor(options, job.RestartDecision(), journal)
    for k in range(500):
        command = step(supervisor, reading, k)
        if k == 0:
            assert np.array_equal(command.tool, down)
        if supervisor.request.kind == job.RequestKind.Scan:
            break
    assert not supervisor.deliver_scan(supervisor.request.stamp - 1, [], True)
    assert supervisor.deliver_scan(supervisor.request.stamp, [], True)
    step(supervisor, reading, k + 1)
    step(supervisor, reading, k + 2)
    assert supervisor.finished and supervisor.state.phase == job.Phase.Done
    assert [str(r.phase) for r in journal.records()] == ["check_cell", "scan", "done"]


def step(supervisor, reading, k):
    reading.time, reading.sensor = 0.012 * k, [0.01 * k, 0, 0, 0, 0, 0]
    command = supervisor.step(reading)
    reading.T_base_tool = command.tool
    return command


def test_phases_of_the_command(run_kr5, tmp_path):
    done = run_kr5("job", "phases", "--json", "phases.json")
    assert done.returncode == 0 and done.stdout.startswith("stateDiagram-v2\n")
    assert len(json.loads((tmp_path / "phases.json").read_text())["rows"]) == 12
    assert run_kr5("job", "phases", "--form", "graphviz", "-o", "phases.dot").returncode == 0
    assert (tmp_path / "phases.dot").read_text().startswith("digraph job {")


def test_journal_of_the_command(run_kr5, stopped):
    done = run_kr5("job", "show", stopped, "--json", "-")
    assert done.returncode == 0, done.stderr
    data = json.loads(done.stdout)
    assert data["belief"]["inserted"] == 1 and data["statistics"]["attempts"][0]["inserted"] == 1
    assert "1 inserted of 2 tried; phase pick, pellet 2. Stopped by force" in " ".join(done.stderr.split())
    assert run_kr5("job", "release", stopped, "--person", " ").returncode == 2
    assert run_kr5("job", "release", stopped, "--person", "Ada").returncode == 0
    again = run_kr5("job", "release", stopped, "--person", "Ada")
    assert again.returncode == 2 and "there is no stop to release" in again.stderr


def test_a_file_that_is_no_journal_is_named(run_kr5, tmp_path):
    (tmp_path / "text.db").write_text("x" * 2000)
    for name, problem in (("text.db", "is no journal of a job"), ("none.db", "is not there")):
        done = run_kr5("job", "show", name)
        assert done.returncode == 2 and name in done.stderr and problem in " ".join(done.stderr.split())
    assert not (tmp_path / "none.db").exists()
