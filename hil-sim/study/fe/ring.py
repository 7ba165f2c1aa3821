"""The ring of radial elements: the model that the continuum is compared with."""

import numpy as np
from scipy.optimize import brentq

RADIUS, WIDTH = 25.0, 28.0  # mm
K_INF, STIFFENING, TAU = 0.6044, 4.2235, 0.1059  # N/mm^3, 1, s


def depth(psi, x, y, h):
    """Depth of the elements at angle psi from straight down; the centre is at (x, y)."""
    sin, cos = np.sin(psi), np.cos(psi)
    floor = y / cos
    face = np.where(sin > 1e-9, -x / np.maximum(sin, 1e-9), 1e9)
    top = (y - h) / cos
    # The wall ahead is the riser below the edge and the upper wall beyond it.
    wall = np.where(x + floor * sin < 0, floor, np.where(face > top, face, top))
    return RADIUS - wall


def carried(force, psi, driven):
    """Vertical load of radial forces; driven: with equally used friction and no push at the axle."""
    up, back = (force * np.cos(psi)).sum(), (force * np.sin(psi)).sum()
    return up + (back**2 / up if driven and up > 0 else 0.0)


def static_gap(load, h, driven=False):
    """The lower wall is released with the centre at the radius; only the step carries."""
    psi = np.linspace(-0.2, 1.4, 400001)

    def excess(x):
        d = np.maximum(depth(psi, x, RADIUS, h), 0.0)
        return carried(K_INF * WIDTH * RADIUS * (psi[1] - psi[0]) * d, psi, driven) - load

    x = brentq(excess, -np.sqrt(RADIUS**2 - (RADIUS - h) ** 2), -0.05)
    return float(np.hypot(x, RADIUS) - RADIUS)


def moving_gap(load, h, speed, driven=False, elements=8640, stride=0.01, run_up=12.0):
    """Gap with memory, from a relaxed start on the lower wall."""
    k1 = K_INF * (STIFFENING - 1)
    pitch = 2 * np.pi / elements
    area = pitch * RADIUS * WIDTH
    angles = np.arange(-elements // 3, elements // 3) * pitch
    z = stride / speed / TAU
    keep, mean = np.exp(-z), -np.expm1(-z) / z
    x = -np.sqrt(RADIUS**2 - (RADIUS - h) ** 2) - run_up
    start, y, floor_old = x, None, None
    old = q = np.zeros_like(angles)
    while x < 0:
        psi = angles - (x - start) / RADIUS
        seen = np.abs(psi) < 1.2
        ps = psi[seen]
        kept = (keep * q + (mean - keep) * old)[seen]

        def loads(height):
            d = np.maximum(depth(ps, x, height, h), 0.0)
            own = d * (1 - mean) + kept
            p = K_INF * d if y is None else K_INF * d + k1 * (d - own)
            return d, np.where(d > 0, np.maximum(p, 0.0), 0.0) * area

        low, high = (RADIUS - 4, RADIUS) if y is None else (y - 0.1, y + 0.1)
        height = brentq(lambda a: carried(loads(a)[1], ps, driven) - load, low, high, xtol=1e-10)
        d, force = loads(height)
        floor = force[x + height * np.tan(ps) < 0].sum()
        if floor_old is not None and floor <= 0:
            if floor_old <= 0:
                raise ArithmeticError("no contact with the lower wall")
            # The floor's force is gone within this step: take the mean of its ends.
            return float(np.hypot(x - stride / 2, (y + height) / 2) - RADIUS), (y + height) / 2
        deep = np.zeros_like(angles)
        deep[seen] = d
        q = deep if y is None else keep * q + (mean - keep) * old + (1 - mean) * deep
        old, y, floor_old = deep, height, floor
        x += stride
    raise ArithmeticError("the lower wall is never released")
