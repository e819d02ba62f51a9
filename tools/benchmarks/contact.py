"""Peg on tube: height and contacts beside brute force, the book's example, and a simulated roll.

    python tools/benchmarks/contact.py [--rows 20000]

Brute force is the greatest height over points of rim and edges (as in the reference program: 1440 a circle), and the
same with ever finer points around the best one. Times of the library include the call from Python.
"""

import argparse
import math
import time

import kr5
import numpy as np
from kr5 import force
from rich.console import Console

import comparison
from kr5_tools.cli.tables import make_table

BODIES = force.PegTube(peg_radius=9.42e-3, inner_radius=9.7e-3, outer_radius=12.65e-3)
SHAPE = force.PegTubeShape(
    peg_radius=9.42e-3, peg_length=0.05, inner_radius=9.7e-3, outer_radius=12.65e-3, tube_depth=0.06
)
CENTRE = np.array([-7.53e-3, -7.2e-3])
TILT = math.radians(7.5)


def brute_force_height(tilt, alpha, c, bodies, angles=None, refine=True):
    """Greatest height over the arcs and its angle; with `refine` again and again around the arc point that was best."""
    d, e = np.array([math.cos(alpha), math.sin(alpha)]), np.array([-math.sin(alpha), math.cos(alpha)])
    b = np.linspace(0, 2 * np.pi, 1440, endpoint=False) if angles is None else angles
    r, cos = bodies.peg_radius, math.cos(tilt)
    rim = c + r * (np.outer(cos * np.cos(b), d) + np.outer(np.sin(b), e))
    rho = np.hypot(*rim.T)
    best, at = -np.inf, 0.0
    curves = [(rim, (rho >= bodies.inner_radius) & (rho <= bodies.outer_radius))]
    for R in (bodies.inner_radius, bodies.outer_radius):
        circle = R * np.column_stack([np.cos(b), np.sin(b)])
        curves.append((circle, ((circle - c) @ d / cos) ** 2 + ((circle - c) @ e) ** 2 <= r * r))
    for points, inside in curves:
        compare_heights = np.where(inside, (points - c) @ d, -np.inf)
        k = int(np.argmax(compare_heights))
        if compare_heights[k] > best:
            best, at = compare_heights[k], b[k]
    best *= math.tan(tilt)
    if refine and np.isfinite(best):
        half = 2 * np.pi / 1440
        for _ in range(4):  # each time round the best point of the last
            found = brute_force_height(tilt, alpha, c, bodies, np.linspace(at - half, at + half, 401), False)
            best, at = max((best, at), found)
            half /= 100
    return best, at


def compare_heights(rows):
    random = np.random.default_rng(1)
    alpha = random.uniform(0, 2 * np.pi, rows)
    cx, cy = random.uniform(-0.011, 0.011, (2, rows))
    start = time.perf_counter()
    own = force.resting_heights(BODIES, TILT, alpha, cx, cy)
    each = (time.perf_counter() - start) / rows
    some = range(min(rows, 1500))
    result = [["closed form", "0 (reference)", f"{1e6 * each:.2f}"]]
    for name, refine in (("brute force, 1440 points a circle", False), ("brute force, refined", True)):
        start = time.perf_counter()
        other = np.array(
            [brute_force_height(TILT, alpha[i], np.array([cx[i], cy[i]]), BODIES, refine=refine)[0] for i in some]
        )
        spent = (time.perf_counter() - start) / len(some)
        found = np.isfinite(other) & np.isfinite(own[list(some)])
        error = 1e6 * np.abs(other - own[list(some)])[found]
        result.append([name, f"{np.sqrt(np.mean(error**2)):.2g} / {error.max():.2g}", f"{1e6 * spent:.0f}"])
        worst = error.max()  # of the refined one in the end
    shown = make_table(
        f"Height of a tilted peg on a tube (7.5 deg, {rows} poses)",
        ["method", "difference rms / max [µm]", "time a pose [µs]"],
        result,
    )
    return shown, [
        comparison.Row(
            "height, greatest difference",
            f"{1e-3 * worst:.1e} mm",
            "1e-7 mm",
            1e-3 * worst <= 1e-7,
            f"refined brute force, {spent / each:.0f} times the time",
        )
    ]


def compare_book():
    azimuth = np.arange(0, 360, 0.01)  # of the tilt axis, as the book counts
    profile = 1e3 * force.resting_heights(BODIES, TILT, np.radians(azimuth - 90), *CENTRE)
    rows, all_rows = [], []
    for name, low, high, printed in (("cusp over the bore", 90, 180, 133.7), ("smooth, outer edge", 270, 360, 313.7)):
        part = (azimuth >= low) & (azimuth < high)
        k = np.flatnonzero(part)[np.argmin(profile[part])]
        rows.append([name, f"{azimuth[k]:.2f}", f"{printed:.1f}", f"{profile[k]:.4f}"])
        all_rows.append(
            comparison.Row(
                f"book's example, {name}",
                f"{azimuth[k]:.2f} deg",
                "as printed",
                abs(azimuth[k] - printed) <= 0.05,
                f"book {printed} deg",
            )
        )
    shown = make_table(
        "The book's example, offset (-7.53, -7.2) mm", ["minimum", "azimuth [deg]", "book [deg]", "height [mm]"], rows
    )
    return shown, all_rows


def tilted_axis(alpha):
    T = np.eye(4)
    turn = lambda a, axis: kr5.exp_rotation(a * np.eye(3)[axis])
    T[:3, :3] = turn(alpha, 2) @ turn(TILT, 1) @ turn(-alpha, 2)
    return T


def simulate_roll(steps=6000, held=15.0, mass=1.5, guide=20.0):
    """Once round in six seconds under a held force, free along Z over a fixed point.

    Where the contact goes from one arc to another the height has a kink, at which the peg gets its new speed in a blow:
    its impulse is mass times the change of speed, whatever the contact is made of. The noise of the force is that of
    all rows that do not follow one within 50; both are shown."""
    # A third of critical damping under the held force.
    law, stiction, dt = force.ContactLaw(damping=50.0), force.Stiction(), 6.0 / steps
    alphas = np.linspace(0, 2 * np.pi, steps, endpoint=False)
    expected = force.resting_heights(BODIES, TILT, alphas, *CENTRE) - held / law.stiffness
    z, speed, got, normal, spent = expected[0], 0.0, [], [], 0.0
    for alpha in alphas:
        T = tilted_axis(alpha)
        T[:3, 3] = [*CENTRE, z]
        turn = kr5.log_rotation(tilted_axis(alpha + 1e-6)[:3, :3] @ T[:3, :3].T) / 1e-6 * 2 * np.pi / 6
        start = time.perf_counter()
        contacts = force.peg_tube_contacts(SHAPE, T)
        spent += time.perf_counter() - start
        pushed = force.contact_wrench(contacts, law, T, [0, 0, speed, *turn], dt, stiction)
        speed += dt * (pushed.wrench[2] - held - guide * speed) / mass
        z += dt * speed
        got.append(z)
        normal.append(pushed.wrench[2])
    got, quarter = np.array(got), alphas < np.pi / 2
    direction = math.degrees(alphas[quarter][np.argmin(got[quarter])] - math.atan2(-CENTRE[1], -CENTRE[0]))
    error = 1e6 * np.abs(got - expected)
    extra = np.array(normal) - held
    change = np.diff(expected, 2) / dt  # of speed, row by row
    kinks = np.flatnonzero(np.abs(change) > 2e-4)
    missed = np.flatnonzero(extra < -held / 2)
    blows, ratios = np.zeros(steps, bool), []
    for k in kinks[np.diff(kinks, prepend=-100) > 50]:
        rows = slice(k, k + 50)
        blows[rows] = True
        wanted = mass * (expected[k + 51] - expected[k + 50] - expected[k - 4] + expected[k - 5]) / dt
        ratios.append(dt * extra[rows].sum() / wanted)
    noise = float(np.sqrt(np.mean(extra[~blows] ** 2)))
    rows = [
        ["height against the closed form, mean / max [µm]", f"{error.mean():.3f} / {error.max():.2f}"],
        ["direction of the depth minimum, error [deg]", f"{direction:+.2f}"],
        ["vertical force, RMS about the held one, away from blows [N]", f"{noise:.4f}"],
        ["the same, everywhere [N]", f"{np.sqrt(np.mean(extra**2)):.4f}"],
        ["rows in which most of the contact is missed", f"{len(missed)} of {steps}"],
        ["impulse of each blow over mass times change of speed", " ".join(f"{r:.2f}" for r in ratios)],
        ["contacts of one pose, called from Python [µs]", f"{1e6 * spent / steps:.1f}"],
    ]
    shown = make_table("A simulated roll once round the tube, 15 N held", ["what", "value"], rows)
    return shown, [
        comparison.Row("roll, mean height error", f"{error.mean():.3f} µm", "10 µm", error.mean() <= 10, "closed form"),
        comparison.Row("roll, noise of the force", f"{noise:.3f} N", "0.044 N", noise <= 0.044, "prototype 0.044 N"),
        comparison.Row(
            "roll, direction of the minimum", f"{direction:+.2f} deg", "within 1.5 deg", abs(direction) <= 1.5, "truth"
        ),
    ]


def all_rows(rows, console):
    """What is measured, shown on the console and judged."""
    judged = []
    for part in comparison.progress((lambda: compare_heights(rows), compare_book, simulate_roll), "Parts"):
        shown, some = part()
        console.print(shown)
        judged += some
    return judged


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=20000, help="poses of the height")
    given = parser.parse_args()
    comparison.print_comparisons(all_rows(given.rows, Console(width=120)))


if __name__ == "__main__":
    main()
