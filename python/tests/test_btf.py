"""BTFs: made, given by a function, read from folders and files, fitted, grown."""

import math

import numpy as np
import pytest
from PIL import Image

import btfield


@pytest.fixture(scope="module")
def made(device, cork):
    height = (3 * btfield.unit_of(cork[:48, :48, :1]))
    normals = btfield.normals_of_slopes(btfield.slopes_of_height(height, "periodic"))
    directions = [d for d in btfield.btf_directions_81() if d[0] < 1.0][::2]
    return btfield.make_btf(device, btfield.linear_of(cork[:48, :48]), normals, height, views=directions[:5],
                            lights=directions)


def put_folder(made, folder, exposure=1.0):
    for view, light in made.pictures:
        tv, pv, tl, pl = (round(math.degrees(a)) for a in (*made.views[view], *made.lights[light]))
        picture = made.picture(view, light) * np.float32(exposure)
        Image.fromarray(btfield.bytes_of(btfield.srgb_of(picture))).save(
            folder / f"tl{tl:03}_pl{pl:03}_tv{tv:03}_pv{pv:03}.png")


def test_sets(made, tmp_path):
    pictures = {pair: made.picture(*pair) for pair in made.pictures}
    given = btfield.BtfSet(lambda view, light: pictures[view, light], made.size, 3, made.views, made.lights)
    assert np.array_equal(given.picture(1, 2), pictures[1, 2])
    btfield.write_btf(tmp_path / "set.tbig", given, format="tbig")
    opened = btfield.open_btf(tmp_path / "set.tbig")
    assert len(opened.pictures) == len(pictures)
    assert np.abs(opened.picture(1, 2) - pictures[1, 2]).max() < 1e-3
    put_folder(made, tmp_path)
    folder = btfield.open_btf(tmp_path, read=lambda file: np.asarray(Image.open(file)))
    assert len(folder.pictures) == len(pictures)
    at = min(range(len(folder.lights)), key=lambda i: btfield.angle_between(folder.lights[i], made.lights[2]))
    view = min(range(len(folder.views)), key=lambda i: btfield.angle_between(folder.views[i], made.views[1]))
    assert np.abs(folder.picture(view, at) - pictures[1, 2]).max() < 0.01
    with pytest.raises(btfield.InputError, match="read"):
        btfield.open_btf(tmp_path)


def test_folders_tell_their_exposure(made, tmp_path):
    put_folder(made, tmp_path, 0.5)
    (tmp_path / "btf.json").write_text('{"format": "btfield-btf", "version": 1, "exposure": 0.5}')
    folder = btfield.open_btf(tmp_path, read=lambda file: np.asarray(Image.open(file)))
    means = [np.mean([s.picture(v, l).mean() for v, l in s.pictures]) for s in (made, folder)]
    assert means[1] == pytest.approx(means[0], rel=0.01)
    (tmp_path / "btf.json").write_text('{"exposure": 0}')
    with pytest.raises(btfield.InputError, match="exposure"):
        btfield.open_btf(tmp_path, read=lambda file: np.asarray(Image.open(file)))


def test_errors_of_functions_arrive(device, made):
    def picture(view, light):
        raise OSError("the disk is away")

    broken = btfield.BtfSet(picture, made.size, 3, made.views, made.lights)
    with pytest.raises(OSError, match="the disk is away"):
        broken.picture(0, 0)
    with pytest.raises(OSError, match="the disk is away"):
        btfield.fit_btf(device, broken, planes=2)


def test_joint(device, made):
    pictures = {pair: made.picture(*pair) for pair in made.pictures}
    given = btfield.BtfSet(lambda view, light: pictures[view, light], made.size, 3, made.views, made.lights,
                           height=made.height)
    stages = set()
    fit = btfield.fit_btf(device, given, planes=4, periodic=True, leave_out=7,
                          progress=lambda stage, share: stages.add(stage))
    assert {"pictures", "planes"} <= stages
    assert fit.score.model.median < fit.score.nearest.median
    assert btfield.from_bytes(fit.model.to_bytes()) == fit.model
    seen = btfield.BtfSynthesiser(device, fit.model, surface=fit.surface).picture(made.views[0], made.lights[3])
    assert np.abs(seen - pictures[0, 3]).mean() < 0.2 * pictures[0, 3].mean()
    grown = btfield.BtfSynthesiser(device, fit.model, 64, 3)
    assert grown.picture((0.3, 1.0), (0.5, 2.0)).shape == (64, 64, 3)
    shown = btfield.BtfRenderer(device, fit.model, 64).picture((0, 0), (0.7, 1), size=64)
    assert shown.shape == (64, 64, 3) and shown.max() > 0.05
    assert "<html" in btfield.btf_page(fit.model, grown).lower()


def test_textures(device, made):
    fit = btfield.fit_btf_textures(device, made, clusters=3)
    assert len(fit.model.textures) == 3
    assert btfield.from_bytes(fit.model.to_bytes()) == fit.model
    grown = btfield.BtfTextureSynthesiser(device, fit.model, 64, 1)
    picture = made.picture(2, 5)
    seen = grown.picture(made.views[2], made.lights[5])
    assert np.allclose(seen.mean((0, 1)), picture.mean((0, 1)), rtol=0.05)
