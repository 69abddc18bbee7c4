"""What goes out comes back: models, pyramids, eigenplanes, heights."""

import copy
import pickle

import numpy as np
import pytest

import btfield


@pytest.fixture(scope="module")
def models(device, small):
    return [btfield.fit(device, small, order=2, model="3d-car"), btfield.fit_compound(device, small, regions=3)]


def test_models(models, tmp_path):
    for i, model in enumerate(models):
        assert btfield.from_bytes(model.to_bytes()) == model
        assert btfield.from_json(model.to_json()) == model
        assert pickle.loads(pickle.dumps(model)) == model
        assert copy.deepcopy(model) == model
        for name in (f"{i}.json", f"{i}.btfm"):
            btfield.write_model(tmp_path / name, model)
            assert btfield.read_model(str(tmp_path / name)) == model
        assert (tmp_path / f"{i}.btfm").read_bytes() == model.to_bytes()
    assert models[0] != models[1]


def test_damaged_models(models, tmp_path):
    data = models[0].to_bytes()
    for bad in (b"", data[:-1], b"{}", data + b"\0"):
        with pytest.raises(btfield.InputError):
            btfield.from_bytes(bad)
    with pytest.raises(btfield.InputError, match="No such file"):
        btfield.read_model(tmp_path / "nothing.json")
    with pytest.raises(btfield.InputError):
        btfield.write_model(tmp_path / "no" / "folder.json", models[0])


def test_pyramid(device, cork):
    levels = btfield.decompose(device, cork[:50, :67], 3, 2)
    assert [level.shape[:2] for level in levels] == btfield.pyramid_sizes((50, 67), 3)
    assert np.allclose(btfield.collapse(device, levels, 2), cork[:50, :67] / 255.0, atol=1e-6)


def test_eigenplanes(small):
    basis = btfield.spectral_basis(small)
    planes = btfield.to_eigenplanes(basis, small)
    flat = planes.reshape(-1, basis.rank).astype(float)
    off = np.cov(flat.T) - np.diag(flat.var(0, ddof=1))
    assert np.abs(off).max() < 1e-6
    assert np.allclose(btfield.from_eigenplanes(basis, planes), small / 255.0, atol=1e-6)
    gaussian, marginals = btfield.gaussianise(planes)
    assert np.allclose(gaussian.var((0, 1)), 1, atol=1e-4)
    # Knots reach so far that no quantile function is told exactly.
    assert np.abs(btfield.map_back(gaussian, marginals) - planes).mean() < 0.05 * planes.std()


def test_heights(device):
    y, x = np.mgrid[0:32, 0:48] * 2 * np.pi
    height = (np.sin(y / 32) + 0.5 * np.cos(2 * x / 48)).astype(np.float32)
    slopes = btfield.slopes_of_height(height, "periodic")
    found = btfield.integrate(device, slopes, edges="periodic")
    assert np.abs(found[..., 0] - (height - height.mean())).max() < 1e-4
    normals = btfield.normals_of_slopes(slopes)
    assert np.allclose(btfield.slopes_of_normals(normals), slopes, atol=1e-5)


def test_relief(device):
    y, x = np.mgrid[0:40, 0:40] * 2 * np.pi / 40
    normals = btfield.normals_of_slopes(np.stack([0.3 * np.sin(x), 0.2 * np.cos(y)], -1).astype(np.float32))
    surface = btfield.Surface(normals, np.full((40, 40, 3), 0.5, np.float32))
    lights = [btfield.direction_of_angles(theta, phi) for theta in (20, 40) for phi in range(0, 360, 60)]
    found = btfield.fit_relief(device, [surface.relight(light) for light in lights], lights, rule="ls")
    assert np.abs(found.normals - normals).max() < 1e-3
    assert np.abs(found.albedo - 0.5).max() < 1e-3


def test_fields(device, small):
    statistic = btfield.lag_covariance(small, (4, 4))
    model = btfield.fit_car(statistic, btfield.neighbourhood(2, "causal"))
    again = btfield.CarModel(model.offsets, model.coefficients, model.noise_covariance, kind="causal")
    assert np.array_equal(again.coefficients, model.coefficients)
    assert btfield.certify(again, statistic) == btfield.certify(model, statistic)


def test_roller(device, bark):
    tile = btfield.Roller(device, [bark]).tile((96, 96))
    texture = tile.apply(bark)
    pixels = bark.reshape(-1, 3)[tile.source.astype(np.int64)] / np.float32(255)
    assert np.array_equal(texture, pixels.astype(np.float32))


def test_material(device, cork):
    height = cork[:64, :64, :1]
    normals = btfield.normals_of_slopes(btfield.slopes_of_height(10 * btfield.unit_of(height)))
    maps = [("cork_diff", cork[:64, :64]), ("cork_normal", normals), ("cork_height", height)]
    material = btfield.join_maps(device, maps)
    model = btfield.fit_material(device, material, order=2)
    texture = btfield.synthesise(device, model, 64, 1)
    grown = btfield.split_maps(device, model, texture)
    assert list(grown) == [name for name, _ in maps]
    assert np.allclose(np.linalg.norm(grown["cork_normal"], axis=2), 1, atol=1e-5)
