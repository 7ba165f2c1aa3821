"""Mesh of the tread: an annulus of nine-node quadrilaterals, graded towards the step edge."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Grading:
    """Element sizes, mm."""

    edge: float = 0.15  # at the rim node that meets the edge
    growth: float = 0.2  # per mm of distance from that node
    floor: float = 0.6  # largest on the part of the rim that meets the lower wall
    far: float = 3.0  # largest elsewhere

    def refined(self, factor):
        return Grading(self.edge / factor, self.growth / factor, self.floor / factor, self.far / factor)


@dataclass(frozen=True)
class Mesh:
    """Coordinates are relative to the wheel centre; the x axis points at the edge node."""

    nodes: np.ndarray  # (n, 2)
    elements: np.ndarray  # (m, 9): corners, mid-sides, centre
    rim: np.ndarray  # rim nodes counter-clockwise, the edge node first
    hub: np.ndarray
    radius: float


def _divide(length, size):
    """Boundaries of elements whose sizes follow `size` along `length`."""
    s = np.linspace(0.0, length, 20001)
    density = 1.0 / size(s)
    count = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(s))])
    n = max(2, round(count[-1]))
    return np.interp(np.linspace(0.0, count[-1], n + 1), count, s)


def _with_middles(points):
    fine = np.empty(2 * len(points) - 1)
    fine[::2] = points
    fine[1::2] = 0.5 * (points[1:] + points[:-1])
    return fine


def annulus(radius, thickness, grading, floor_arc=25.0):
    """Tread of outer `radius`. The lower wall lies clockwise of the edge node."""
    around = 2 * np.pi * radius

    def rim_size(s):
        behind = around - s
        ahead = np.minimum(grading.edge + grading.growth * s, grading.far)
        cap = grading.floor + grading.growth * np.maximum(behind - floor_arc, 0.0)
        back = np.minimum(grading.edge + grading.growth * behind, np.minimum(cap, grading.far))
        return np.minimum(ahead, back)

    def depth_size(s):
        return np.minimum(grading.edge + grading.growth * s, grading.far)

    angle = _with_middles(_divide(around, rim_size))[:-1] / radius
    r = radius - _with_middles(_divide(thickness, depth_size))
    na, nr = len(angle), len(r)
    grid = np.arange(na * nr).reshape(na, nr)
    nodes = np.stack([np.outer(np.cos(angle), r), np.outer(np.sin(angle), r)], axis=-1).reshape(-1, 2)
    # Local axes: first inwards to the rim (increasing radius), then counter-clockwise.
    i, j = np.meshgrid(np.arange(0, na, 2), np.arange(0, nr - 2, 2), indexing="ij")
    i, j = i.ravel(), j.ravel()
    at = lambda di, dj: grid[(i + di) % na, j + 2 - dj]
    elements = np.stack(
        [at(0, 0), at(0, 2), at(2, 2), at(2, 0), at(0, 1), at(1, 2), at(2, 1), at(1, 0), at(1, 1)], axis=1
    )
    return Mesh(nodes, elements, grid[:, 0].copy(), grid[:, -1].copy(), radius)
