"""Kinematics and dynamics of the KR5 beside Pinocchio: agreement, and time a call in this process.

    python tools/benchmarks/dynamics.py [--postures 1000000]

kr5 takes all rows in one call, as Pinocchio's Python interface cannot; per-call times of Pinocchio from Python hold the
cost of that call, so a program in C++ is compiled with the headers of its wheel and timed beside it, on the same
states."""

import argparse
import time
from pathlib import Path

import numpy as np
import pinocchio as pin
from kr5.cell import load_cell
from kr5.kinematics import Body, Dynamics

import comparison
import pinocchio_cpp

CELL = Path(__file__).resolve().parents[2] / "share/cells/kr5_arc.yaml"


def row_transform(row, q: float) -> np.ndarray:
    c, s = np.cos(q + row.theta_offset), np.sin(q + row.theta_offset)
    ca, sa = np.cos(row.alpha), np.sin(row.alpha)
    return np.array(
        [[c, -s * ca, s * sa, row.a * c], [s, c * ca, -c * sa, row.a * s], [0, sa, ca, row.b], [0, 0, 0, 1]]
    )


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


def best_time(run, repeat: int = 7) -> float:
    """Least processor time of several runs: the machine may be busy with others."""
    times = []
    for _ in range(repeat):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def in_cpp(cell, states: np.ndarray) -> tuple[float, float]:
    """Pinocchio's time of a call in C++ [s], and the sum of the torques of joint 1."""
    places, links, T = [], [], np.eye(4)
    for row, link in zip(cell.robot.dh, cell.robot.links):
        places.append(T)
        T = row_transform(row, 0.0)
        R = T[:3, :3]
        links.append((link.mass, R @ np.array(link.com) + T[:3, 3], R @ link.inertia_matrix() @ R.T))
    return pinocchio_cpp.rnea(places, links, cell.robot.gravity, states)


def all_rows(count: int) -> list[comparison.Row]:
    """What is measured, judged."""
    cell = load_cell(CELL)
    chain, rows = cell.nominal_chain(), cell.robot.dh
    random = np.random.default_rng(1)
    q = random.uniform(-3, 3, (count, 6))

    sample = q[: min(count, 5000)]
    loop = best_time(lambda: [flange_by_loop(rows, v) for v in sample], 3) / len(sample)
    batch = best_time(lambda: chain.flanges(q), 5) / count
    worst = max(np.abs(flange_by_loop(rows, v) - T).max() for v, T in zip(sample, chain.flanges(sample)))
    out = [
        comparison.Row(
            f"flange of {count} postures",
            f"{batch * 1e6:.2f} us each",
            "20 times as fast",
            loop >= 20 * batch,
            f"Python loop {loop * 1e6:.1f} us, {loop / batch:.0f} times",
        ),
        comparison.Row("its largest difference", f"{worst:.1e}", "1e-10", worst <= 1e-10, "Python loop"),
    ]

    n = min(count, 50_000)
    q, qd, qdd = q[:n], random.uniform(-2, 2, (n, 6)), random.uniform(-5, 5, (n, 6))
    arm = Dynamics(chain, [Body(**link.to_dict()) for link in cell.robot.links], cell.robot.gravity)
    model = pinocchio_model(cell)
    data = model.createData()
    ours = best_time(lambda: arm.loads(q, qd, qdd)) / n
    from_python = best_time(lambda: [pin.rnea(model, data, *v) for v in zip(q, qd, qdd)], 3) / n
    theirs, their_sum = in_cpp(cell, np.hstack([q, qd, qdd]))
    tau = arm.loads(q, qd, qdd)[0]
    worst = max(np.abs(pin.rnea(model, data, *v) - t).max() for *v, t in zip(q[:2000], qd, qdd, tau))
    largest = np.abs(tau).max()
    apart = abs(their_sum - tau[:, 0].sum()) / np.abs(tau[:, 0]).sum()
    return [
        *out,
        comparison.Row(
            "inverse dynamics, a row",
            f"{ours * 1e6:.2f} us",
            "no slower than Pinocchio in C++",
            ours <= theirs,
            f"Pinocchio {theirs * 1e6:.2f} us in C++, {from_python * 1e6:.2f} us from Python",
        ),
        comparison.Row(
            "its largest difference",
            f"{worst:.1e} N m of {largest:.0f}",
            "1e-10 of the largest",
            worst <= 1e-10 * largest,
            "Pinocchio",
        ),
        comparison.Row("the same in C++, sum of joint 1", f"{apart:.1e} apart", "1e-9", apart <= 1e-9, "Pinocchio"),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--postures", type=int, default=1_000_000)
    count = parser.parse_args().postures
    comparison.print_comparisons(all_rows(count), "Kinematics and dynamics")


if __name__ == "__main__":
    main()
