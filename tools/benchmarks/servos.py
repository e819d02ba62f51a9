"""Servos diagnosed from commands and positions: MuJoCo arms through `kr5 gap diagnose LOG --model MODEL` with the
options that a user gets by default, and what MuJoCo leaves with the written model in a fresh log; then public logs.

    python tools/benchmarks/servos.py [--arms N] [--kinds KIND ...] [--motions N] [--reference FOLDER] [--cache FOLDER]

Arms of 4, 6 and 7 joints, at 50 and 100 Hz, encoders of 4096 steps, a third with efforts; one effect each, two in one
of four, none in one of five; in one of seven something that no effect of the catalogue describes. Every arm has a
seed of its own, made of the commit, so that no arm was seen before. Answers are kept in the cache by commit and seed: a
bench that was stopped goes on where it stopped.
"""

import hashlib
import json
import subprocess
import tempfile
import time
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

import arguments
import case_logs
import servo_logs
from comparison import Row, exact_interval, format_rate, print_comparisons, progress
from gap_command import run_gap
from servos_public import PENDULUM, SO101, found_delay, pendulum_rows, so101_rows

ROOT = Path(__file__).resolve().parents[2]
ARMS = 60
DURATION = 60.0  # of a log [s]
FRESH_LIMIT = 1.1  # of the error in a fresh log, over the noise of the encoders
OUTSIDE_SHARE = 1 / 7  # of arms with something that no effect describes


@dataclass
class Trial:
    """An arm, and what was found."""

    seed: int
    joints: int
    rate: float
    efforts: bool
    truth: list[list[str]]  # effects and their targets
    outside: str  # what no effect describes
    refusal: str
    verdict: str
    causes: list[list[str]]
    most_probable: list[str]
    seconds: float
    fresh: float  # RMS in a fresh log over the noise, MuJoCo with the written model
    nominal: float  # with the model that was given
    true: float  # with the model of the arm itself
    memory: float  # [GiB]

    @property
    def is_in_mjcf(self) -> bool:
        """Whether an MJCF can hold what the arm has."""
        return not self.outside and all(effect in servo_logs.IN_MJCF for effect, _ in self.truth)


def commit() -> str:
    done = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True)
    return done.stdout.strip() or "no-commit"


def seed_of(text: str) -> int:
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:6], "big")


def drawn_kinds(random: np.random.Generator, kinds: list[str]) -> list[str]:
    """What an arm has that its model lacks. kinds: alone, where they are given."""
    if kinds:
        return [str(random.choice(kinds))]
    if random.uniform() < OUTSIDE_SHARE:
        return [str(random.choice(list(servo_logs.OUTSIDE)))]
    count = int(random.choice([0, 1, 2], p=[0.2, 0.55, 0.25]))
    return [str(kind) for kind in random.choice(servo_logs.KINDS, count, replace=False)]


def diagnose_arm(seed: int, kinds: list[str]) -> Trial:
    random = np.random.default_rng(seed)
    joints = int(random.choice(list(servo_logs.AXES)))
    rate, efforts = float(random.choice([50.0, 100.0])), bool(random.uniform() < 1 / 3)
    nominal = servo_logs.drawn_arm(random, servo_logs.AXES[joints])
    commands = [servo_logs.planned(random, joints, DURATION, rate) for _ in range(2)]
    true, effects = nominal, []
    for kind in drawn_kinds(random, kinds):
        true, effect = servo_logs.with_effect(true, kind, random, commands[0], rate)
        effects.append(effect)
    log, fresh = (servo_logs.simulated_log(true.xml(), c, rate, true.delay, true.forces) for c in commands)
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        (folder / "nominal.xml").write_text(nominal.xml())
        (folder / "true.xml").write_text(true.xml())
        case_logs.write_csv(folder / "log.csv", log.columns(random, efforts))
        answer = run_gap("diagnose", folder, "log.csv", "--model", "nominal.xml", "--write-model", "tuned.xml")
        tuned = folder / ("tuned.xml" if (folder / "tuned.xml").is_file() else "nominal.xml")
        delays = {tuned: found_delay(answer), folder / "nominal.xml": 0.0, folder / "true.xml": true.delay}
        files = (tuned, folder / "nominal.xml", folder / "true.xml")
        of_tuned, of_nominal, of_true = (servo_logs.left_over(file, fresh, delays[file]) for file in files)
    found = [[c["effect"], c["target"]] for c in answer.data.get("causes", [])]
    return Trial(
        seed,
        joints,
        rate,
        efforts,
        [[e.effect, e.target] for e in effects if e.effect not in servo_logs.OUTSIDE],
        next((e.effect for e in effects if e.effect in servo_logs.OUTSIDE), ""),
        answer.refusal,
        answer.data.get("verdict", ""),
        found,
        found[0] if found else [],
        answer.seconds,
        of_tuned,
        of_nominal,
        of_true,
        answer.memory,
    )


def cached(file: Path, seed: int, kinds: list[str]) -> Trial:
    """The answer of an arm, kept in a file of lines."""
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    for line in lines:
        if (data := json.loads(line))["seed"] == seed:
            return Trial(**data)
    out = diagnose_arm(seed, kinds)
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
        f"{'+'.join('.'.join(t) for t in x.truth) or x.outside or 'sound'}: "
        + (x.refusal or f"{x.verdict} {'+'.join('.'.join(c) for c in x.causes)}".strip())
        for x in trials
    )
    return "; ".join(f"{text}{f' ×{n}' if n > 1 else ''}" for text, n in words.most_common())


def rows_of(trials: list[Trial]) -> list[Row]:
    inside = [x for x in trials if not x.outside]
    return [*told_rows(inside), outside_row([x for x in trials if x.outside]), *left_rows(inside), *cost_rows(trials)]


def told_rows(trials: list[Trial]) -> list[Row]:
    """Of arms whose effects are in the catalogue."""
    one, two, sound = ([x for x in trials if len(x.truth) == n] for n in (1, 2, 0))
    first = [x for x in one if x.most_probable in x.truth]
    both = [(x, t) for x in two for t in x.truth]
    named = [(x, t) for x, t in both if t in x.causes]
    right = [x for x in sound if x.verdict == "no_gap" and not x.causes]
    return [
        rate_row("one effect: named first", len(first), len(one), 0.95, told([x for x in one if x not in first])),
        rate_row("two effects: each named", len(named), len(both), 0.85, told([x for x in two if missed(x)])),
        rate_row("sound called sound", len(right), len(sound), 0.95, told([x for x in sound if x not in right])),
    ]


def outside_row(trials: list[Trial]) -> Row:
    explained = [x for x in trials if x.verdict == "explained"]
    words = f" ({told(explained)})" if explained else f" ({told(trials)})" if trials else ""
    return Row(
        f"outside the catalogue ({', '.join(servo_logs.OUTSIDE)}): called explained",
        f"{len(explained)} of {len(trials)}{words}",
        "0",
        bool(trials) and not explained,
        interval=format_rate(len(explained), len(trials)) if trials else "–",
    )


def left_rows(trials: list[Trial]) -> list[Row]:
    """What MuJoCo leaves with the written model, of effects that an MJCF holds; the others are told beside."""
    what = (
        "written XML in MuJoCo on a fresh log: RMS of the positions over the noise of the encoders, effects of an MJCF"
    )
    held, others = ([x for x in trials if x.is_in_mjcf == own] for own in (True, False))
    if not held:
        return [Row(what, "no such arm", "≥ 0.90 of them", False)]
    fresh = np.array([x.fresh for x in held])
    within = int((fresh <= FRESH_LIMIT).sum())
    nominal, true = (np.median([getattr(x, key) for x in held]) for key in ("nominal", "true"))
    beside = f"; of others median {np.median([x.fresh for x in others]):.3g}" if others else ""
    return [
        Row(
            what,
            f"{within} of {len(held)} ≤ {FRESH_LIMIT}; median {np.median(fresh):.2f}, worst {fresh.max():.2f}{beside}",
            "≥ 0.90 of them",
            within >= 0.9 * len(held),
            f"XML given {nominal:.3g}, true XML {true:.3g} (medians)",
            format_rate(within, len(held)),
        )
    ]


def cost_rows(trials: list[Trial]) -> list[Row]:
    out = []
    for what, key, most in (("time [s]", "seconds", 10.0), ("memory [GiB]", "memory", 1.0)):
        values = np.array([getattr(x, key) for x in trials])
        text = f"median {np.median(values):.2g}, most {values.max():.2g}"
        out.append(Row(f"whole command, {DURATION:.0f} s of log: {what}", text, f"≤ {most:g}", values.max() <= most))
    return out


def missed(trial: Trial) -> bool:
    return any(t not in trial.causes for t in trial.truth)


def main() -> None:
    parser = arguments.parser(__doc__, reference=True)
    parser.add_argument("--arms", type=int, default=ARMS, help="how many are drawn")
    parser.add_argument("--kinds", nargs="+", default=[], choices=[*servo_logs.KINDS, *servo_logs.OUTSIDE])
    parser.add_argument("--motions", type=int, help="of the SO-101, where not all 12 are wanted; 0: none of the logs")
    parser.add_argument("--cache", type=Path, default=ROOT / "build/bench", help="folder of answers by commit")
    given = parser.parse_args()
    given.cache.mkdir(parents=True, exist_ok=True)
    at, start = commit(), time.monotonic()
    seeds = [seed_of(f"{at} {k}") for k in range(given.arms)]
    file = given.cache / "-".join(["servos", at[:12], *sorted(given.kinds)])
    file = file.with_name(f"{file.name}.jsonl")
    trials = [cached(file, seed, given.kinds) for seed in progress(seeds, "Servo arms")]
    print(f"{len(trials)} arms of commit {at[:12]} in {time.monotonic() - start:.0f} s; answers: {file}")
    rows = rows_of(trials)
    if given.motions != 0:
        rows += [*so101_rows(given.reference / SO101, given.motions), *pendulum_rows(given.reference / PENDULUM)]
    print_comparisons(rows, "Servos, from commands and positions")


if __name__ == "__main__":
    main()
