"""Effects no catalogue names, to see whether a diagnosis says so. `bend(truth, target, m, rng)`; m is the magnitude."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import cont2discrete, lfilter

from .catalogue import ALL, ARM, SENSOR, components, index, joints, log_uniform, only, sign
from .truth import WRENCH, Truth


@dataclass(frozen=True)
class Unknown:
    id: str
    targets: Callable[[dict], list[str]]
    span: tuple[float, float]
    bend: Callable[[Truth, str, float, np.random.Generator], None]
    kinds: tuple[str, ...]


def on(stage: str):
    """Registers what a maker returns, a function of the state, at a stage."""

    def wrap(make):
        def bend(truth: Truth, target: str, m: float, rng: np.random.Generator) -> None:
            truth.hooks[stage].append(make(truth, target, m, rng))

        return bend

    return wrap


def friction(make):
    """make(truth, i, m, rng) gives f(s), the extra friction torque of joint i."""

    def bend(truth, target, m, rng):
        i = index(target)
        torque = make(truth, i, m * truth.cell["drives"]["friction"]["coulomb"][i], rng)

        def hook(s):
            s.friction[:, i] += torque(s)

        truth.hooks["friction"].append(hook)

    return bend


@friction
def position_friction(truth, i, c, rng):
    cycles, phase = int(rng.integers(4, 13)), rng.uniform(-np.pi, np.pi)
    return lambda s: c * np.sin(cycles * s.q[:, i] + phase) * s.sign[:, i]


@friction
def asymmetric_friction(truth, i, c, rng):
    side = sign(rng)
    return lambda s: c * np.maximum(side * s.sign[:, i], 0) * side


@friction
def quadratic_drag(truth, i, c, rng):
    return lambda s: 3 * c * s.v[:, i] * np.abs(s.v[:, i])


@friction
def dahl_friction(truth, i, c, rng):
    """Friction with memory: builds up over a distance after each reversal instead of at once."""
    length = log_uniform(rng, 3e-3, 3e-2)

    def torque(s):
        z, out = 0.0, np.zeros(len(s.fine.t))
        for k, d in enumerate((np.diff(s.fine.q[:, i], prepend=s.fine.q[0, i]) / length).tolist()):
            target = 1.0 if d > 0 else -1.0
            z = target + (z - target) * np.exp(-abs(d))
            out[k] = z
        rows = round((s.t[1] - s.t[0]) / (s.fine.t[1] - s.fine.t[0]))
        return c * (out[::rows][: len(s.t)] - s.sign[:, i])

    return torque


@friction
def break_away(truth, i, c, rng):
    """Sticks for a distance after each reversal."""
    length = log_uniform(rng, 3e-3, 2e-2)

    def torque(s):
        travelled, last, out = 0.0, 0.0, np.zeros(len(s.t))
        for k, d in enumerate(np.diff(s.q[:, i], prepend=s.q[0, i]).tolist()):
            travelled, last = (0.0, d) if d * last < 0 else (travelled + abs(d), d or last)
            out[k] = np.exp(-travelled / length)
        return c * out * s.sign[:, i]

    return torque


@on("torque")
def cable_jerk(truth, target, m, rng):
    """The dress pack snags at one angle, when passed one way."""
    i, side, width, where = index(target), sign(rng), rng.uniform(0.02, 0.06), rng.uniform(-0.15, 0.15)

    def hook(s):
        at = s.q[0, i] + where
        s.torque[:, i] += 5 * m * np.exp(-(((s.q[:, i] - at) / width) ** 2)) * np.maximum(side * s.sign[:, i], 0) * side

    return hook


@on("current")
def current_dead_zone(truth, target, m, rng):
    i = index(target)

    def hook(s):
        x = s.i[:, i]
        s.i[:, i] = np.sign(x) * np.maximum(np.abs(x) - m, 0)

    return hook


@on("current")
def current_saturation(truth, target, m, rng):
    i = index(target)

    def hook(s):
        s.i[:, i] = np.clip(s.i[:, i], *(np.array([-1, 1]) * np.quantile(np.abs(s.i[:, i]), max(0.2, 1 - m))))

    return hook


@on("current")
def current_steps(truth, target, m, rng):
    i = index(target)

    def hook(s):
        s.i[:, i] = m * np.round(s.i[:, i] / m)

    return hook


@on("reading")
def encoder_interpolation(truth, target, m, rng):
    """Error periodic in the motor's angle, in the reading alone."""
    i, lines = index(target), int(rng.integers(1, 4))
    ratio = abs(truth.cell["drives"]["structure"][i][i])

    def hook(s):
        s.q[:, i] += m * np.sin(lines * ratio * s.q[:, i])

    return hook


@on("servo")
def servo_overshoot(truth, target, m, rng):
    """An integrator leaves a slow tail after each move."""
    i, tau = index(target), log_uniform(rng, 0.15, 0.5)

    def hook(s):
        dt = s.t[1] - s.t[0]
        k = 1 - np.exp(-dt / tau)
        tail = m * lfilter([0, tau * k], [1, k - 1], s.v[:, i])
        s.q[:, i] += tail
        s.v[:, i] += np.gradient(tail, dt)
        s.a[:, i] += np.gradient(np.gradient(tail, dt), dt)

    return hook


@on("command")
def rate_limit(truth, target, m, rng):
    """The drive follows no faster than a part of the speed asked of it."""
    i = index(target)

    def hook(s):
        steps = np.diff(s.u[:, i], prepend=s.u[0, i])
        top, x, out = max(0.3, 1 - m) * np.abs(steps).max(), float(s.u[0, i]), []
        for u in s.u[:, i].tolist():
            x += min(max(u - x, -top), top)
            out.append(x)
        s.u[:, i] = out

    return hook


@on("reading")
def stamp_jitter(truth, target, m, rng):
    """Rows are stamped a random moment away from when they were taken."""
    seed = int(rng.integers(2**32))

    def hook(s):
        t = s.t - s.t[0]
        late = t + m * np.random.default_rng([seed, int(s.t[0])]).standard_normal(len(t))
        s.q, s.i, s.w = (np.column_stack([np.interp(late, t, x) for x in y.T]) for y in (s.q, s.i, s.w))

    return hook


@on("load")
def slosh(truth, target, m, rng):
    """A liquid swings in the tool: a pendulum driven by the tool's acceleration."""
    w0, com = rng.uniform(6, 14), rng.uniform(0.08, 0.16)

    def hook(s):
        a, b = cont2discrete((np.array([[0, 1], [-(w0**2), -0.06 * w0]]), np.array([[0.0], [1.0]]), np.eye(2), np.zeros((2, 1))), 0.012, "zoh")[:2]
        den = np.poly(a)
        num = np.array([0.0, b[0, 0], a[0, 1] * b[1, 0] - a[1, 1] * b[0, 0]])
        for k in (0, 1):
            x = lfilter(num, den, (s.w[:, k] - s.w[0, k]) / truth.cell["tool"]["mass"])
            s.w[:, k] += m * w0**2 * x
            s.w[:, 4 - k] += (1 - 2 * k) * m * w0**2 * x * com

    return hook


@on("sensor")
def ft_hysteresis(truth, target, m, rng):
    """Reading lags behind the load by a play, as friction in the sensor's body does."""
    k, half = WRENCH.index(target), m * (0.15 if target[0] == "f" else 0.008)

    def hook(s):
        for run in s.runs:
            x, out = s.w[run][0, k], []
            for w in s.w[run][:, k].tolist():
                x = min(max(x, w - half), w + half)
                out.append(x)
            s.w[run, k] = out

    return hook


@on("sensor")
def ft_warming(truth, target, m, rng):
    """Offset that follows the load with the slowness of the sensor's temperature."""
    k, tau = WRENCH.index(target), rng.uniform(5, 25)

    def hook(s):
        dt = s.t[1] - s.t[0]
        for run in s.runs:
            load = np.linalg.norm(s.w[run][:, :3] - s.w[run][0, :3], axis=1)
            f = 1 - np.exp(-dt / tau)
            s.w[run, k] += m * (1.0 if k < 3 else 0.05) * lfilter([f], [1, f - 1], load)

    return hook


@on("sensor")
def ft_quadratic(truth, target, m, rng):
    k = WRENCH.index(target)
    top = 30.0 if k < 3 else 3.0

    def hook(s):
        s.w[:, k] += m * s.w[:, k] * np.abs(s.w[:, k]) / top

    return hook


@on("sensor")
def ft_turned(truth, target, m, rng):
    """The sensor is mounted turned."""
    from scipy.spatial.transform import Rotation

    R = Rotation.from_rotvec(m * np.array([*rng.choice([-1, 1], 2) * 0.5, sign(rng)])).as_matrix()

    def hook(s):
        s.w[:, :3], s.w[:, 3:] = s.w[:, :3] @ R, s.w[:, 3:] @ R

    return hook


@on("pose")
def link_bending(truth, target, m, rng):
    """Links bend under their load: the tip falls with the cube of the reach."""

    def hook(s):
        xy = s.T[:, :2, 3]
        s.T[:, 2, 3] -= m * np.sum(xy**2, 1) ** 1.5

    return hook


@on("pose")
def base_flex(truth, target, m, rng):
    """The stand tilts towards where the arm reaches, more easily one way than the other."""
    soft, about = rng.uniform(1.5, 3), rng.uniform(-np.pi, np.pi)
    d = np.array([np.cos(about), np.sin(about)])

    def hook(s):
        from scipy.spatial.transform import Rotation

        xy = s.T[:, :2, 3]
        lean = m * (xy + (soft - 1) * np.outer(xy @ d, d))
        R = Rotation.from_rotvec(np.column_stack([-lean[:, 1], lean[:, 0], 0 * lean[:, 0]])).as_matrix()
        s.T[:, :3] = R @ s.T[:, :3]

    return hook


@on("pose")
def walking_base(truth, target, m, rng):
    """The stand creeps over the session."""
    d = rng.standard_normal(3)

    def hook(s):
        s.T[:, :3, 3] += m * np.outer(s.t / 1000, d / np.linalg.norm(d))

    return hook


@on("lens")
def thin_prism(truth, target, m, rng):
    d = rng.standard_normal(2)
    d /= np.linalg.norm(d)

    def hook(s):
        s.x, s.y = s.x + m * d[0] * s.r2**2, s.y + m * d[1] * s.r2**2

    return hook


@on("lens")
def higher_distortion(truth, target, m, rng):
    side = sign(rng)

    def hook(s):
        radius = np.sqrt(s.r2)
        wave = side * m * np.sin(14 * radius)
        s.x, s.y = s.x * (1 + wave), s.y * (1 + wave)

    return hook


@on("pixel")
def rolling_shutter(truth, target, m, rng):
    """Rows are read one after another while the arm still rings: each view is sheared by its own amount."""
    seed = int(rng.integers(2**32))

    def hook(s):
        shear = np.random.default_rng(seed).uniform(-1, 1, 10000)[s.d["view"].astype(int)]
        s.u = s.u + 10 * m * shear * (s.v / truth.cell["camera"]["height"] - 0.5)

    return hook


@on("pixel")
def corner_bias(truth, target, m, rng):
    """Blooming light makes the dark squares look smaller."""

    def hook(s):
        marker = np.unique(np.column_stack([s.d["view"], s.d["marker"]]), axis=0, return_inverse=True)[1].ravel()
        n = np.bincount(marker)
        for x in ("u", "v"):
            value = getattr(s, x)
            middle = (np.bincount(marker, value) / n)[marker]
            setattr(s, x, value - m * np.sign(value - middle))

    return hook


@on("fan")
def laser_fan(truth, target, m, rng):
    """The fan's scale differs from the middle to the edge."""

    def hook(s):
        s.x = s.x * (1 + m * (s.x / 0.045) ** 2)

    return hook


@on("range")
def laser_bow(truth, target, m, rng):
    side = sign(rng)

    def hook(s):
        s.z = s.z + side * m * np.cos(3 * np.pi * s.x / 0.09)

    return hook


@on("range")
def second_reflection(truth, target, m, rng):
    """Steep surfaces look nearer."""

    def hook(s):
        s.z = s.z - m * (1 - s.steep) ** 2

    return hook


@on("press")
def contact_hysteresis(truth, target, m, rng):
    """The bench gives back less force than it took."""

    def hook(s):
        s.force = s.force * np.where(s.v > 1e-5, 1 - m, 1.0)

    return hook


@on("press")
def contact_creep(truth, target, m, rng):
    """The bench's cover relaxes under load."""
    tau = rng.uniform(0.4, 2.0)

    def hook(s):
        k = 1 - np.exp(-0.012 / tau)
        for run in s.runs:
            f = s.force[run]
            s.force[run] = f - m * lfilter([k], [1, k - 1], f)

    return hook


@on("rub")
def stick_slip(truth, target, m, rng):
    pitch = rng.uniform(0.15, 0.5)

    def hook(s):
        s.friction *= (1 + m * (2 * np.mod(s.d["alpha"] / pitch, 1) - 1))[:, None]

    return hook


def oval_tube(truth, target, m, rng):
    a = rng.uniform(0, np.pi)
    R = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    truth.tube_shape = R @ np.diag([1 + m, 1 / (1 + m)]) @ R.T


@on("depth")
def burr(truth, target, m, rng):
    where, width = rng.uniform(0, 2 * np.pi), rng.uniform(0.15, 0.5)

    def hook(s):
        off = np.mod(s.d["alpha"] - where + np.pi, 2 * np.pi) - np.pi
        s.z = s.z + m * np.exp(-((off / width) ** 2))

    return hook


@on("depth")
def grip_slip(truth, target, m, rng):
    """The peg is pushed back into the grip as each run goes on."""
    tau = rng.uniform(2, 8)

    def hook(s):
        for run in s.runs:
            t = s.t[run] - s.t[run][0]
            s.z[run] += m * (1 - np.exp(-t / tau))

    return hook


@on("tool_servo")
def path_creep(truth, target, m, rng):
    """The correction settles with a slow tail."""
    tau = rng.uniform(0.8, 2.0)

    def hook(s):
        k = 1 - np.exp(-s.dt / tau)
        slow = s.z[0] + lfilter([k], [1, k - 1], s.z - s.z[0])
        s.z = (1 - m) * s.z + m * slow

    return hook


@on("tool_command")
def path_rate_limit(truth, target, m, rng):
    """A correction acts no faster than a rate."""
    top = 1e-4 / m

    def hook(s):
        x, out = float(s.u[0]), []
        for u in s.u.tolist():
            x += min(max(u - x, -top), top)
            out.append(x)
        s.u = np.array(out)

    return hook


CAMERA, LASER, TUBE = only("camera"), only("laser"), only("tube")
UNKNOWN = [
    Unknown("position_friction", joints, (0.02, 3), position_friction, ARM),
    Unknown("asymmetric_friction", joints, (0.02, 3), asymmetric_friction, ARM),
    Unknown("quadratic_drag", joints, (0.02, 10), quadratic_drag, ARM),
    Unknown("dahl_friction", joints, (0.05, 3), dahl_friction, ARM),
    Unknown("break_away", joints, (0.05, 3), break_away, ARM),
    Unknown("cable_jerk", joints, (0.1, 40), cable_jerk, ARM),
    Unknown("current_dead_zone", joints, (0.02, 2), current_dead_zone, ARM),
    Unknown("current_saturation", joints, (0.02, 0.8), current_saturation, ARM),
    Unknown("current_steps", joints, (0.05, 2), current_steps, ARM),
    Unknown("encoder_interpolation", joints, (1e-5, 5e-3), encoder_interpolation, ARM),
    Unknown("servo_overshoot", joints, (1e-4, 0.3), servo_overshoot, ARM),
    Unknown("rate_limit", joints, (0.01, 0.7), rate_limit, ARM),
    Unknown("stamp_jitter", only("drives"), (1e-5, 5e-3), stamp_jitter, ARM),
    Unknown("slosh", only("tool"), (0.01, 2), slosh, ARM),
    Unknown("ft_hysteresis", components, (0.5, 60), ft_hysteresis, SENSOR),
    Unknown("ft_warming", components, (0.01, 3), ft_warming, SENSOR),
    Unknown("ft_quadratic", components, (0.01, 3), ft_quadratic, SENSOR),
    Unknown("ft_turned", only("force_torque"), (1e-3, 0.4), ft_turned, SENSOR),
    Unknown("link_bending", only("links"), (1e-5, 2e-2), link_bending, ALL),
    Unknown("base_flex", only("base"), (1e-5, 1e-2), base_flex, ALL),
    Unknown("walking_base", only("base"), (1e-4, 2e-2), walking_base, ALL),
    Unknown("thin_prism", CAMERA, (1e-4, 0.5), thin_prism, ("views",)),
    Unknown("higher_distortion", CAMERA, (1e-4, 0.05), higher_distortion, ("views",)),
    Unknown("rolling_shutter", CAMERA, (0.02, 5), rolling_shutter, ("views",)),
    Unknown("corner_bias", CAMERA, (0.05, 5), corner_bias, ("views",)),
    Unknown("laser_fan", LASER, (1e-3, 0.2), laser_fan, ("scan",)),
    Unknown("laser_bow", LASER, (2e-5, 3e-3), laser_bow, ("scan",)),
    Unknown("second_reflection", LASER, (1e-4, 5e-2), second_reflection, ("scan",)),
    Unknown("contact_hysteresis", only("contact"), (0.005, 0.8), contact_hysteresis, ("press",)),
    Unknown("contact_creep", only("contact"), (0.005, 0.8), contact_creep, ("press",)),
    Unknown("stick_slip", only("contact"), (0.02, 3), stick_slip, ("profile",)),
    Unknown("oval_tube", TUBE, (1e-4, 0.05), oval_tube, ("profile",)),
    Unknown("burr", TUBE, (2e-5, 2e-3), burr, ("profile",)),
    Unknown("grip_slip", only("gripper"), (2e-5, 2e-3), grip_slip, ("profile",)),
    Unknown("path_creep", only("servo"), (1e-3, 0.6), path_creep, ("step", "press")),
    Unknown("path_rate_limit", only("servo"), (5e-3, 0.5), path_rate_limit, ("step", "press")),
]
UNKNOWN_BY_ID = {kind.id: kind for kind in UNKNOWN}
