"""Servos diagnosed from commands and positions: MuJoCo arms through `kr5 gap diagnose LOG --model MODEL` with the
options that a user gets by default, and what MuJoCo leaves with the written model in a fresh log.

    python tools/benchmarks/servos.py [--arms N] [--reference FOLDER] [--cache FOLDER]

Arms of 4, 6 and 7 joints, at 50 and 100 Hz, encoders of 4096 steps, a third with efforts; one effect each, two in one
of four, none in one of five. Every arm has a seed of its own, made of the commit, so that no arm was seen before.
Answers are kept in the cache by commit and seed: a bench that was stopped goes on where it stopped.
"""

import hashlib
import json
import shutil
import subprocess
import tempfile
import time
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

import arguments
import case_logs
import servo_logs
from comparison import Row, exact_interval, format_rate, print_comparisons, progress
from gap_command import Answer, run_gap

ROOT = Path(__file__).resolve().parents[2]
ARMS = 60
DURATION = 60.0  # of a log [s]
FRESH_LIMIT = 1.1  # of the error in a fresh log, over the noise of the encoders
SO101 = "data/servo_so101_sage"


@dataclass
class Trial:
    """An arm, and what was found."""

    seed: int
    joints: int
    rate: float
    efforts: bool
    truth: list[list[str]]  # effects and their targets
    refusal: str
    verdict: str
    causes: list[list[str]]
    most_probable: list[str]
    seconds: float
    fresh: float  # RMS in a fresh log over the noise, MuJoCo with the written model
    nominal: float  # with the model that was given
    true: float  # with the model of the arm itself


def commit() -> str:
    done = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True)
    return done.stdout.strip() or "no-commit"


def seed_of(text: str) -> int:
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:6], "big")


def diagnose_arm(seed: int) -> Trial:
    random = np.random.default_rng(seed)
    joints = int(random.choice(list(servo_logs.AXES)))
    rate, efforts = float(random.choice([50.0, 100.0])), bool(random.uniform() < 1 / 3)
    nominal = servo_logs.drawn_arm(random, servo_logs.AXES[joints])
    count = int(random.choice([0, 1, 2], p=[0.2, 0.55, 0.25]))
    commands = [servo_logs.planned(random, joints, DURATION, rate) for _ in range(2)]
    true, truth = nominal, []
    for kind in random.choice(servo_logs.KINDS, count, replace=False):
        true, effect = servo_logs.with_effect(true, str(kind), random, commands[0], rate)
        truth.append([effect.effect, effect.target])
    log, fresh = (servo_logs.simulated_log(true.xml(), command, rate, true.delay) for command in commands)
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        (folder / "nominal.xml").write_text(nominal.xml())
        (folder / "true.xml").write_text(true.xml())
        case_logs.write_csv(folder / "log.csv", log.columns(random, efforts))
        answer = run_gap("diagnose", folder, "log.csv", "--model", "nominal.xml", "--write-model", "tuned.xml")
        tuned = folder / ("tuned.xml" if (folder / "tuned.xml").is_file() else "nominal.xml")
        left = [
            servo_logs.left_over(file, fresh, delay)
            for file, delay in (
                (tuned, found_delay(answer)),
                (folder / "nominal.xml", 0.0),
                (folder / "true.xml", true.delay),
            )
        ]
    found = [[c["effect"], c["target"]] for c in answer.data.get("causes", [])]
    return Trial(
        seed,
        joints,
        rate,
        efforts,
        truth,
        answer.refusal,
        answer.data.get("verdict", ""),
        found,
        found[0] if found else [],
        answer.seconds,
        *left,
    )


def found_delay(answer: Answer) -> float:
    """Of the commands, which no MJCF holds [s]."""
    for cause in answer.data.get("causes", []):
        if cause["effect"] == "joint_delay":
            (value,) = (p["value"] for p in cause["parameters"] if p["name"] == "delay")
            return float(np.ravel(value)[0])
    return 0.0


def cached(file: Path, seed: int) -> Trial:
    """The answer of an arm, kept in a file of lines."""
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    for line in lines:
        if (data := json.loads(line))["seed"] == seed:
            return Trial(**data)
    out = diagnose_arm(seed)
    with file.open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(asdict(out)) + "\n")
    return out


def rate_row(what: str, hits: int, trials: int, least: float, misses: str = "") -> Row:
    """A rate whose exact interval must lie above what is wanted."""
    return Row(
        what,
        f"{hits} of {trials}" + (f" ({misses})" if misses else ""),
        f"lower end ≥ {least:.2f}",
        trials > 0 and exact_interval(hits, trials)[0] >= least,
        interval=format_rate(hits, trials) if trials else "–",
    )


def told(trials: list[Trial]) -> str:
    """What was said in place of the truth, the most frequent first."""
    words = Counter(
        f"{'+'.join('.'.join(t) for t in x.truth) or 'sound'}: "
        + (x.refusal or f"{x.verdict} {'+'.join('.'.join(c) for c in x.causes)}".strip())
        for x in trials
    )
    return "; ".join(f"{text}{f' ×{n}' if n > 1 else ''}" for text, n in words.most_common())


def rows_of(trials: list[Trial]) -> list[Row]:
    one, two, sound = ([x for x in trials if len(x.truth) == n] for n in (1, 2, 0))
    first = [x for x in one if x.most_probable in x.truth]
    both = [(x, t) for x in two for t in x.truth]
    named = [(x, t) for x, t in both if t in x.causes]
    right = [x for x in sound if x.verdict == "no_gap" and not x.causes]
    told_rows = [
        rate_row("one effect: named first", len(first), len(one), 0.95, told([x for x in one if x not in first])),
        rate_row("two effects: each named", len(named), len(both), 0.85, told([x for x in two if missed(x)])),
        rate_row("sound called sound", len(right), len(sound), 0.95, told([x for x in sound if x not in right])),
    ]
    fresh = np.array([x.fresh for x in trials])
    within = int((fresh <= FRESH_LIMIT).sum())
    nominal, true = (np.median([getattr(x, key) for x in trials]) for key in ("nominal", "true"))
    seconds = np.array([x.seconds for x in trials])
    return [
        *told_rows,
        Row(
            "written XML in MuJoCo on a fresh log: RMS of the positions over the noise of the encoders",
            f"{within} of {len(trials)} ≤ {FRESH_LIMIT}; median {np.median(fresh):.2f}, worst {fresh.max():.2f}",
            "≥ 0.90 of them",
            within >= 0.9 * len(trials),
            f"XML given {nominal:.3g}, true XML {true:.3g} (medians)",
            format_rate(within, len(trials)),
        ),
        Row(
            f"whole command, {DURATION:.0f} s of log [s]",
            f"median {np.median(seconds):.0f}, longest {seconds.max():.0f}",
            "≤ 10",
            bool(seconds.max() <= 10),
        ),
    ]


def missed(trial: Trial) -> bool:
    return any(t not in trial.causes for t in trial.truth)


def so101_rows(folder: Path) -> list[Row]:
    """The real arm: four motions are fitted, the rest is judged, from the model as its maker publishes it."""
    what = "SO-101: 4 of 12 motions fitted, position error on the other 8, written XML beside the given one"
    motions = sorted(p for p in folder.iterdir() if (p / "control.csv").is_file()) if folder.is_dir() else []
    if not motions:
        return []
    model = next(folder.rglob("so101_new_calib.xml"))
    with tempfile.TemporaryDirectory() as made:
        place = Path(made)
        shutil.copy(model, place / "nominal.xml")
        answer = run_gap("diagnose", place, *motions[:4], "--model", "nominal.xml", "--write-model", "tuned.xml")
    if answer.code != 0 or "mujoco" not in answer.data:
        return [Row(what, f"refused: {answer.refusal or 'no model written'}", "≥ 1.9 times lower", False)]
    check: dict[str, Any] = answer.data["mujoco"]
    before, after = (float(np.sqrt(np.mean(np.square(check[key])))) for key in ("before", "after"))
    ratio = before / after
    causes = ", ".join(f"{e} {t}" for e, t in answer.causes)
    return [Row(what, f"{ratio:.2f} times lower ({answer.data['verdict']}: {causes})", "≥ 1.9", ratio >= 1.9)]


def main() -> None:
    parser = arguments.parser(__doc__, reference=True)
    parser.add_argument("--arms", type=int, default=ARMS, help="how many are drawn")
    parser.add_argument("--cache", type=Path, default=ROOT / "build/bench", help="folder of answers by commit")
    given = parser.parse_args()
    given.cache.mkdir(parents=True, exist_ok=True)
    at, start = commit(), time.monotonic()
    seeds = [seed_of(f"{at} {k}") for k in range(given.arms)]
    file = given.cache / f"servos-{at[:12]}.jsonl"
    trials = [cached(file, seed) for seed in progress(seeds, "Servo arms")]
    print(f"{len(trials)} arms of commit {at[:12]} in {time.monotonic() - start:.0f} s; answers: {file}")
    rows = rows_of(trials)
    print_comparisons([*rows, *so101_rows(given.reference / SO101)], "Servos, from commands and positions")


if __name__ == "__main__":
    main()
