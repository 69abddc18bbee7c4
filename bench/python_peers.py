"""Times of btfield against what a user of Python would write: a field of one level with NumPy's FFT, MEMD with SciPy's k-d
tree, regions with scikit-learn's k-means. All in one run: python bench/python_peers.py PICTURE
"""

import sys
import time

import numpy as np
import scipy.fft
from PIL import Image
from scipy.spatial import cKDTree

import btfield


def best(work, runs=5):
    times = []
    for _ in range(runs):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return min(times)


def told(what, ours, theirs, whose):
    print(f"{what}: btfield {1e3 * ours:.1f} ms, {whose} {1e3 * theirs:.1f} ms, {theirs / ours:.1f} times")


picture = np.asarray(Image.open(sys.argv[1]).convert("RGB"))
device = btfield.Device()

# One level: white noise through the square root of the picture's spectrum, plane by plane after a rotation.
model = btfield.fit(device, picture, model="3d-car", order=3, levels=1, marginals="none")
synthesiser = btfield.Synthesiser(device, model, 512)
root = np.stack([np.abs(scipy.fft.rfft2(picture[:512, :512, p].astype(np.float32) / 255)) for p in range(3)]) / 512
generator = np.random.default_rng(1)


def field():
    noise = generator.standard_normal((3, 512, 512), dtype=np.float32)
    return scipy.fft.irfft2(scipy.fft.rfft2(noise, workers=-1) * root, s=(512, 512), workers=-1)


told("texture of one level, 512 x 512 x 3, in a batch of 16",
     best(lambda: synthesiser.synthesise(range(16))) / 16, best(field), "scipy.fft")


def tree_memd(a, b):
    """Takes the nearest pixel that is left: asks for more neighbours until one is."""
    a, b = a.reshape(-1, 3).astype(float), b.reshape(-1, 3).astype(float)
    tree, taken, total = cKDTree(b), np.zeros(len(b), bool), 0.0
    for colour in a:
        k = 1
        while True:
            distance, index = tree.query(colour, k=list(range(1, min(k, len(b)) + 1)), p=np.inf)
            free = np.flatnonzero(~taken[index])
            if len(free):
                taken[index[free[0]]] = True
                total += distance[free[0]]
                break
            k *= 4
    return total / len(a)


a, b = picture[:64, :64], picture[64:128, 64:128]
told("MEMD of 64 x 64 pixels", best(lambda: btfield.memd(device, a, b)), best(lambda: tree_memd(a, b), 1), "scipy.spatial")

try:
    from sklearn.cluster import KMeans
except ImportError:
    print("regions: scikit-learn is not installed")
else:
    values = picture[:256, :256].reshape(-1, 3).astype(float)
    told("8 regions of 256 x 256 pixels",
         best(lambda: btfield.cluster(picture[:256, :256], regions=8, space="rgb"), 3),
         best(lambda: KMeans(8, n_init=5, random_state=0).fit(values), 2), "scikit-learn (5 starts)")
