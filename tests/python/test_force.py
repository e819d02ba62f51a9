"""The Python surface of kr5.force; the geometry is tested in C++."""

import math

import numpy as np
import pytest

import kr5
from kr5 import force

BOOK = force.PegTube(peg_radius=9.42e-3, inner_radius=9.7e-3, outer_radius=12.65e-3)
TILT = math.radians(7.5)


def test_heights_broadcast_and_are_those_of_the_single_call():
    alpha = np.linspace(0, 2 * np.pi, 5)
    heights = force.resting_heights(BOOK, TILT, alpha[:, None], np.array([-7.53e-3, 1.5e-3]), -7.2e-3)
    assert heights.shape == (5, 2)
    rest = force.rest_peg_on_tube(BOOK, TILT, alpha[1], [1.5e-3, -7.2e-3])
    assert heights[1, 1] == rest.height
    raised = force.resting_heights(BOOK, TILT, alpha, 0.008, 0.0, T_T_tube=kr5.from_xyzrpy(np.array([0, 0, 0.1, 0, 0, 0])))
    np.testing.assert_allclose(raised, force.resting_heights(BOOK, TILT, alpha, 0.008, 0.0) + 0.1, atol=1e-14)


def test_nothing_carries_a_peg_in_the_bore():
    assert str(force.rest_peg_on_tube(BOOK, 0.0, 0.0, [0, 0]).kind) == "none"
    assert math.isnan(force.resting_heights(BOOK, 0.0, 0.0, 0.0, 0.0))


def test_radii_that_cannot_be_are_named():
    with pytest.raises(kr5.InvalidArgument, match="outer_radius"):
        force.rest_peg_on_tube(force.PegTube(peg_radius=1, inner_radius=2, outer_radius=1), 0.1, 0, [0, 0])
    with pytest.raises(kr5.InvalidArgument, match="peg_length"):
        force.peg_tube_contacts(force.PegTubeShape(peg_radius=1), np.eye(4))


def test_contacts_give_a_wrench_and_keep_stiction():
    shape = force.PegTubeShape(peg_radius=9.42e-3, peg_length=0.05, inner_radius=9.7e-3, outer_radius=12.65e-3, tube_depth=0.06)
    T = np.eye(4)
    T[:3, 3] = [8e-3, 0, -1e-5]
    contacts = force.peg_tube_contacts(shape, T)
    stiction = force.Stiction()
    result = force.contact_wrench(contacts, force.ContactLaw(), T, [1e-3, 0, 0, 0, 0, 0], 1e-3, stiction)
    assert result.normal == pytest.approx(10)
    assert stiction.slip[0] == pytest.approx(1e-6)
    assert result.wrench[0] < 0
    bench = force.peg_bench_contacts(shape, T)
    assert len(bench) == 24 and bench[0].depth == pytest.approx(1e-5)
