"""Kinematics and dynamics of the KR5 beside Pinocchio: agreement, and time a call in this process.

    python tools/bench/dynamics.py [--postures 1000000]

kr5 takes all rows in one call, as Pinocchio's Python interface cannot; per-call times of Pinocchio from Python hold the
cost of that call, so its C++ time (0.58 us, measured once on a quiet machine of this kind) stands beside it.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import pinocchio as pin

import judge

from kr5.cell import load_cell
from kr5.kinematics import Body, Dynamics

CELL = Path(__file__).resolve().parents[2] / "share/cells/kr5_arc.yaml"
PINOCCHIO_CPP = 0.58e-6  # s


def row_transform(row, q: float) -> np.ndarray:
    c, s = np.cos(q + row.theta_offset), np.sin(q + row.theta_offset)
    ca, sa = np.cos(row.alpha), np.sin(row.alpha)
    return np.array([[c, -s * ca, s * sa, row.a * c], [s, c * ca, -c * sa, row.a * s], [0, sa, ca, row.b], [0, 0, 0, 1]])


def flange_by_loop(rows, q: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    for row, angle in zip(rows, q):
        T = T @ row_transform(row, angle)
    return T


def pinocchio_model(cell) -> pin.Model:
    model, parent, place = pin.Model(), 0, pin.SE3.Identity()
    for i, (row, link) in enumerate(zip(cell.robot.dh, cell.robot.links)):
        joint = model.addJoint(parent, pin.JointModelRZ(), place, f"j{i}")
        at = pin.SE3(row_transform(row, 0.0))
        model.appendBodyToJoint(joint, pin.Inertia(link.mass, np.array(link.com), link.inertia_matrix()), at)
        parent, place = joint, at
    model.gravity.linear = np.array(cell.robot.gravity)
    return model


def best(run, repeat: int = 7) -> float:
    """Least processor time of several runs: the machine may be busy with others."""
    times = []
    for _ in range(repeat):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--postures", type=int, default=1_000_000)
    count = parser.parse_args().postures
    cell = load_cell(CELL)
    chain, rows = cell.chain(), cell.robot.dh
    random = np.random.default_rng(1)
    q = random.uniform(-3, 3, (count, 6))

    sample = q[: min(count, 5000)]
    loop = best(lambda: [flange_by_loop(rows, v) for v in sample], 3) / len(sample)
    batch = best(lambda: chain.flanges(q), 5) / count
    worst = max(np.abs(flange_by_loop(rows, v) - T).max() for v, T in zip(sample, chain.flanges(sample)))
    lines = [
        judge.Line(f"flange of {count} postures", f"{batch * 1e6:.2f} us each", "20 times as fast", loop >= 20 * batch,
                   f"Python loop {loop * 1e6:.1f} us, {loop / batch:.0f} times"),
        judge.Line("its largest difference", f"{worst:.1e}", "1e-10", worst <= 1e-10, "Python loop")]

    n = min(count, 50_000)
    q, qd, qdd = q[:n], random.uniform(-2, 2, (n, 6)), random.uniform(-5, 5, (n, 6))
    arm = Dynamics(chain, [Body(**link.to_dict()) for link in cell.robot.links], cell.robot.gravity)
    model = pinocchio_model(cell)
    data = model.createData()
    ours = best(lambda: arm.loads(q, qd, qdd)) / n
    theirs = best(lambda: [pin.rnea(model, data, *v) for v in zip(q, qd, qdd)], 3) / n
    tau = arm.loads(q, qd, qdd)[0]
    worst = max(np.abs(pin.rnea(model, data, *v) - t).max() for *v, t in zip(q[:2000], qd, qdd, tau))
    lines += [
        judge.Line("inverse dynamics, a row", f"{ours * 1e6:.2f} us", "no slower than Pinocchio in C++", ours <= PINOCCHIO_CPP,
                   f"Pinocchio {PINOCCHIO_CPP * 1e6:.2f} us in C++, {theirs * 1e6:.2f} us from Python"),
        judge.Line("its largest difference", f"{worst:.1e} N m of {np.abs(tau).max():.0f}", "1e-10 of the largest",
                   worst <= 1e-10 * np.abs(tau).max(), "Pinocchio")]
    judge.show(lines, "Kinematics and dynamics")


if __name__ == "__main__":
    main()
