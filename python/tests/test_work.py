"""Progress, Ctrl-C, threads, memory."""

import gc
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import btfield


def resident() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096


def test_progress(device, cork, bark):
    stages = []
    btfield.fit(device, cork, order=2, progress=lambda stage, seconds: stages.append((stage, seconds)))
    assert {"pyramid", "fit", "gains"} <= {stage for stage, _ in stages}
    assert all(seconds >= 0 for _, seconds in stages)
    shares = []
    model = btfield.fit(device, cork, order=2)
    btfield.Synthesiser(device, model, 64).synthesise(range(300), progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0
    with pytest.raises(ZeroDivisionError):
        btfield.fit(device, cork, progress=lambda stage, seconds: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        btfield.memd(device, bark, cork, progress=lambda share: 1 / 0)


def test_interruption(device):
    """Ctrl-C ends work that would take much longer, and leaves everything as it was."""
    noise = np.random.default_rng(1)
    a, b = (noise.random((400, 400, 3), dtype=np.float32) for _ in range(2))
    begun = time.monotonic()
    threading.Timer(0.3, lambda: signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        for _ in range(1000):
            btfield.memd(device, a, b)
    assert time.monotonic() - begun < 20
    assert btfield.memd(device, a[:8, :8], a[:8, :8]).memd == 0.0


def test_interpreter_goes_on(device):
    """While one thread works, another runs Python."""
    noise = np.random.default_rng(2)
    a, b = (noise.random((500, 500, 3), dtype=np.float32) for _ in range(2))
    counted = 0
    with ThreadPoolExecutor(1) as pool:
        work = pool.submit(btfield.memd, device, a, b)
        while not work.done():
            counted += 1
            time.sleep(0.001)
        assert work.result().memd > 0
    assert counted > 20


def test_four_threads(device, cork, bark):
    """Each result is, to the bit, what one thread alone gets."""
    alone = [btfield.fit(device, picture, order=order).to_bytes() for picture in (cork, bark) for order in (2, 3)]
    model = btfield.from_bytes(alone[0])
    synthesiser = btfield.Synthesiser(device, model, (128, 96))
    textures = [synthesiser.synthesise(seed) for seed in range(8)]
    with ThreadPoolExecutor(4) as pool:
        for _ in range(3):
            fits = pool.map(lambda job: btfield.fit(device, job[0], order=job[1]).to_bytes(),
                            [(picture, order) for picture in (cork, bark) for order in (2, 3)])
            assert list(fits) == alone
            for ours, theirs in zip(pool.map(synthesiser.synthesise, range(8)), textures, strict=True):
                assert np.array_equal(ours, theirs)
            # Destroyed in threads while others compute.
            list(pool.map(lambda seed: btfield.Synthesiser(device, model, 32 + seed).synthesise(seed).sum(), range(16)))


def test_constant_memory(device, small):
    """1000 fits, with models, errors and textures, take no more memory than 200."""
    grey = np.ascontiguousarray(small[:32, :32, :1])
    stream = iter(btfield.Synthesiser(device, btfield.fit(device, grey, order=1, levels=1), 64).textures())

    def rounds(count: int) -> None:
        for _ in range(count):
            model = btfield.fit(device, grey, order=1, levels=1, progress=lambda stage, seconds: None)
            btfield.from_bytes(model.to_bytes())
            next(stream)
            with pytest.raises(btfield.InputError):
                btfield.fit(device, grey[:0])
        gc.collect()

    rounds(200)
    before = resident()
    rounds(800)
    assert resident() - before < 8 << 20


def test_results_are_not_copied(device, small):
    model = btfield.fit(device, small, order=1)
    synthesiser = btfield.Synthesiser(device, model, 1024)
    for seed in range(3):  # factors are kept before the third draw
        synthesiser.synthesise(seed)
    before = resident()
    kept = [synthesiser.synthesise(seed) for seed in range(8)]
    one = kept[0].nbytes
    assert resident() - before < 9 * one
    assert kept[0].base is not None and kept[0].flags.writeable


def test_iterator(device, small):
    synthesiser = btfield.Synthesiser(device, btfield.fit(device, small, order=2), 48)
    stream = synthesiser.textures(5)
    for seed, texture in zip(range(5, 25), stream):
        assert np.array_equal(texture, synthesiser.synthesise(seed))
