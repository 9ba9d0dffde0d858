"""The material point below a place in plan view is the inverse of the probe."""

from __future__ import annotations

import numpy as np
import pytest

POINTS = [(0.0, 0.0), (13.0, 21.0), (-40.0, 7.0), (-33.0, -28.0), (24.0, -52.0)]


@pytest.mark.parametrize("name", ["along_yarns", "along_bias"])
def test_inverse_of_the_probe_on_the_whole_blank(name, request) -> None:
    """Quarter models: points in all four quadrants, in whole and half cells."""
    result = request.getfixturevalue(name)
    for point, probe in zip(POINTS, result.probe(POINTS), strict=True):
        x, y, _ = probe.position_mm
        np.testing.assert_allclose(result.material_below(x, y), point, atol=1e-8)


def test_at_another_stroke(along_yarns) -> None:
    x, y, _ = along_yarns.probe([(13.0, 21.0)], 15.0)[0].position_mm
    np.testing.assert_allclose(along_yarns.material_below(x, y, 15.0), (13.0, 21.0), atol=1e-8)


def test_beside_the_part_there_is_nothing(along_yarns, along_bias) -> None:
    assert along_yarns.material_below(200.0, 0.0) is None
    assert along_bias.material_below(0.0, -90.0) is None


def test_covers_what_the_probe_takes(along_bias) -> None:
    assert along_bias.covers(0.0, 0.0) and along_bias.covers(-40.0, 7.0)
    assert not along_bias.covers(200.0, 0.0)
