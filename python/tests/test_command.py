"""The same numbers as the command's, bit for bit, on pictures of tests/data."""

import json

import numpy as np
import pytest
from conftest import DATA
from PIL import Image

import btfield


def fields_of(model: str) -> dict:
    """A model without what tells where it came from."""
    value = json.loads(model)
    for key in ("provenance", "version"):  # which is that of what provenance needs
        value.pop(key)
    return value


@pytest.mark.parametrize("kind", ["2d-car", "3d-car", "3d-msar", "3d-ma"])
def test_model_and_certificate(device, cork, command, tmp_path, kind):
    command("fit", DATA / "cork.png", "-o", tmp_path / "model.json", "--model", kind, "--order", 3)
    model = btfield.fit(device, cork, model=kind, order=3)
    assert fields_of(model.to_json()) == fields_of((tmp_path / "model.json").read_text())
    for own, theirs in zip(model.certificates, btfield.read_model(tmp_path / "model.json").certificates, strict=True):
        assert own == theirs


def test_texture(device, cork, command, tmp_path):
    command("fit", DATA / "cork.png", "-o", tmp_path / "model.json")
    command("synth", tmp_path / "model.json", "-o", tmp_path / "texture.png", "--size", "200x150", "--seed", 7)
    texture = btfield.synthesise(device, btfield.fit(device, cork), (150, 200), 7)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "texture.png")), btfield.bytes_of(texture))


def test_texture_of_floats(device, command, tmp_path):
    """Of one plane: what Pillow reads."""
    command("fit", DATA / "grass.png", "-o", tmp_path / "model.json", "--model", "3d-pmrf", "--order", 2)
    command("synth", tmp_path / "model.json", "-o", tmp_path / "texture.tif", "--size", "200x150", "--seed", 7,
            "--type", "float", "--keep-values")
    grass = np.asarray(Image.open(DATA / "grass.png"))
    texture = btfield.synthesise(device, btfield.fit(device, grass, model="3d-pmrf", order=2), (150, 200), 7)
    with Image.open(tmp_path / "texture.tif") as stored:
        assert stored.mode == "F"
        assert np.asarray(stored).tobytes() == texture[..., 0].tobytes()


@pytest.mark.parametrize("metric", ["max", "l1", "l2"])
def test_memd(device, bark, cork, command, metric):
    told = command("memd", DATA / "bark.png", DATA / "cork.png", "--metric", metric)
    found = btfield.memd(device, bark, cork, metric)
    assert found.memd == told["memd"]
    assert found.memd_star == told["memd_star"]
    assert btfield.MemdReference(device, bark, metric)(cork).memd == told["memd"]


def test_kappa(cork, command):
    told = command("kappa", DATA / "cork.png")
    assert btfield.kappa(cork).kappa == told["images"][0]["kappa"]


def test_compare(cork, bark, command):
    told = command("compare", DATA / "cork.png", DATA / "bark.png")
    found = btfield.compare(cork, bark)
    assert found.lag_covariance_error == told["lag_covariance_error"]
    assert found.spectral_covariance_error == told["spectral_covariance_error"]


def test_compound(device, bark, command, tmp_path):
    command("compound", "fit", DATA / "bark.png", "-o", tmp_path / "bark.btfm", "--regions", 4)
    model = btfield.fit_compound(device, bark, regions=4)
    theirs = btfield.read_model(tmp_path / "bark.btfm")
    assert fields_of(model.to_json()) == fields_of(theirs.to_json())
    assert np.array_equal(
        btfield.CompoundSynthesiser(device, model, 96).synthesise(3),
        btfield.CompoundSynthesiser(device, theirs, 96).synthesise(3),
    )
