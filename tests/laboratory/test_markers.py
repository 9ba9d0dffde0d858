"""Marker tracking: law of cosines, zones, lost markers; and the full-field map."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from weftform.errors import MeasurementError
from weftform.laboratory import read_shear_field, sample, shear_field, track_markers
from weftform.laboratory.kinematics import kinematic_angle
from weftform.laboratory.markers import MarkerLayout, corner_angle, quadruple_angles, read_layout
from weftform.laboratory.samples import measured_angle

LAYOUT = MarkerLayout.model_validate({"quadruple": [{"name": "q", "zone": "B", "markers": ["n", "e", "s", "w"]}]})


def _rhombus(angle: float, side: float = 10.0) -> np.ndarray:
    half = np.pi / 4 - angle / 2
    a, b = side * np.sin(half), side * np.cos(half)
    return np.array([[0, b], [a, 0], [0, -b], [-a, 0]])


@given(st.floats(0.05, 3.0), st.floats(0.1, 10), st.floats(0.1, 10), st.floats(-3, 3))
def test_law_of_cosines(angle, a, b, turn) -> None:
    before = a * np.array([np.cos(turn), np.sin(turn)])
    after = b * np.array([np.cos(turn + angle), np.sin(turn + angle)])
    assert float(corner_angle(before, np.zeros(2), after)) == pytest.approx(angle, abs=1e-6)


@settings(deadline=None)
@given(st.floats(-0.9, 0.9), st.floats(-3, 3), st.floats(-50, 50))
def test_a_rhombus_gives_its_shear_angle_wherever_it_goes(shear, turn, shift) -> None:
    turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    corners = np.stack([_rhombus(0.0), _rhombus(shear) @ turned.T + shift])
    assert quadruple_angles(corners)[1] == pytest.approx(shear, abs=1e-6)
    other = np.roll(corners, 1, axis=1)
    assert quadruple_angles(other)[1] == pytest.approx(shear, abs=1e-6)
    assert quadruple_angles(corners, "x")[1] == pytest.approx(-shear, abs=1e-6)


def test_positions_in_space_give_the_same_angle(text) -> None:
    """The plane of the specimen stands askew to the cameras."""
    tilt = np.array([[1.0, 0.0], [0.0, np.cos(0.4)], [0.0, np.sin(0.4)]])
    rows = ["image,marker,displacement_mm,x_mm,y_mm,z_mm"]
    for image, shear in enumerate((0.0, 0.2, 0.4)):
        for name, p in zip("nesw", _rhombus(shear) @ tilt.T, strict=True):
            rows.append(
                f"{image},{name},{image * 5.0},{p[0]!r},{p[1]!r},{p[2]!r}".replace("np.float64(", "").replace(")", "")
            )
    tracking = track_markers(text("a.csv", "\n".join(rows)), LAYOUT)
    np.testing.assert_allclose(np.radians(tracking.zone("B").mean), [0.0, 0.2, 0.4], atol=1e-9)


def _rows(drop=(), empty=()) -> str:
    rows = ["image,marker,displacement_mm,x_mm,y_mm"]
    for image in range(12):
        for name, p in zip("nesw", _rhombus(0.05 * image), strict=True):
            if (image, name) in drop:
                continue
            xy = "," if (image, name) in empty else f"{float(p[0])!r},{float(p[1])!r}"
            rows.append(f"{image},{name},{image * 1.0},{xy}")
    return "\n".join(rows)


def test_one_lost_marker_costs_nothing_but_a_warning(text) -> None:
    tracking = track_markers(text("a.csv", _rows(drop=[(4, "e")], empty=[(5, "n"), (6, "n")])), LAYOUT)
    np.testing.assert_allclose(np.radians(tracking.zone("B").mean), 0.05 * np.arange(12), atol=1e-9)
    assert any("marker e lost in 1 of 12 images (4)" in w for w in tracking.warnings)
    assert any("marker n lost in 2 of 12 images (5, 6)" in w for w in tracking.warnings)


def test_two_lost_markers_leave_a_gap(text) -> None:
    tracking = track_markers(text("a.csv", _rows(drop=[(4, "e"), (4, "n")])), LAYOUT)
    zone = tracking.zone("B")
    assert np.isnan(zone.mean[4]) and zone.count[4] == 0 and np.isfinite(np.delete(zone.mean, 4)).all()
    assert any("cannot be measured in 1 images" in w for w in tracking.warnings)


def test_marker_lost_in_the_reference_image(text) -> None:
    with pytest.raises(MeasurementError, match="complete in the first image") as caught:
        track_markers(text("a.csv", _rows(drop=[(0, "e")])), LAYOUT)
    assert "marker e is not in image 0" in caught.value.got


def test_marker_that_is_nowhere_twice_or_unplaced(text) -> None:
    drop = [(i, "e") for i in range(12)]
    with pytest.raises(MeasurementError, match="marker e of the layout is in no image"):
        track_markers(text("a.csv", _rows(drop=drop)), LAYOUT)
    with pytest.raises(MeasurementError, match="appears twice") as caught:
        track_markers(text("b.csv", _rows() + "\n11,n,11.0,0,0"), LAYOUT)
    assert caught.value.line == 50
    lines = [",".join(r.split(",")[:2] + r.split(",")[3:]) for r in _rows().splitlines()]
    with pytest.raises(MeasurementError, match="displacement of the crosshead"):
        track_markers(text("c.csv", "\n".join(lines)), LAYOUT)
    table = text("d.csv", "image,displacement_mm\n" + "\n".join(f"{i},{2.0 * i}" for i in range(12)))
    tracking = track_markers(text("c.csv", "\n".join(lines)), LAYOUT, displacements=table)
    assert tracking.displacement.tolist() == [2.0 * i for i in range(12)]


def test_layout_errors_name_the_place(text) -> None:
    with pytest.raises(MeasurementError, match="did you mean zone") as caught:
        read_layout(text("l.toml", '[[quadruple]]\nname = "q"\nzon = "B"\nmarkers = ["a", "b", "c", "d"]\n'))
    assert caught.value.line is not None
    with pytest.raises(MeasurementError, match="names a marker twice"):
        read_layout(text("m.toml", '[[quadruple]]\nname = "q"\nzone = "B"\nmarkers = ["a", "b", "c", "a"]\n'))


def test_shipped_markers_by_zone_and_half() -> None:
    tracking = track_markers(sample("bias-extension-markers")[0], sample("bias-extension-layout")[0])
    truth = np.degrees(measured_angle(tracking.displacement))
    # 0.02 mm of noise on sides of 8 mm: 0.3 deg for one quadruple against its reference image, five times
    # that here.
    for zone, share in (("A", 0.06), ("B", 1.0), ("C", 0.45)):
        for half in (None, "upper", "lower"):
            np.testing.assert_allclose(tracking.zone(zone, half).mean, share * truth, atol=1.5)
    assert tracking.zone("B").deviation[1:].mean() < 0.6
    assert sum("lost" in w for w in tracking.warnings) == 2
    with pytest.raises(MeasurementError, match="no quadruple in zone A, centre half"):
        tracking.zone("A", "centre")


@settings(max_examples=30, deadline=None)
@given(st.floats(-0.8, 0.8), st.floats(-3, 3), st.floats(0.9, 1.2))
def test_full_field_is_exact_for_a_uniform_trellis(shear, turn, stretch) -> None:
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-10, 10, (2, 60))
    f = stretch * np.diag([np.sqrt(1 - np.sin(shear)), np.sqrt(1 + np.sin(shear))])
    f = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ f
    moved = f @ np.stack([x, y])
    field = shear_field(x, y, moved[0] - x, moved[1] - y)
    np.testing.assert_allclose(np.radians(field.angle), shear, atol=1e-6)


def test_full_field_of_the_exports_and_its_limits() -> None:
    for name in ("dic-aramis", "dic-vic3d"):
        field = read_shear_field(sample(name)[0])
        assert field.angle.mean() == pytest.approx(20.0, abs=0.1)
    with pytest.raises(MeasurementError, match="triangulated"):
        shear_field(np.arange(5.0), np.arange(5.0), np.zeros(5), np.zeros(5))


def test_kinematic_angle_agrees_with_the_markers_before_slip() -> None:
    tracking = track_markers(sample("bias-extension-markers")[0], sample("bias-extension-layout")[0])
    before = tracking.displacement < 16.0
    expected = np.degrees(kinematic_angle(tracking.displacement[before], 150, 50))
    np.testing.assert_allclose(tracking.zone("B").mean[before], expected, atol=0.6)
