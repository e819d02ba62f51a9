"""Lets the command under test diagnose every recording; picks up where it stopped."""

import json
import os
import shlex
import subprocess
import sys
import time
from pathlib import Path

from .job_pool import run_jobs
from .recording import read_json

KR5 = f"{shlex.quote(sys.executable)} -m kr5_tools"
DIAGNOSE = KR5 + " gap diagnose {recording} --json {json} --write-cell {cell}"
MEASURE = KR5 + " gap measure {recording} --cell {cell} --json {json}"
DONE = "run.json"


def run_command(command: str, limit: float, log: Path, **words: Path) -> dict:
    """Runs one command; how long it took, how much memory, how it ended."""
    argv = [part.format(**{k: str(v) for k, v in words.items()}) for part in shlex.split(command)]
    start = time.monotonic()
    with log.open("w") as file:
        child = subprocess.Popen(argv, stdout=file, stderr=subprocess.STDOUT)
        while True:
            pid, status, usage = os.wait4(child.pid, os.WNOHANG)
            if pid:
                break
            if time.monotonic() - start > limit:
                child.kill()
            time.sleep(0.02)
    child.returncode = os.waitstatus_to_exitcode(status)
    return {
        "code": child.returncode,
        "seconds": time.monotonic() - start,
        "cpu": usage.ru_utime + usage.ru_stime,
        "memory": usage.ru_maxrss * 1024,
    }


def diagnose_one(recording: Path, fresh: Path, out: Path, command: str, measure: str, limit: float) -> dict:
    """Diagnoses one recording, then measures the cell it wrote on a fresh recording."""
    out.mkdir(parents=True, exist_ok=True)
    cell = out / "cell.yaml"
    done = run_command(
        command, limit, out / "diagnose.log", recording=recording, json=out / "diagnosis.json", cell=cell
    )
    if done["code"] == 0 and cell.exists() and fresh.exists() and measure:
        for name, which in (("before", fresh / "cell.yaml"), ("after", cell)):
            run_command(measure, limit, out / f"{name}.log", recording=fresh, json=out / f"{name}.json", cell=which)
    (out / DONE).write_text(json.dumps(done))
    return done


def diagnose_all(
    folder: Path, out: Path, command=DIAGNOSE, measure=MEASURE, jobs=None, scheduler=None, limit=600.0, again=False
) -> int:
    """Diagnoses what is not diagnosed yet, or failed; how many fail."""
    names = sorted(p.name for p in (folder / "recordings").iterdir() if (p / "recording.yaml").exists())
    if not names:
        raise FileNotFoundError(
            f"{folder / 'recordings'}: no recording there; run `python -m blind_check generate` first"
        )
    todo = [n for n in names if again or (read_json(out / n / DONE) or {"code": -1})["code"] != 0]
    calls = [(folder / "recordings" / n, folder / "fresh" / n, out / n, command, measure, limit) for n in todo]
    run_jobs(diagnose_one, calls, "diagnosing", jobs, scheduler)
    return sum(json.loads((out / n / DONE).read_text())["code"] != 0 for n in names)
