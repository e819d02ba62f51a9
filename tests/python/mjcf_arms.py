"""Arms in MuJoCo for tests: random ones, and what MuJoCo itself says of them."""

import xml.etree.ElementTree as xml

import numpy as np


def text(values):
    return " ".join(repr(float(v)) for v in np.atleast_1d(values))


def random_quaternion(random):
    q = random.normal(size=4)
    return q / np.linalg.norm(q)


def random_inertia(random, mass):
    """Moments that a body of some points has."""
    points = random.uniform(-0.15, 0.15, (6, 3))
    weights = random.uniform(0.5, 1.5, 6)
    weights *= mass / weights.sum()
    points = points - weights @ points / mass
    moments = sum(w * (p @ p * np.eye(3) - np.outer(p, p)) for w, p in zip(weights, points))
    return [moments[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def add_inertial(body, random):
    mass = random.uniform(0.3, 4.0)
    values = {"pos": random.uniform(-0.1, 0.1, 3), "mass": mass, "fullinertia": random_inertia(random, mass)}
    xml.SubElement(body, "inertial", {key: text(v) for key, v in values.items()})


def add_body(parent, name, random):
    where = {"pos": text(random.uniform(-0.3, 0.3, 3)), "quat": text(random_quaternion(random))}
    body = xml.SubElement(parent, "body", {"name": name, **where})
    add_inertial(body, random)
    return body


def random_arm(seed, joints=5):
    """A text: hinges and slides off the frames of their bodies, with references, sometimes two in a body, bodies fixed
    between and beside, a finger, drives, and gravity of any direction."""
    random = np.random.default_rng(seed)
    root = xml.Element("mujoco", {"model": f"arm{seed}"})
    xml.SubElement(root, "compiler", {"angle": "radian"})
    xml.SubElement(root, "option", {"gravity": text(random.uniform(-9, 9, 3))})
    at = xml.SubElement(xml.SubElement(root, "worldbody"), "body", {"name": "base", "pos": "0.1 0.2 0.3"})
    k = 0
    while k < joints:
        at = add_body(at, f"link{k}", random)
        for _ in range(2 if random.uniform() < 0.2 and k + 1 < joints else 1):
            slides = random.uniform() < 0.25
            axis = random.normal(size=3)
            values = {
                "axis": axis / np.linalg.norm(axis),
                "pos": random.uniform(-0.1, 0.1, 3),
                "ref": random.uniform(-0.2, 0.2) if random.uniform() < 0.5 else 0.0,
                "damping": random.uniform(0, 3),
                "armature": random.uniform(0, 0.3),
                "frictionloss": random.uniform(0, 2),
                "range": [-2.0, 1.5],
            }
            kind = {"name": f"j{k}", "type": "slide" if slides else "hinge", "limited": "true"}
            xml.SubElement(at, "joint", kind | {key: text(v) for key, v in values.items()})
            k += 1
        if random.uniform() < 0.3:
            at = add_body(at, f"plate{k}", random)
    add_body(at, "cover", random)
    finger = add_body(at, "finger", random)
    xml.SubElement(finger, "joint", {"name": "grip", "type": "slide", "axis": "0 1 0", "ref": "0.02"})
    xml.SubElement(at, "site", {"name": "tcp", "pos": "0.02 0.03 0.1", "quat": text(random_quaternion(random))})
    xml.indent(root)
    return xml.tostring(root, encoding="unicode")


def states(model, names, seed, count=6):
    """Random positions, speeds and accelerations of the named joints."""
    random = np.random.default_rng(seed)
    return random.uniform(-1.5, 1.5, (count, 3, len(names)))


class MujocoArm:
    """A model of MuJoCo: where its tip is, and which torques move it."""

    def __init__(self, model, names):
        import mujoco

        self.mujoco, self.model, self.data = mujoco, model, mujoco.MjData(model)
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT  # frictionloss, limits, contacts
        ids = [model.joint(name).id for name in names]
        self.qpos, self.dof = model.jnt_qposadr[ids], model.jnt_dofadr[ids]

    def place(self, q, qd=0.0, qdd=0.0):
        d = self.data
        d.qpos[:], d.qvel[:], d.qacc[:] = self.model.qpos0, 0.0, 0.0
        d.qpos[self.qpos], d.qvel[self.dof], d.qacc[self.dof] = q, qd, qdd

    def tip(self, q, name, kind="body"):
        """Pose in the world of a body or a site."""
        self.place(q)
        self.mujoco.mj_kinematics(self.model, self.data)
        found = getattr(self.data, kind)(name)
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = found.xmat.reshape(3, 3), found.xpos
        return T

    def torques(self, q, qd, qdd):
        self.place(q, qd, qdd)
        self.mujoco.mj_inverse(self.model, self.data)
        return self.data.qfrc_inverse[self.dof].copy()


def cell_torques(cell, q, qd, qdd):
    """The same by a cell: motion of links, tool and rotors, and viscous friction."""
    from kr5.kinematics import Body, Dynamics

    bodies = [Body(**link.to_dict()) for link in cell.robot.links]
    n = cell.robot.joints
    dynamics = Dynamics(cell.nominal_chain(), bodies or [Body()] * n, cell.robot.gravity)
    if cell.tool is not None:
        tool = Body(mass=cell.tool.mass, com=cell.tool.com, inertia=cell.tool.inertia)
        dynamics.add_body(n - 1, tool, cell.tool.T_flange_sensor)
    out = np.asarray(dynamics.torques(q, qd, qdd))
    if cell.drives is not None:
        S, J = np.asarray(cell.drives.structure), np.asarray(cell.drives.rotor_inertia)
        out = out + S.T @ np.diag(J) @ S @ qdd + np.asarray(cell.drives.friction.viscous) * qd
    return out
