"""Identification of dynamics from Python: shapes, names, errors."""

import numpy as np
import pytest
from kr5 import InvalidArgument
from kr5.identification import (
    DynamicsModel,
    DynamicsOptions,
    DynamicsRegressor,
    JointMotion,
    base_parameters,
    identify_dynamics,
    identify_payload,
    predict_torques,
)
from kr5.kinematics import (
    Body,
    DhChain,
    DhJoint,
    Dynamics,
    InertialRegressor,
    denoc,
    denoc_torques,
    inertial_parameters,
)

CHAIN = DhChain([DhJoint(b=0.4, alpha=np.pi / 2), DhJoint(a=0.5), DhJoint(a=0.3)])
BODIES = [Body(mass=5.0, com=[0.1 * i, 0.02, 0.03], inertia=[0.1, 0.12, 0.09, 0.01, 0.0, 0.02]) for i in range(3)]


def sines(n: int = 400) -> JointMotion:
    t = np.linspace(0, 12, n)
    angle = np.outer(t, [1.1, 1.7, 2.3]) + np.array([0.0, 1.0, 2.0])
    fast = 2.6 * angle
    return JointMotion(
        t=t,
        q=np.sin(angle) + 0.3 * np.sin(fast),
        qd=np.cos(angle) * [1.1, 1.7, 2.3] + 0.78 * np.cos(fast) * [1.1, 1.7, 2.3],
        qdd=-np.sin(angle) * np.square([1.1, 1.7, 2.3]) - 2.028 * np.sin(fast) * np.square([1.1, 1.7, 2.3]),
        tau=np.zeros((n, 3)),
    )


def with_torques(motion: JointMotion, friction: float = 2.0) -> JointMotion:
    tau = Dynamics(CHAIN, BODIES).loads(motion.q, motion.qd, motion.qdd)[0] + friction * np.tanh(motion.qd / 0.002)
    return JointMotion(t=motion.t, q=motion.q, qd=motion.qd, qdd=motion.qdd, tau=tau)


def test_regressor_and_denoc_agree_with_newton_euler():
    motion = sines(20)
    tau = Dynamics(CHAIN, BODIES).loads(motion.q, motion.qd, motion.qdd)[0]
    Y = InertialRegressor(CHAIN).evaluate(motion.q, motion.qd, motion.qdd)
    chi = np.concatenate([inertial_parameters(b) for b in BODIES])
    np.testing.assert_allclose((Y @ chi).reshape(-1, 3), tau, atol=1e-10)
    state = motion.q[3], motion.qd[3], motion.qdd[3]
    np.testing.assert_allclose(denoc_torques(CHAIN, BODIES, *state), tau[3], atol=1e-10)
    np.testing.assert_allclose(denoc(CHAIN, *state).regressor(), Y[9:12], atol=1e-10)


def test_friction_is_found_and_the_held_out_part_predicted():
    motion = with_torques(sines())
    result = identify_dynamics(motion, DynamicsModel(chain=CHAIN))
    assert result.fit.usable
    assert result.parameter("fc2")[0] == pytest.approx(2.0, abs=1e-6)
    assert result.parameter("nothing") is None
    assert result.held_out.total < 1e-7
    np.testing.assert_allclose(predict_torques(result, motion), motion.tau, atol=1e-6)
    assert len(result.values) == base_parameters(DynamicsModel(chain=CHAIN)).size
    names = DynamicsRegressor(DynamicsModel(chain=CHAIN)).names
    assert names[13:16] == ["I2xx", "I2xy", "I2xz"] and len(names) == 39


def test_the_estimator_is_named_and_errors_name_the_field():
    motion = with_torques(sines())
    model = DynamicsModel(chain=CHAIN)
    consistent = identify_dynamics(motion, model, DynamicsOptions(estimator="consistent", prior_bodies=BODIES))
    assert all(b.mass > 0 for b in consistent.bodies)
    with pytest.raises(InvalidArgument, match="instruments: the estimator needs"):
        identify_dynamics(motion, model, DynamicsOptions(estimator="instruments"))
    with pytest.raises(InvalidArgument, match="parameters: expected 39 values, found 3"):
        identify_payload(motion, model, np.zeros(3))
