"""Shapes and types: what is taken, and what is refused by the library's own exceptions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import btfield

shapes = st.one_of(hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=40),
                   hnp.array_shapes(min_dims=3, max_dims=3, min_side=1, max_side=12))
good_types = st.sampled_from([np.uint8, np.uint16, np.float32])


@st.composite
def pictures(draw):
    """Of any shape and type that is taken, laid out in any way."""
    shape, dtype = draw(shapes), draw(good_types)
    picture = np.random.default_rng(draw(st.integers(0, 2**32))).random(shape)
    if dtype != np.float32:
        picture = picture * np.iinfo(dtype).max
    picture = picture.astype(dtype)
    if draw(st.booleans()):
        picture = np.asfortranarray(picture)
    if draw(st.booleans()):
        picture = picture[::-1]
    if draw(st.booleans()):
        picture = picture[:, ::2]
    if draw(st.booleans()):
        picture.flags.writeable = False
    return picture


@given(pictures())
@settings(max_examples=150, deadline=None)
def test_values_arrive(picture):
    values = btfield.unit_of(picture).reshape(*picture.shape[:2], -1).astype(float)
    found = btfield.lag_covariance(picture, (0, 0))
    assert found.size == picture.shape[:2]
    assert found.planes == values.shape[2]
    assert np.allclose(found.mean, values.mean((0, 1)), rtol=0, atol=1e-6)


@given(hnp.arrays(dtype=st.one_of(hnp.boolean_dtypes(), hnp.integer_dtypes(), hnp.unsigned_integer_dtypes(),
                                  hnp.floating_dtypes(), hnp.complex_number_dtypes(), hnp.unicode_string_dtypes()),
                  shape=hnp.array_shapes(min_dims=0, max_dims=5, min_side=0, max_side=4)))
@settings(max_examples=150, deadline=None)
def test_others_are_refused(array):
    taken = array.dtype in (np.uint8, np.uint16, np.float32) and array.dtype.isnative
    if taken and array.ndim in (2, 3) and array.size > 0 and np.isfinite(array).all():
        return
    with pytest.raises(btfield.InputError) as refused:
        btfield.kappa(array)
    assert refused.value.asked and refused.value.found and refused.value.remedy
    assert str(refused.value).startswith(refused.value.asked)


@pytest.mark.parametrize("thing", ["cork.png", 3, [[1, 2], [3, 4]], object()])
def test_things_are_refused(thing):
    with pytest.raises(btfield.InputError, match="NumPy array"):
        btfield.kappa(thing)


def test_not_finite(device, small):
    picture = btfield.unit_of(small)
    picture[3, 4, 1] = np.nan
    with pytest.raises(btfield.InputError):
        btfield.fit(device, picture)
    with pytest.raises(ValueError):  # which InputError is, too
        btfield.memd(device, picture, small)


def test_options(device, small):
    with pytest.raises(TypeError, match="did you mean 'order'"):
        btfield.fit(device, small, ordr=3)
    with pytest.raises(btfield.InputError, match="3d-carr"):
        btfield.fit(device, small, model="3d-carr")
    with pytest.raises(TypeError):
        btfield.fit(device, small, order="many")
    options = btfield.FitOptions(model="2d-msar", order=2, prior=btfield.BayesPrior(strength=0.5))
    assert (options.model, options.order, options.prior.strength) == ("2d-msar", 2, 0.5)
    assert btfield.fit(device, small, options, model="2d-car").kind == "2d-car"
    assert options.model == "2d-msar"
    model = btfield.fit(device, small, model="3d-car", neighbourhood="custom", offsets=[(0, -1), (-1, 0)])
    assert model.levels[0].models[0].offsets.tolist() == [[0, -1], [-1, 0]]


@given(st.tuples(st.integers(-2, 200), st.integers(-2, 200)))
@settings(max_examples=30, deadline=None)
def test_sizes(size):
    device, model = shared()
    if min(size) < 1:
        with pytest.raises(btfield.InputError):
            btfield.synthesise(device, model, size)
    else:
        texture = btfield.synthesise(device, model, size)
        assert texture.shape == (*size, 1)
        assert np.isfinite(texture).all()


def shared(kept=[]):  # noqa: B006: made once
    if not kept:
        device = btfield.Device()
        picture = np.random.default_rng(5).random((32, 32), dtype=np.float32)
        kept.append((device, btfield.fit(device, picture, order=1, levels=1)))
    return kept[0]


def test_no_such_device():
    with pytest.raises(btfield.DeviceError, match="nothing of that name"):
        btfield.Device("nothing of that name")
    with pytest.raises(btfield.InputError):
        btfield.Device(vector_width=3)
