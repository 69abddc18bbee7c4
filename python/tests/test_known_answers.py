"""Answers that every implementation gives."""

import struct

import numpy as np
from conftest import DATA

import btfield


def test_noise_words(device):
    normals = [
        line.split()[1:]
        for line in (DATA / "known_answers.txt").read_text().splitlines()
        if line.startswith("normal")
    ]
    assert normals
    for seed, level, plane, row, column, bits in normals:
        at = [int(word) for word in (level, plane, row, column)]
        # The lattice reaches just as far as the answer.
        noise = btfield.noise(device, (at[2] + 1, at[3] + 1), at[1] + 1, int(seed, 16), level=at[0])
        (found,) = struct.unpack("<I", struct.pack("<f", noise[at[2], at[3], at[1]]))
        assert found == int(bits, 16)


def grey(*values):
    return np.array([values], dtype=np.uint8)


def test_memd_values(device):
    # Theory 15.2: 10 takes 11, the nearer; 11 has only 8 left.
    found = btfield.memd(device, grey(10, 11), grey(11, 8), local_errors=True)
    assert found.memd == 2.0
    assert found.local_errors.tolist() == [[1.0, 3.0]]
    assert found.memd_star == 100.0 * 2.0 / 255.0
    assert btfield.memd(device, grey(10, 11), grey(9, 11), local_errors=True).local_errors.tolist() == [[1.0, 0.0]]
    white, black = np.full((7, 5, 3), 255, np.uint8), np.zeros((7, 5, 3), np.uint8)
    assert btfield.memd(device, white, black).memd == 255.0
    assert btfield.memd(device, white, black, "l1").memd == 3 * 255.0
    assert btfield.memd_max("l2", 4) == 510.0


def test_lag_covariance_is_that_of_numpy():
    picture = np.random.default_rng(2).random((9, 14, 2), dtype=np.float32)
    centred = picture.astype(float) - picture.astype(float).mean((0, 1))
    found = btfield.lag_covariance(picture, (3, 4))
    for row in (-3, 0, 2):
        for column in (-4, 0, 1):
            moved = np.roll(centred, (-row, -column), (0, 1))
            expected = np.einsum("rci,rcj->ij", centred, moved) / (9 * 14)
            assert np.allclose(found.values[row + 3, column + 4], expected, rtol=0, atol=1e-14)
            assert found[0, 1, row, column] == found.values[row + 3, column + 4, 0, 1]


def test_kappa_is_that_of_numpy():
    picture = np.random.default_rng(3).random((20, 30, 3), dtype=np.float32)
    covariance = np.cov(256 * picture.reshape(-1, 3).astype(float).T, bias=True)
    assert np.isclose(btfield.kappa(picture).kappa, np.linalg.det(covariance) / 256**3, rtol=1e-12)
