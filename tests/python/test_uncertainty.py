"""Sensitivity and propagation of uncertainty from Python."""

import kr5
import numpy as np
import pytest
from kr5 import uncertainty


def test_sobol_indices_of_a_python_model():
    inputs = [uncertainty.UncertainInput(name=f"x{k}", sigma=float(k + 1), truncation=8.0) for k in range(3)]
    found = uncertainty.sobol_indices(
        lambda x: np.column_stack([x.sum(axis=1), x[:, 0] * x[:, 1]]),
        inputs,
        uncertainty.SobolOptions(samples=2048),
    )
    assert np.allclose(found.first[:, 0], np.array([1, 4, 9]) / 14, atol=0.02)
    # A product of two inputs without mean is nothing but interaction: a standard error of 0.044 at 2048 samples.
    assert np.allclose(found.first[:, 1], 0, atol=0.15) and np.allclose(found.total[:2, 1], 1, atol=0.15)
    assert found.evaluations == 2048 * 5
    with pytest.raises(kr5.InvalidArgument, match="rows of outputs"):
        uncertainty.sobol_indices(lambda x: np.zeros((3, 1)), inputs)


def test_poses_points_and_functions_carry_their_covariance():
    a = kr5.UncertainPose(T=kr5.to_pose([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]), covariance=1e-6 * np.eye(6))
    there_and_back = a @ a.inverse()
    assert np.allclose(there_and_back.T, np.eye(4))
    assert there_and_back.covariance[0, 0] > 1e-6
    point = kr5.transform_point(a, [0, 0, 0.34], np.zeros((3, 3)))
    assert np.trace(point.covariance) == pytest.approx(3e-6 + 2 * 0.34**2 * 1e-6)
    assert np.trace(kr5.transform_point(a, [0, 0, 0.34], np.zeros((3, 3)), False).covariance) == pytest.approx(3e-6)
    first = kr5.propagate(lambda x: np.array([x[0] * x[1]]), [2.0, 3.0], np.diag([0.01, 0.04]))
    second = kr5.propagate_unscented(lambda x: np.array([x[0] * x[1]]), [2.0, 3.0], np.diag([0.01, 0.04]))
    assert first.covariance[0, 0] == pytest.approx(9 * 0.01 + 4 * 0.04, rel=1e-6)
    assert second.covariance[0, 0] == pytest.approx(first.covariance[0, 0], rel=0.01)
    fused = kr5.fuse([kr5.UncertainVector(value=[1.0], covariance=[[1.0]]), first])
    assert fused.covariance[0, 0] < first.covariance[0, 0]
    assert not kr5.is_covariance(np.array([[1.0, 2.0], [2.0, 1.0]]))
