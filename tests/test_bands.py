"""Steps on large arrays in bands, against the same in one step."""

import numpy as np
import pytest

from rangeedge import bands
from rangeedge.surfaces import without_rims


@pytest.fixture(autouse=True, params=[1, 50, 1 << 20])
def size(request, monkeypatch):
    """Values of a band: less than a row, some rows, more than there are."""
    monkeypatch.setattr(bands, "_SIZE", request.param)
    return request.param


def test_bands_cover_all_rows_once():
    for shape in ((1, 1), (7, 9), (100, 3), (13,), (0,), (5, 0)):
        rows = [row for own in bands.bands(np.zeros(shape)) for row in range(own.start, own.stop)]
        assert rows == list(range(shape[0]))


def test_rows_alone():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(31, 12, 3)), rng.normal(size=(31, 12)).astype(np.float32)
    result = bands.by_bands(lambda a, nothing, b: a[..., 0] + b if nothing is None else None, a, None, b)
    assert result.dtype == np.float64
    assert np.array_equal(result, a[..., 0] + b)
    assert bands.by_bands(np.sqrt, np.zeros((0, 3))).shape == (0, 3)


@pytest.mark.parametrize("halo", [1, 3])
def test_rows_with_those_around(halo):
    values = np.random.default_rng(0).integers(0, 99, (23, 5))

    def sums(rows):
        return np.stack([rows[max(0, k - halo) : k + halo + 1].sum(axis=0) for k in range(len(rows))])

    assert np.array_equal(bands.by_bands(sums, values, halo=halo), sums(values))


def test_rims_do_not_depend_on_bands(size, monkeypatch):
    labels = np.kron(np.random.default_rng(0).integers(-1, 4, (4, 5)), np.ones((17, 13))).astype(np.int32)
    found = without_rims(np.maximum(labels, 0))
    monkeypatch.setattr(bands, "_SIZE", labels.size)
    assert np.array_equal(found, without_rims(np.maximum(labels, 0)))
    assert (found != np.maximum(labels, 0)).any()


@pytest.mark.parametrize("scale", [1, 10**7])
@pytest.mark.parametrize("dtype", [np.int32, np.int64, np.uint8, np.uint16])
def test_different_integers(dtype, scale):
    if scale > np.iinfo(dtype).max // 99:
        pytest.skip("too large")
    low = -20 if np.issubdtype(dtype, np.signedinteger) else 0
    for shape in ((40, 9), (300,), (0,)):
        values = (np.random.default_rng(0).integers(low, 21, shape) * scale).astype(dtype)
        names, number = np.unique(values, return_inverse=True)
        found, which = bands.numbered(values)
        assert np.array_equal(bands.distinct(values), names)
        assert np.array_equal(found, names)
        assert np.array_equal(which, number.reshape(shape))
        assert np.array_equal(bands.counts(which, len(names)), np.unique(values, return_counts=True)[1])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_quantiles(dtype):
    rng = np.random.default_rng(0)
    shares = [0.0, 0.01, 0.3, 0.5, 0.75, 1.0]
    images = [
        rng.normal(size=(50, 41)),
        np.exp(rng.normal(size=999) * 20),
        -np.exp(rng.normal(size=999) * 20),
        rng.integers(-2, 3, 1000),
        np.full((9, 9), -3.5),
        np.array([2.0, np.nan, -1.0, np.inf, -np.inf, 0.0, -0.0, 5e-324]),
        np.where(rng.random(500) < 0.5, np.nan, rng.normal(size=500)),
        np.array([7.0]),
    ]
    for values in images:
        values = values.astype(dtype)
        with np.errstate(invalid="ignore"):  # between infinities
            expected = np.nanquantile(values.astype(float), shares)
            found = bands.quantiles(values, *shares)
        np.testing.assert_allclose(found, expected, rtol=1e-15)
    assert np.isnan(bands.quantiles(np.full((3, 3), np.nan, dtype), 0.5, 0.6)).all()
