"""Sets one catalogued effect in a truth: `f(truth, target, parameters)`."""

import numpy as np
from scipy.spatial.transform import Rotation

from .truth import WRENCH, Truth, attach_mass, pose_matrix, pose_vector


def _index(target: str) -> int:
    return int(target.removeprefix("joint").removeprefix("motor")) - 1


def _number(values: dict, key: str, i: int, new: float) -> None:
    """Replaces one number of a list, which may be given as one number for all."""
    values[key] = [float(x) for x in values[key]]
    values[key][i] = float(new)


def coulomb(truth: Truth, target: str, p: dict) -> None:
    _number(truth.cell["drives"]["friction"], "coulomb", _index(target), p["coulomb"])


def viscous(truth: Truth, target: str, p: dict) -> None:
    _number(truth.cell["drives"]["friction"], "viscous", _index(target), p["viscous"])


def torque_constant(truth: Truth, target: str, p: dict) -> None:
    _number(truth.cell["drives"], "torque_constant", _index(target), p["torque_constant"])


def rotor_inertia(truth: Truth, target: str, p: dict) -> None:
    _number(truth.cell["drives"], "rotor_inertia", _index(target), p["rotor_inertia"])


def stribeck(truth: Truth, target: str, p: dict) -> None:
    i = _index(target)

    def hook(s):
        s.friction[:, i] += p["stribeck"] * np.exp(-((s.v[:, i] / p["stribeck_velocity"]) ** 2)) * s.sign[:, i]

    truth.hooks["friction"].append(hook)


def load_friction(truth: Truth, target: str, p: dict) -> None:
    i = _index(target)

    def hook(s):
        s.friction[:, i] += p["coefficient"] * np.abs(s.tau[:, i]) * s.sign[:, i]

    truth.hooks["friction"].append(hook)


def driven_friction(truth: Truth, target: str, p: dict) -> None:
    i = _index(target)

    def hook(s):
        s.friction[:, i] += p["coefficient"] * np.maximum(-s.tau[:, i] * s.sign[:, i], 0) * s.sign[:, i]

    truth.hooks["friction"].append(hook)


def quadratic_drag(truth: Truth, target: str, p: dict) -> None:
    i = _index(target)

    def hook(s):
        s.friction[:, i] += p["quadratic"] * s.v[:, i] * np.abs(s.v[:, i])

    truth.hooks["friction"].append(hook)


def angle_friction(truth: Truth, target: str, p: dict) -> None:
    i = _index(target)

    def hook(s):
        dry = truth.cell["drives"]["friction"]["coulomb"][i]
        wave = p["amplitude"] * np.sin(p["cycles"] * s.q[:, i] + p.get("phase", 0.0))
        s.friction[:, i] += np.maximum(wave, -dry) * s.sign[:, i]

    truth.hooks["friction"].append(hook)


def thermal_friction(truth: Truth, target: str, p: dict) -> None:
    i = _index(target)

    def hook(s):
        s.friction[:, i] *= 1 - p["drop"] * (1 - np.exp(-s.t / p["time_constant"]))

    truth.hooks["friction_scale"].append(hook)


def elasticity(truth: Truth, target: str, p: dict) -> None:
    truth.compliance[_index(target)] = 1 / p["stiffness"]


def backlash(truth: Truth, target: str, p: dict) -> None:
    truth.gaps[_index(target)] = p["gap"]


def cable_spring(truth: Truth, target: str, p: dict) -> None:
    i = _index(target)

    def hook(s):
        s.torque[:, i] += p["stiffness"] * (s.q[:, i] - p["rest"])

    truth.hooks["torque"].append(hook)


def torque_ripple(truth: Truth, target: str, p: dict) -> None:
    i = _index(target)

    def hook(s):
        s.torque[:, i] += p["amplitude"] * np.sin(p["cycles"] * s.q[:, i] + p.get("phase", 0.0))

    truth.hooks["torque"].append(hook)


def wrist_coupling(truth: Truth, target: str, p: dict) -> None:
    S = np.array(truth.cell["drives"]["structure"], float)
    S[_index(target), p["element"]] = p["value"]
    truth.current_structure = S


def payload(truth: Truth, target: str, p: dict) -> None:
    attach_mass(truth.cell["tool"], p["mass"], p["com"])


def link_mass(truth: Truth, target: str, p: dict) -> None:
    """With its inertia, as if the link were of another material."""
    link = truth.cell["robot"]["links"][_index(target)]
    link["inertia"] = [float(x) * p["mass"] / link["mass"] for x in link["inertia"]]
    link["mass"] = p["mass"]


def link_com(truth: Truth, target: str, p: dict) -> None:
    truth.cell["robot"]["links"][_index(target)]["com"] = p["com"]


def base_tilt(truth: Truth, target: str, p: dict) -> None:
    truth.base = Rotation.from_euler("xyz", [p["roll"], p["pitch"], 0.0]).as_matrix()


def encoder_offset(truth: Truth, target: str, p: dict) -> None:
    i = _index(target)

    def hook(s):
        s.q[:, i] += p["offset"]

    truth.hooks["angle"].append(hook)


def transmission_error(truth: Truth, target: str, p: dict) -> None:
    i, A, c, phase = _index(target), p["amplitude"], p["cycles"], p.get("phase", 0.0)

    def hook(s):
        angle, v = c * s.q[:, i] + phase, s.v[:, i].copy()
        s.q[:, i] += A * np.sin(angle)
        s.v[:, i] += A * c * np.cos(angle) * v
        s.a[:, i] += A * c * (np.cos(angle) * s.a[:, i] - c * np.sin(angle) * v**2)

    truth.hooks["angle"].append(hook)


def link_length(truth: Truth, target: str, p: dict) -> None:
    truth.cell["robot"]["dh"][_index(target)].update(p)


def link_twist(truth: Truth, target: str, p: dict) -> None:
    truth.cell["robot"]["dh"][_index(target)]["alpha"] = p["alpha"]


def tool_offset(truth: Truth, target: str, p: dict) -> None:
    tool, T = truth.cell["tool"], np.eye(4)
    T[:3, 3] = p["offset"]
    tool["nominal_T_F_E"] = tool["T_F_E"]  # camera and scanner stay where they are
    tool["T_F_E"] = pose_vector(pose_matrix(tool["T_F_E"]) @ T)


def thermal_growth(truth: Truth, target: str, p: dict) -> None:
    truth.growth = lambda t: p["growth"] * (1 - np.exp(-np.asarray(t) / p["time_constant"]))


def current_delay(truth: Truth, target: str, p: dict) -> None:
    def hook(s):
        t = s.t - s.t[0]
        s.i = np.column_stack([np.interp(t - p["delay"], t, x) for x in s.i.T])

    truth.hooks["current"].append(hook)


def joint_servo(truth: Truth, target: str, p: dict) -> None:
    servo = truth.cell["servo"]["joint"]
    servo["natural_frequency"] = np.broadcast_to(servo["natural_frequency"], truth.joints).tolist()
    _number(servo, "natural_frequency", _index(target), p["natural_frequency"])


def joint_delay(truth: Truth, target: str, p: dict) -> None:
    truth.cell["servo"]["joint"]["delay"] = p["delay"]


def tool_servo(truth: Truth, target: str, p: dict) -> None:
    truth.cell["servo"]["tool"]["natural_frequency"] = p["natural_frequency"]


def tool_damping(truth: Truth, target: str, p: dict) -> None:
    truth.cell["servo"]["tool"]["damping_ratio"] = p["damping_ratio"]


def tool_delay(truth: Truth, target: str, p: dict) -> None:
    truth.cell["servo"]["tool"]["delay"] = p["delay"]


def _of_wrench(change):
    """A change of one component: change(column, s, parameters)."""

    def apply(truth: Truth, target: str, p: dict) -> None:
        k = WRENCH.index(target)

        def hook(s):
            s.w[:, k] = change(s.w[:, k], s, p)

        truth.hooks["sensor"].append(hook)

    return apply


ft_bias = _of_wrench(lambda w, s, p: w + p["bias"])
ft_drift = _of_wrench(lambda w, s, p: w + p["rate"] * s.t)
ft_gain = _of_wrench(lambda w, s, p: w * p["gain"])
ft_crosstalk = _of_wrench(lambda w, s, p: w + p["gain"] * s.w[:, WRENCH.index(p["source"])])


def ft_lag(truth: Truth, target: str, p: dict) -> None:
    from scipy.signal import lfilter

    def hook(s):
        k = 1 - np.exp(-0.012 / p["time_constant"])
        for run in s.runs:
            start = s.w[run][0]
            s.w[run] = start + lfilter([k], [1, k - 1], s.w[run] - start, axis=0)

    truth.hooks["sensor"].append(hook)


def camera_focal(truth: Truth, target: str, p: dict) -> None:
    truth.cell["camera"].update(fx=p["fx"], fy=p["fy"])


def lens_distortion(truth: Truth, target: str, p: dict) -> None:
    old = truth.cell["camera"]["distortion"]
    truth.cell["camera"]["distortion"] = [p["k1"], p["k2"], *old[2:]]


def hand_eye(truth: Truth, target: str, p: dict) -> None:
    truth.cell["camera"]["T_E_C"] = p["T_E_C"]


def laser_mount(truth: Truth, target: str, p: dict) -> None:
    truth.cell["laser"]["T_E_L"] = p["T_E_L"]


def laser_bias(truth: Truth, target: str, p: dict) -> None:
    def hook(s):
        s.z = s.z + p["bias"] * ((s.z - 0.19) / 0.05) ** 2

    truth.hooks["range"].append(hook)


def laser_lag(truth: Truth, target: str, p: dict) -> None:
    truth.laser_lag = p["lag"]


def contact_stiffness(truth: Truth, target: str, p: dict) -> None:
    truth.cell["contact"]["stiffness"] = p["stiffness"]


def contact_hardening(truth: Truth, target: str, p: dict) -> None:
    truth.hardening = p["hardening"]


def contact_friction(truth: Truth, target: str, p: dict) -> None:
    truth.cell["contact"]["friction"] = p["friction"]


def gripper_compliance(truth: Truth, target: str, p: dict) -> None:
    truth.lateral, truth.axial = p["lateral"], p["axial"]


def tube_tilt(truth: Truth, target: str, p: dict) -> None:
    truth.tube_turn = Rotation.from_euler("xyz", [*p["tilt"], 0.0]).as_matrix()


def tube_shift(truth: Truth, target: str, p: dict) -> None:
    truth.tube_shift = np.asarray(p["shift"], float)


def tube_radius(truth: Truth, target: str, p: dict) -> None:
    truth.cell["tube"]["inner_radius"] = p["inner_radius"]
