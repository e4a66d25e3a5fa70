"""Force models against laws whose constants are known."""

import numpy as np
import pandas as pd
import pytest

from swarf import SwarfError
from swarf.forces import (
    ShearPlane,
    cutting_coefficients,
    kienzle,
    milling_forces,
    oblique,
    shear_plane,
)

FEEDS = np.array([0.05e-3, 0.1e-3, 0.2e-3, 0.4e-3])


def rows(cutting, thrust=None, **further):
    thrust = 0.5 * cutting if thrust is None else thrust
    table = {"feed": FEEDS, "workpiece.width": 2e-3, "cutting_force": cutting, "thrust_force": thrust}
    return pd.DataFrame({**table, **further})


def test_kienzle_finds_a_law_again():
    """F = 1700 N/mm² · b · h^0.75 with b = 2 mm: exact, and the interval closes."""
    force = 1700.0 * 2.0 * (FEEDS * 1e3) ** 0.75
    found = kienzle(rows(force))
    assert found.kc11.value == pytest.approx(1700.0, rel=1e-6)
    assert found.mc.value == pytest.approx(0.25, rel=1e-6)
    assert found.kc11.high - found.kc11.low < 1e-6 * 1700
    assert found.force(0.3e-3, 2e-3) == pytest.approx(3400.0 * 0.3**0.75, rel=1e-6)
    assert "N/mm²" in str(found)


def test_kienzles_interval_holds_the_truth_as_often_as_it_says():
    """90 % intervals of 400 noisy laws: 360 ± 18 (three standard deviations of a binomial) hold m_c."""
    rng = np.random.default_rng(5)
    law = 1700.0 * 2.0 * (FEEDS * 1e3) ** 0.75
    inside = 0
    for _ in range(400):
        mc = kienzle(rows(law * np.exp(rng.normal(0, 0.05, 4))), confidence=0.9).mc
        inside += mc.low <= 0.25 <= mc.high
    assert abs(inside - 360) <= 18, inside


def test_kienzle_refuses_what_it_cannot_fit():
    with pytest.raises(SwarfError, match="two feeds"):
        kienzle(rows(np.ones(4), feed=1e-4))
    with pytest.raises(SwarfError, match="lacks thrust_force"):
        kienzle(rows(np.ones(4)).drop(columns="thrust_force"), "thrust_force")


def test_two_feeds_leave_no_interval():
    found = kienzle(rows(np.array([100.0, 170, 280, 470])).iloc[:2])
    assert np.isnan(found.mc.error) and found.mc.value > 0


def test_edge_coefficients_of_straight_lines():
    """K_tc = 1500 N/mm², K_te = 20 N/mm, K_fc = 600 N/mm², K_fe = 25 N/mm."""
    found = cutting_coefficients(rows(2e-3 * (1.5e9 * FEEDS + 2e4), 2e-3 * (6e8 * FEEDS + 2.5e4)))
    for value, expected in (
        (found.tangential, 1.5e9),
        (found.tangential_edge, 2e4),
        (found.feed, 6e8),
        (found.feed_edge, 2.5e4),
    ):
        assert value.value == pytest.approx(expected, rel=1e-9)
    assert "K_tc = 1500" in str(found)


PLANE = ShearPlane(613e6, np.radians(30), np.radians(25), np.radians(10))


def orthogonal_forces(plane, edges=(1e4, 1.5e4)):
    """Merchant's circle with edge forces: a table as a study of the plane would have it."""
    phi, beta, rake = plane.shear_angle, plane.friction_angle, plane.rake
    resultant = plane.shear_stress * FEEDS * 2e-3 / (np.sin(phi) * np.cos(phi + beta - rake))
    ratio = np.sin(phi) / np.cos(phi - rake)
    return rows(
        resultant * np.cos(beta - rake) + edges[0] * 2e-3,
        resultant * np.sin(beta - rake) + edges[1] * 2e-3,
        **{"tool.rake_angle": rake, "chip_thickness": FEEDS / ratio},
    )


def test_the_shear_plane_of_merchants_circle_is_found():
    found = shear_plane(orthogonal_forces(PLANE))
    assert found.shear_stress == pytest.approx(613e6, rel=1e-9)
    assert found.shear_angle == pytest.approx(PLANE.shear_angle, rel=1e-9)
    assert found.friction_angle == pytest.approx(PLANE.friction_angle, rel=1e-9)


def test_without_inclination_the_oblique_cut_is_the_orthogonal_one():
    """The coefficients of the transformation equal those of the straight lines; nothing acts across."""
    table = orthogonal_forces(PLANE)
    lines = cutting_coefficients(table)
    found = oblique(shear_plane(table), 0.0, lines)
    assert found.tangential.value == pytest.approx(lines.tangential.value, rel=1e-9)
    assert found.feed.value == pytest.approx(lines.feed.value, rel=1e-9)
    assert found.radial.value == pytest.approx(0.0, abs=1e-3)


def test_an_oblique_cut_obeys_the_mechanics_it_stands_for():
    """Its resultant, resolved again: shear stress along the shear plane, friction along the chip flow on the
    face.

    Axes: x along the speed normal to the edge, y normal to the machined surface, z along the edge.
    """
    i = np.radians(30)
    found = oblique(PLANE, i, cutting_coefficients(orthogonal_forces(PLANE)))
    t, f, r = found.tangential.value, found.feed.value, found.radial.value
    # Force on the tool per width and feed: along the velocity, normal to the surface, and across.
    along, across = np.array([np.cos(i), 0, np.sin(i)]), np.array([-np.sin(i), 0, np.cos(i)])
    force = t * along + f * np.array([0, 1.0, 0]) - r * across
    rake, phi = PLANE.rake, PLANE.shear_angle
    face_normal = np.array([np.cos(rake), -np.sin(rake), 0])
    up_face = np.array([np.sin(rake), np.cos(rake), 0])
    normal = force @ face_normal
    tangent = np.array([force @ up_face, force[2]])
    # Friction along the chip flow at η = i (Stabler), with Coulomb's angle β.
    assert np.hypot(*tangent) / normal == pytest.approx(np.tan(PLANE.friction_angle), rel=1e-9)
    assert tangent[1] / tangent[0] == pytest.approx(np.tan(i), rel=1e-9)
    # The shear stress on a plane of area b h/(sin φ cos i).
    sheared = np.hypot(force @ np.array([np.cos(phi), -np.sin(phi), 0]), force[2])
    assert sheared * np.sin(phi) * np.cos(i) == pytest.approx(PLANE.shear_stress, rel=1e-9)


def test_a_slots_mean_forces_are_the_closed_ones():
    """Means over a revolution of a slot without helix (Altintas 2012, section 2.8.2)."""
    lines = cutting_coefficients(orthogonal_forces(PLANE))
    k = oblique(shear_plane(orthogonal_forces(PLANE)), np.radians(30), lines)
    n, a, c = 4, 5e-3, 0.1e-3
    mean = milling_forces(k, diameter=20e-3, teeth=n, feed_per_tooth=c, depth=a, steps=7200, slices=1).mean()
    x = -n * a / 4 * k.feed.value * c - n * a / np.pi * k.feed_edge.value
    y = n * a / 4 * k.tangential.value * c + n * a / np.pi * k.tangential_edge.value
    z = n * a / np.pi * k.radial.value * c + n * a / 2 * k.radial_edge.value
    # The rule of midpoints over 7200 steps.
    assert mean["Fx"] == pytest.approx(x, rel=1e-6)
    assert mean["Fy"] == pytest.approx(y, rel=1e-6)
    assert mean["Fz"] == pytest.approx(z, rel=1e-6)


def test_a_helix_smooths_and_keeps_the_mean():
    """It shifts slices along the revolution only."""
    lines = cutting_coefficients(orthogonal_forces(PLANE))
    keywords = {"diameter": 10e-3, "teeth": 2, "feed_per_tooth": 0.1e-3, "depth": 10e-3}
    straight, helical = (milling_forces(lines, helix=h, **keywords)["Fy"] for h in (0.0, np.radians(30)))
    assert helical.mean() == pytest.approx(straight.mean(), rel=1e-3)
    assert np.ptp(helical) < 0.8 * np.ptp(straight)
