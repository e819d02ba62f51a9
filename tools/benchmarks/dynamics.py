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
from kr5.kinematics import Body, Dynamics, InertialRegressor, inertial_parameters

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


def in_cpp(cell, states: np.ndarray) -> pinocchio_cpp.Times:
    """Pinocchio's times of a call in C++."""
    places, links, T = [], [], np.eye(4)
    for row, link in zip(cell.robot.dh, cell.robot.links):
        places.append(T)
        T = row_transform(row, 0.0)
        R = T[:3, :3]
        links.append((link.mass, R @ np.array(link.com) + T[:3, 3], R @ link.inertia_matrix() @ R.T))
    return pinocchio_cpp.times(places, links, cell.robot.gravity, states)


def skew(a: np.ndarray) -> np.ndarray:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def regressor_by_loop(rows, gravity: np.ndarray, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """The same in axes of the base, joint by joint, for revolute joints: n x 10 n."""
    n, T = len(rows), np.eye(4)
    Y, axes, points = np.zeros((n, 10 * n)), [], []
    w, wd, a = np.zeros(3), np.zeros(3), -np.asarray(gravity)
    for j, row in enumerate(rows):
        axes.append(T[:3, 2])
        points.append(T[:3, 3])
        T = T @ row_transform(row, q[j])
        wd = wd + axes[j] * qdd[j] + np.cross(w, axes[j] * qd[j])
        w = w + axes[j] * qd[j]
        A = skew(wd) + skew(w) @ skew(w)
        a = a + A @ (T[:3, 3] - points[j])
        R = T[:3, :3]
        x, y, z = np.eye(3)
        unit = [np.outer(x, x), np.outer(x, y) + np.outer(y, x), np.outer(x, z) + np.outer(z, x)]
        unit += [np.outer(y, y), np.outer(y, z) + np.outer(z, y), np.outer(z, z)]
        inertia = np.stack([R @ E @ R.T @ wd + np.cross(w, R @ E @ R.T @ w) for E in unit], axis=1)
        force = np.column_stack([a, A @ R, np.zeros((3, 6))])
        moment = np.column_stack([np.zeros(3), -skew(a) @ R, inertia])
        for i in range(j + 1):
            Y[i, 10 * j : 10 * j + 10] = axes[i] @ (moment + skew(T[:3, 3] - points[i]) @ force)
    return Y


def regressor_rows(cell, model: pin.Model, states: tuple[np.ndarray, ...], theirs: pinocchio_cpp.Times) -> list:
    """The regressor of the inertial parameters; link frames differ between the two, so the torques are compared."""
    gravity = cell.robot.gravity
    regressor = InertialRegressor(cell.nominal_chain(), gravity)
    data, n, part = model.createData(), len(states[0]), 40  # rows of a part: the result stays in the cache
    parts = [tuple(x[k : k + part] for x in states) for k in range(0, n, part)]

    def in_parts() -> None:
        for rows in parts:
            regressor.evaluate(*rows)

    ours = best_time(in_parts) / n
    few = list(zip(*(x[:5000] for x in states)))
    loop = best_time(lambda: [regressor_by_loop(cell.robot.dh, gravity, *v) for v in few[:200]], 3) / 200
    apart = max(
        np.abs(regressor_by_loop(cell.robot.dh, gravity, *v) - regressor.evaluate(*(x[None] for x in v))).max()
        for v in few[:200]
    )
    from_python = best_time(lambda: [pin.computeJointTorqueRegressor(model, data, *v) for v in few], 3) / len(few)
    chi = np.concatenate([inertial_parameters(Body(**link.to_dict())) for link in cell.robot.links])
    tau = regressor.evaluate(*(x[:2000] for x in states)) @ chi
    worst = max(np.abs(pin.rnea(model, data, *v) - t).max() for v, t in zip(few, tau.reshape(-1, 6)))
    largest = np.abs(tau).max()
    return [
        comparison.Row(
            "regressor, a row",
            f"{ours * 1e6:.2f} us",
            "no slower than Pinocchio in C++",
            ours <= theirs.regressor,
            f"Pinocchio {theirs.regressor * 1e6:.2f} us in C++, {from_python * 1e6:.2f} us from Python",
        ),
        comparison.Row(
            "regressor, many rows in one call",
            f"{ours * 1e6:.2f} us a row",
            "20 times as fast",
            loop >= 20 * ours,
            f"Python loop {loop * 1e6:.0f} us, {loop / ours:.0f} times",
        ),
        comparison.Row("its largest difference", f"{apart:.1e}", "1e-10", apart <= 1e-10, "Python loop"),
        comparison.Row(
            "its torques, largest difference",
            f"{worst:.1e} N m of {largest:.0f}",
            "1e-10 of the largest",
            worst <= 1e-10 * largest,
            "Pinocchio",
        ),
    ]


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

    return [*out, *rigid_body_rows(cell, min(count, 50_000))]


def rigid_body_rows(cell, n: int) -> list[comparison.Row]:
    """Inverse dynamics and the regressor beside Pinocchio."""
    random = np.random.default_rng(2)
    chain = cell.nominal_chain()
    q, qd, qdd = random.uniform(-3, 3, (n, 6)), random.uniform(-2, 2, (n, 6)), random.uniform(-5, 5, (n, 6))
    arm = Dynamics(chain, [Body(**link.to_dict()) for link in cell.robot.links], cell.robot.gravity)
    model = pinocchio_model(cell)
    data = model.createData()
    ours = best_time(lambda: arm.loads(q, qd, qdd)) / n
    from_python = best_time(lambda: [pin.rnea(model, data, *v) for v in zip(q, qd, qdd)], 3) / n
    theirs = in_cpp(cell, np.hstack([q, qd, qdd]))
    tau = arm.loads(q, qd, qdd)[0]
    worst = max(np.abs(pin.rnea(model, data, *v) - t).max() for *v, t in zip(q[:2000], qd, qdd, tau))
    largest = np.abs(tau).max()
    apart = abs(theirs.torque_sum - tau[:, 0].sum()) / np.abs(tau[:, 0]).sum()
    return [
        comparison.Row(
            "inverse dynamics, a row",
            f"{ours * 1e6:.2f} us",
            "no slower than Pinocchio in C++",
            ours <= theirs.rnea,
            f"Pinocchio {theirs.rnea * 1e6:.2f} us in C++, {from_python * 1e6:.2f} us from Python",
        ),
        comparison.Row(
            "its largest difference",
            f"{worst:.1e} N m of {largest:.0f}",
            "1e-10 of the largest",
            worst <= 1e-10 * largest,
            "Pinocchio",
        ),
        comparison.Row("the same in C++, sum of joint 1", f"{apart:.1e} apart", "1e-9", apart <= 1e-9, "Pinocchio"),
        *regressor_rows(cell, model, (q, qd, qdd), theirs),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--postures", type=int, default=1_000_000)
    count = parser.parse_args().postures
    comparison.print_comparisons(all_rows(count), "Kinematics and dynamics")


if __name__ == "__main__":
    main()
