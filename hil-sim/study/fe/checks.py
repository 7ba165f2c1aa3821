"""Checks of the element, the contact and the equilibrium against known answers."""

import numpy as np

from contact import Contact
from crossing import NU, RADIUS, static_curve
from element import Rubber
from mesh import Grading, annulus
from wheel import Wheel


def patch():
    """Distorted elements under an affine motion: stress and inner forces must be exact."""
    rng = np.random.default_rng(1)
    grid = np.arange(25).reshape(5, 5)
    corner = np.stack(np.meshgrid([0, 1.0, 2], [0, 1.0, 2], indexing="ij"), -1)
    corner[1, 1] += [0.23, -0.17]
    corner[0, 1] += [0.0, 0.2]
    corner[1, 0] += [-0.15, 0.0]
    x = np.zeros((5, 5, 2))
    x[::2, ::2] = corner
    x[1::2, ::2] = (corner[1:] + corner[:-1]) / 2
    x[:, 1::2] = (x[:, 2::2] + x[:, :-2:2]) / 2
    x = x.reshape(-1, 2)
    place = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]
    elements = np.array([[grid[i + a, j + b] for a, b in place] for i in (0, 2) for j in (0, 2)])
    rubber = Rubber(x, elements, NU)
    f = np.array([[1.2, 0.3], [-0.1, 0.9]])
    f /= np.sqrt(np.linalg.det(f) / 1.0004)
    inner = grid[1:-1, 1:-1].ravel()
    now = x @ f.T
    now[inner] += rng.normal(0, 0.02, (len(inner), 2))
    p = np.zeros((len(elements), 3))
    free = (2 * inner[:, None] + np.arange(2)).ravel()
    for _ in range(12):
        stiffness, force, kept = rubber.system(now, p)
        dx = np.zeros(now.size)
        dx[free] = -np.linalg.solve(stiffness[free][:, free].toarray(), force[free])
        p = rubber.pressure(p, dx.reshape(-1, 2), kept)
        now = now + dx.reshape(-1, 2)
    off = np.abs(now - x @ f.T).max()
    pressure = np.abs(p - np.array([rubber.lam * 0.0004, 0, 0])).max()
    return {"position_error_mm": float(off), "pressure_error_per_modulus": float(pressure)}


def tangent():
    """Stiffness against central differences of the force, with the pressure following."""
    mesh = annulus(RADIUS, 8.0, Grading(3.0, 0.2, 4.0, 6.0))
    rubber = Rubber(mesh.nodes, mesh.elements, NU)
    rng = np.random.default_rng(2)
    x = mesh.nodes + rng.normal(0, 0.02, mesh.nodes.shape)
    p = rng.normal(0, 0.1, (len(mesh.elements), 3))
    d = rng.normal(0, 1, x.shape)
    stiffness, _, kept = rubber.system(x, p)
    eps = 1e-5

    def force(sign):
        """Force of the displaced state with the pressure that the linearisation gives it."""
        moved = rubber.pressure(p, sign * eps * d, (kept[0], 0 * kept[1]))
        _, f, (lift, lag) = rubber.system(x + sign * eps * d, moved)
        divergence = np.linalg.inv(rubber.mass_inv) @ lift / rubber.lam
        correction = np.einsum("equ,eq->eu", divergence, lag)
        return f - np.bincount(rubber.dofs.ravel(), correction.ravel(), minlength=f.size)

    slope = (force(1) - force(-1)) / (2 * eps)
    return {"relative_error": float(np.abs(slope - stiffness @ d.ravel()).max() / np.abs(slope).max())}


def hertz(half_width=1.0):
    """A tread 20 mm thick pressed on the lower wall, against Hertz's line contact."""
    mesh = annulus(RADIUS, 20.0, Grading(0.06, 0.15, 0.6, 4.0))
    wheel = Wheel(mesh, Rubber(mesh.nodes, mesh.elements, NU))
    stiffness = 2 / (1 - NU)  # E* per shear modulus
    load = np.pi * half_width**2 * stiffness / (4 * RADIUS)
    state = wheel.rest(np.array([-20.0, RADIUS - 0.02]), -np.pi / 2, Contact(mesh, 4.0))
    state.contact.update(state.x, np.zeros(state.x.size))
    state = wheel.solve(state, 0.0, angle=state.angle)
    for part in np.linspace(min(1.0, -state.hub_force[1] / load), 1.0, 6)[1:]:
        state = wheel.solve(state, 0.0, load=part * load, angle=state.angle)
    f = state.force.reshape(-1, 2)[mesh.rim, 1]
    f = np.where(state.contact.sets[0], f, 0.0)
    at = state.x[mesh.rim, 0] - state.centre[0]
    width = 2 * np.sqrt((f * at**2).sum() / f.sum())
    size = at[2] - at[0]
    peak = f[1] / (2 / 3 * size)
    hertz_peak = 2 * load / (np.pi * half_width) * np.sqrt(1 - (at[1] / half_width) ** 2)
    return {
        "half_width_mm": half_width,
        "half_width_error": float(width / half_width - 1),
        "peak_pressure_error": float(peak / hertz_peak - 1),
    }


def energy(curve):
    """Work of the hub's forces along the releases against the stored energy.

    The lower wall carries nothing on this path, the edge does not move and the walls have no
    friction. The trapezoidal rule errs with the square of the stride.
    """
    x, y, fx, fy = (np.array(v) for v in (curve.x, curve.height, curve.thrust, curve.load))
    work = np.trapezoid(fx, x) - np.trapezoid(fy, y)
    stored = curve.energy[-1] - curve.energy[0]
    return {"work": float(work), "stored": float(stored), "relative_error": float(work / stored - 1)}


def pinned_node(thickness, h, load, grading):
    """Gap when the edge meets another rim node: nothing but the mesh may change."""
    gaps = []
    for place in (0, 3, 6):
        curve = static_curve(thickness, h, grading, most_load=1.3 * load, pinned=place)
        gaps.append(float(np.interp(load, curve.load, curve.gap)))
    return {"gaps_mm": gaps, "spread_mm": max(gaps) - min(gaps)}
