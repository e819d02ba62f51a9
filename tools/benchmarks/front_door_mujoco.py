"""MuJoCo arms with an effect that their MJCF lacks: a CSV and the MJCF in, the tuned MJCF out, and how well MuJoCo
predicts another motion with it."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import case_logs
import mujoco_logs
from comparison import Row, format_rate, progress
from gap_command import Answer, run_gap

FRESH_GAP = 1.05  # of a fresh log under the tuned model, over its noise
FIRST_SEED = 101  # seeds below were seen while developing
OTHER_MOTION = 1000  # added to the seed of an arm for its other motion


@dataclass
class Arm:
    """An arm, its diagnosis, and the gaps that models leave in a fresh log of it, over the noise [-]."""

    effect: mujoco_logs.Effect
    answer: Answer
    nominal: float
    tuned: float
    true: float

    @property
    def named(self) -> bool:
        target = "tool" if self.effect.effect == "payload" else f"joint{self.effect.joint + 1}"
        return self.answer.causes == [(self.effect.effect, target)]


def tune_arm(seed: int, folder: Path) -> Arm:
    effect = mujoco_logs.drawn_effect(seed)
    true = mujoco_logs.model_xml(effect)
    (folder / "nominal.xml").write_text(mujoco_logs.model_xml())
    (folder / "true.xml").write_text(true)
    case_logs.write_csv(folder / "log.csv", mujoco_logs.simulated_log(true, seed).columns(seed))
    answer = run_gap("diagnose", folder, "log.csv", "--model", "nominal.xml", "--write-model", "tuned.xml")
    fresh = mujoco_logs.simulated_log(true, OTHER_MOTION + seed)
    tuned = folder / ("tuned.xml" if answer.code == 0 else "nominal.xml")
    gaps = [mujoco_logs.prediction_gap(file, fresh) for file in (folder / "nominal.xml", tuned, folder / "true.xml")]
    return Arm(effect, answer, *gaps)


def compare_mujoco(quick: bool) -> list[Row]:
    arms: dict[int, Arm] = {}
    for seed in progress(range(FIRST_SEED, FIRST_SEED + (2 if quick else 10)), "MuJoCo arms"):
        with tempfile.TemporaryDirectory() as folder:
            arms[seed] = tune_arm(seed, Path(folder))
    tuned, nominal, true = (np.array([getattr(a, key) for a in arms.values()]) for key in ("tuned", "nominal", "true"))
    within, named = int((tuned <= FRESH_GAP).sum()), sum(a.named for a in arms.values())
    other = "; ".join(
        f"seed {seed}, {a.effect.effect} joint {a.effect.joint + 1}: {a.answer.data.get('verdict', a.answer.refusal)}"
        f" {a.answer.causes or ''}".rstrip()
        for seed, a in arms.items()
        if not a.named
    )
    seconds = np.median([a.answer.seconds for a in arms.values()])
    return [
        Row(
            f"{len(arms)} MuJoCo arms, effect withheld, CSV and XML in, XML out: MuJoCo with the new XML on a fresh"
            " log, gap over noise",
            f"median {np.median(tuned):.3f}, worst {tuned.max():.3f} ({seconds:.0f} s a diagnosis)",
            f"≤ {FRESH_GAP}",
            within == len(arms),
            f"XML given {np.median(nominal):.3g} (median), true XML {np.median(true):.3f}",
            format_rate(within, len(arms)),
            "MuJoCo",
        ),
        Row(
            f"{len(arms)} MuJoCo arms: the withheld effect is named, and nothing else",
            f"{named}" + (f" ({other})" if other else ""),
            f"{len(arms)}",
            named == len(arms),
            interval=format_rate(named, len(arms)),
            figure="MuJoCo",
        ),
    ]
