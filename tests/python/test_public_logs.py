"""Public logs of real arms are read by one command; the bench front_door judges what is found in them."""

import sys

import numpy as np
import pytest
from kr5.logs import diagnose_logs, read_logs

from conftest import ROOT

sys.path.insert(0, str(ROOT / "tools/benchmarks"))

from front_door_public import PUBLIC, cut_log, model_file


@pytest.mark.parametrize("log", PUBLIC, ids=lambda log: log.name)
def test_a_public_log_fits_the_published_model_of_its_arm(reference, tmp_path, log):
    data = reference / "data"
    model = model_file(log, data, tmp_path)
    options = dict(zip(words := [*log.of_model, *log.of_log], words[1:]))
    every = float(options["--every"]) if "--every" in options else None
    settings = [value for option, value in zip(words, words[1:]) if option == "--set"]
    first, _ = cut_log(log, data, tmp_path)
    found = read_logs(
        first, model, base=options.get("--base", ""), tip=options.get("--tip", ""), every=every, settings=settings
    )
    joints = [f"qc{k + 1}" for k in range(len(found.recording.cell.nominal_chain().joints))]
    limits = found.recording.cell.robot.limits
    for experiment in found.recording.experiments:
        q = np.column_stack([experiment[name] for name in joints])
        assert len(q) > 100 and np.ptp(q, axis=0).max() > 0.05  # it moves
        if limits:  # of the model: another unit, sign or order of the joints would leave them
            assert (q > np.array(limits.lower) - 0.1).all() and (q < np.array(limits.upper) + 0.1).all()


def test_friction_that_grows_with_the_load_is_named_in_a_public_servo_from_two_gains(reference):
    folder = reference / "data" / "servo_xl330_bam"
    if not folder.is_dir():
        pytest.skip(f"no public data: {folder}")
    files = sorted(folder.glob("*.json"))
    judged = ",".join(file.name for file in files[4:])  # of four times the gain
    settings = ["cell.servo.cycle=0.02", "cell.servo.torque={stiffness: 20, damping: 1}"]
    found = diagnose_logs(files, folder / "pendulum.urdf", check=judged, settings=settings)
    causes = {cause.effect for cause in found.causes}
    assert {"servo_stiffness", "servo_damping", "load_friction"} <= causes
    assert "stribeck_friction" not in causes
