"""What a BTF model says of any view and light, as a table that programs interpolate in at a glance.

Directions lie on a square of points that the concentric map lays onto the disc of theta (theory 23.2). Weights of the
model are asked for on a coarse square, and laid out between, by cubic splines on the disc, onto a finer one, in
which linear interpolation is enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._btfield import BtfModel, BtfSynthesiser, btf_weights

_LOWEST = math.radians(89)
"""Directions that the model is asked for are above the surface."""
COARSE_VIEWS, COARSE_LIGHTS = 11, 13
"""Points along the sides of the squares where the model is asked."""


@dataclass(frozen=True)
class Square:
    """Directions up to `steepest` on side x side points; `side` is odd, and 1 where there is only the middle."""

    side: int
    steepest: float
    tangents: bool = False
    """Rings go by the mean of theta and tan theta, in shares of the outermost's, not by theta: of lights, with which
    values change like the tangent."""

    def out(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far from the middle to the edge."""
        share = theta / self.steepest
        return 0.5 * (share + np.tan(theta) / math.tan(self.steepest)) if self.tangents else share

    def directions(self) -> NDArray[np.float64]:
        """side^2 x 2: theta, phi, row by row."""
        if self.side == 1:
            return np.zeros((1, 2))
        half, quarter = (self.side - 1) / 2, math.pi / 4
        row, column = np.divmod(np.arange(self.side**2), self.side)
        x, y = column / half - 1, row / half - 1
        out = np.maximum(np.abs(x), np.abs(y))
        beside = quarter * y / np.where(x == 0, 1, x) + np.where(x < 0, 4 * quarter, 0)
        above = quarter * (2 - x / np.where(y == 0, 1, y)) + np.where(y < 0, 4 * quarter, 0)
        phi = np.where(out == 0, 0, np.where(np.abs(x) >= np.abs(y), beside, above))
        low, high = np.zeros_like(out), np.full_like(out, self.steepest)
        for _ in range(50):
            middle = 0.5 * (low + high)
            inside = self.out(middle) < out
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        return np.stack([np.where(out == 0, 0, high), phi], axis=1)

    def on_disc(self) -> NDArray[np.float64]:
        """side^2 x 2: the points on a disc of radius 1 on which values are smooth."""
        theta, phi = self.directions().T
        if self.side == 1:
            return np.zeros((1, 2))
        radius = np.tan(theta) / math.tan(self.steepest) if self.tangents else theta / self.steepest
        return np.stack([radius * np.cos(phi), radius * np.sin(phi)], axis=1)

    def finer(self, side: int) -> tuple[Square, NDArray[np.float64]]:
        """A square of so many points, and its values of those of this one: side^2 x own side^2."""
        if self.side == 1:
            return self, np.ones((1, 1))
        fine = Square(side, self.steepest, self.tangents)
        return fine, _splines(self.on_disc(), fine.on_disc())


def _splines(at: NDArray[np.float64], to: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values at `to` of those at `at`: cubes of distances and a linear function."""

    def cubes(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.sum((a[:, None] - b[None]) ** 2, axis=2) ** 1.5

    def linear(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([np.ones((len(points), 1)), points], axis=1)

    n = len(at)
    system = np.zeros((n + 3, n + 3))
    system[:n, :n] = cubes(at, at)
    system[:n, n:] = linear(at)
    system[n:, :n] = linear(at).T
    right = np.concatenate([cubes(to, at), linear(to)], axis=1)
    return np.linalg.solve(system, right.T)[:n].T


@dataclass(frozen=True)
class LitTable:
    """light / cos theta_l = exp(log mean) max(0, offset + sum_k U_k T_k)^2, in shares of white."""

    views: Square
    lights: Square
    rows: NDArray[np.float32]
    """[view][light][value]: of each colour log mean, of each the offset, then U, [colour][plane]."""


def lit_table(model: BtfModel, grown: BtfSynthesiser, side: int) -> LitTable:
    """A table with side x side views and as many lights; asks for 11^2 x 13^2 pairs of directions at most."""
    view_angles, light_angles = ([theta for theta, _ in directions] for directions in (model.views, model.lights))
    lights_of_pairs = [theta for theta, _ in model.true_lights] or [light_angles[light] for _, light in model.pairs]
    steepest_view, steepest_light = max(view_angles[view] for view, _ in model.pairs), max(lights_of_pairs)
    views = Square(min(COARSE_VIEWS, side) if steepest_view > 0 else 1, min(steepest_view, _LOWEST))
    lights = Square(min(COARSE_LIGHTS, side) if steepest_light > 0 else 1, min(steepest_light, _LOWEST), tangents=True)
    pairs_of_views = np.repeat(views.directions(), lights.side**2, axis=0)
    pairs_of_lights = np.tile(lights.directions(), (views.side**2, 1))
    means, offsets, weights = btf_weights(model, grown, pairs_of_views, pairs_of_lights)
    lit = np.maximum(means / np.cos(pairs_of_lights[:, :1]) / model.white, np.finfo(np.float32).tiny)
    values = np.concatenate([np.log(lit), offsets, weights.reshape(len(weights), -1)], axis=1).astype(np.float32)
    fine_views, of_views = views.finer(side)
    fine_lights, of_lights = lights.finer(side)
    coarse = values.reshape(views.side**2, -1)
    between = (of_views.astype(np.float32) @ coarse).reshape(fine_views.side**2, lights.side**2, -1)
    return LitTable(fine_views, fine_lights, np.matmul(of_lights.astype(np.float32), between))
