"""Crossings of one step: states in which the lower wall is just touched."""

from dataclasses import dataclass, field

import numpy as np

from contact import Contact
from element import Rubber
from mesh import Grading, annulus
from wheel import NotConverged, Wheel

RADIUS, WIDTH, NU = 25.0, 28.0, 0.4995


@dataclass
class Curve:
    """Releases of the lower wall: load per width and relaxed shear modulus (mm) against the gap."""

    thickness: float
    h: float
    elements: int = 0
    gap: list = field(default_factory=list)
    load: list = field(default_factory=list)
    height: list = field(default_factory=list)
    thrust: list = field(default_factory=list)
    x: list = field(default_factory=list)
    energy: list = field(default_factory=list)
    iterations: list = field(default_factory=list)
    stopped: str = ""


def first_touch(h):
    """Wheel centre where the undeformed wheel touches lower wall and edge."""
    return np.array([-np.sqrt(RADIUS**2 - (RADIUS - h) ** 2), RADIUS])


def build(thickness, grading):
    mesh = annulus(RADIUS, thickness, grading)
    return Wheel(mesh, Rubber(mesh.nodes, mesh.elements, NU))


def static_curve(thickness, h, grading=Grading(), most_load=np.inf, stride=0.25, pinned=0):
    """Relaxed rubber, from first touch to `most_load`, the wheel pushed at its axle without torque."""
    wheel = build(thickness, grading)
    contact = Contact(wheel.mesh, h)
    contact.floor_open = False
    contact.pin(pinned)
    centre = first_touch(h)
    ahead = contact.arc[pinned] / RADIUS
    state = wheel.rest(centre, np.arctan2(h - centre[1], -centre[0]) - ahead, contact)
    curve = Curve(thickness, h, elements=len(wheel.mesh.elements))
    step = stride
    while curve.load[-1:] < [most_load] and state.centre[0] < -0.3:
        try:
            state = wheel.solve(state, step if curve.load else 0.2 * step, touch=True)
        except NotConverged as why:
            step /= 2
            if step < stride / 40:
                curve.stopped = str(why)
                break
            continue
        step = min(stride, 1.5 * step)
        if -state.hub_force[1] <= 0:
            continue
        curve.gap.append(state.gap(RADIUS))
        curve.load.append(-float(state.hub_force[1]))
        curve.height.append(float(state.centre[1]))
        curve.x.append(float(state.centre[0]))
        curve.thrust.append(float(state.hub_force[0]))
        curve.energy.append(wheel.rubber.energy(state.x))
        curve.iterations.append(state.iterations)
    return curve
