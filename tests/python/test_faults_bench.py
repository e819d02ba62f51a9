"""The bench of faults: what its rows count, and trials of faults through the real chain."""

import dataclasses
import json
import random
import socket
import sys

import pytest
from kr5 import rsi

from conftest import ROOT

work = pytest.importorskip("kr5.work", reason="this kr5 was built without DART, ViSP, PCL or SQLite")

sys.path[:0] = [str(ROOT / "tools/benchmarks")]
import fault_plans
import fault_trials
import faults as bench
import telegram_way

REACHED = fault_plans.Reached(4.0, 20.0, 0.5, [5.0] * 6, 0.1, 0.2, 3.0)
STOPPED = {"ended": "stopped", "reason": "lost_link", "held": True, "resumed": True, "max_force": 21.5}


@pytest.fixture(scope="module")
def insertion(tmp_path_factory):
    return fault_trials.Insertion(bench.CELL, 5, tmp_path_factory.mktemp("faults"))


def test_a_row_counts_how_trials_ended_and_every_harm():
    trials = [fault_trials.Trial("lost", 0, max_force=20.0), fault_trials.Trial("lost", 1, **STOPPED)]
    row = bench.fault_row("lost", trials)
    assert row.reached and row.what == "lost, 2 insertions"
    assert row.ours == "1 went on; 1 stopped (lost link 1); 1 done after release; peak 21.5 N"
    for harm in ("moving", "over_limit", "astray"):
        row = bench.fault_row("lost", [*trials, fault_trials.Trial("lost", 2, **STOPPED, **{harm: True})])
        assert not row.reached and row.interval.startswith("2 of 3"), harm
    for harm in ({"held": False}, {"resumed": False}, {"unharmed": False}, {"ended": "hung"}):
        assert not bench.fault_row("lost", [fault_trials.Trial("lost", 0, **{**STOPPED, **harm})]).reached


def test_every_fault_draws_the_same_plan_again():
    for name, fault in fault_plans.FAULTS.items():
        plans = [fault(REACHED, random.Random(name)) for _ in range(2)]
        first, second = ({**vars(plan), "act": None, "after_kill": None} for plan in plans)
        assert first == second and 0 <= plans[0].instant <= REACHED.duration, name


def test_trials_that_were_kept_are_not_repeated(tmp_path, monkeypatch):
    keep = tmp_path / "kept.jsonl"
    kept = [fault_trials.Trial("lost", k, **STOPPED) for k in range(3)]
    keep.write_text("".join(json.dumps(dataclasses.asdict(trial)) + "\n" for trial in kept))
    monkeypatch.setattr(bench, "begin", None)  # no process begins
    assert bench.run_trials(["lost"], 3, 1, 1, keep) == kept


@pytest.mark.parametrize("fault", ["stop by the operator", "database of another job", "full disk", "lost"])
def test_faults_through_the_real_chain_do_no_harm(insertion, fault):
    trial = insertion.try_fault(fault, 1)
    assert trial.sound(), trial
    said = {"stop by the operator": "operator", "database of another job": "belongs to the job", "full disk": "journal"}
    assert said.get(fault, "") in trial.reason, trial


def test_datagrams_pass_are_changed_and_answered_to_their_sender():
    with (
        telegram_way.TelegramWay() as way,
        socket.socket(type=socket.SOCK_DGRAM) as controller,
        socket.socket(type=socket.SOCK_DGRAM) as link,
    ):
        link.bind((telegram_way.HERE, way.port))
        for end in (controller, link):
            end.settimeout(10)
        controller.sendto(b"one", (telegram_way.THERE, way.controller_port))
        data, sender = link.recvfrom(100)
        assert data == b"one"
        link.sendto(b"answer", sender)
        assert controller.recvfrom(100) == (b"answer", (telegram_way.THERE, way.controller_port))
        way.telegrams = lambda data: [data.upper(), b"more"]
        controller.sendto(b"two", (telegram_way.THERE, way.controller_port))
        assert [link.recv(100) for _ in range(2)] == [b"TWO", b"more"]
        way.faults["telegrams"] = rsi.FaultyWay(rsi.LinkFaults(doubled=1.0))
        way.telegrams = telegram_way.unchanged
        controller.sendto(b"twice", (telegram_way.THERE, way.controller_port))
        assert [link.recv(100) for _ in range(2)] == [b"twice", b"twice"]
        way.to_link(b"stranger")
        assert link.recvfrom(100)[1][0] == telegram_way.ELSEWHERE
