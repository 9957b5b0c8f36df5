# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pictures and datasets, where matplotlib and xarray are installed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from batwing import bsdf, rcwa, simulate


def grating() -> rcwa.Grating:
    relief = rcwa.Relief.triangle(1.0, (0.8, 0.3), ridge=1.41, groove=1.0)
    return rcwa.Grating(relief, top=1.41, bottom=1.0)


def test_datasets_have_units() -> None:
    pytest.importorskip("xarray")
    found = rcwa.solve(grating(), 0.55, [0.0, 20.0], polarisation="both", orders=8, slices=4)
    data = found.to_xarray()
    assert data.reflected.dims == ("direction", "polarisation", "order_reflected")
    assert data.theta.attrs["units"] == "degree"
    np.testing.assert_array_equal(data.theta, found.theta_deg)
    assert float(data.wavelength) == 0.55
    total = data.reflected.sum("order_reflected") + data.transmitted.sum("order_transmitted")
    np.testing.assert_allclose(total, 1.0, atol=1e-10)
    every = rcwa.hemisphere(grating(), 0.55, kx_per_zone=2, ky=4, orders=8, slices=4)
    assert every.to_xarray().to_top.dims == ("node", "polarisation", "order_top")
    np.testing.assert_array_equal(every.to_xarray().theta, every.theta_deg)
    field = rcwa.near_field(grating(), 0.55, slices=4)
    assert field.to_xarray().electric.dims == ("z", "x", "component")


def test_datasets_of_wavelengths_concatenate_and_keep_amplitudes() -> None:
    xarray = pytest.importorskip("xarray")
    options: dict[str, Any] = {"orders": 8, "slices": 4, "jones": True}
    each = [rcwa.solve(grating(), w, [0.0, 20.0], **options) for w in (0.45, 0.65)]
    whole = xarray.concat([one.to_xarray() for one in each], "wavelength", join="outer")
    assert whole.wavelength.values.tolist() == [0.45, 0.65]
    for number, one in enumerate(each):
        part = whole.isel(wavelength=number).sel(order_transmitted=one.orders_transmitted)
        np.testing.assert_array_equal(part.transmitted, one.transmitted)
        np.testing.assert_array_equal(part.jones_transmitted, one.jones_transmitted)
    together = rcwa.solve(grating(), [[0.45], [0.65]], [0.0, 20.0], **options).to_xarray()
    dims = ("direction_0", "direction_1", "order_reflected", "out", "in")
    assert together.jones_reflected.dims == dims
    assert together.wavelength.values[:, 0].tolist() == [0.45, 0.65]
    alone = rcwa.jones(grating(), 0.45, [0.0, 20.0], orders=8, slices=4).to_xarray()
    np.testing.assert_array_equal(alone.reflected, each[0].jones_reflected)


def test_pictures_show_the_values() -> None:
    pytest.importorskip("matplotlib")
    found = rcwa.solve(grating(), 0.55, [0.0, 20.0, 40.0], orders=8, slices=4)
    line = found.plot().get_lines()[0]
    np.testing.assert_array_equal(line.get_ydata(), found.total_transmitted)
    one = rcwa.solve(grating(), 0.55, 10.0, orders=8, slices=4)
    assert "image/png" in one._repr_html_() and "total" not in one._repr_html_()
    assert grating().relief.plot().patches
    field = rcwa.near_field(grating(), 0.55, slices=4)
    assert field.plot().collections
    every = rcwa.hemisphere(grating(), 0.55, kx_per_zone=2, ky=4, orders=8, slices=4)
    assert every.plot().collections
    table = bsdf.build(grating(), 0.55, orders=8, slices=4, kx_per_zone=2, ky=4)
    assert len(table.plot().get_lines()) == 4


def test_results_have_a_picture_and_a_dataset() -> None:
    results = simulate.run(simulate.Design.template(), model="geometric", paths=16_384)
    if pytest.importorskip("matplotlib"):
        assert "image/png" in results._repr_html_()
    pytest.importorskip("xarray")
    data = results.to_xarray()
    assert float(data.extraction_efficiency_standard_error[0]) > 0
    far = results.model("geometric").far_field()
    assert far is not None
    curve = far.to_xarray()
    assert curve.intensity.dims == ("theta",) and curve.intensity.attrs["units"] == "1/sr"
    np.testing.assert_array_equal(curve.standard_error, far.standard_error)
