"""A crossing of rubber with memory: the wheel rolls on the lower wall, meets the edge, climbs."""

from dataclasses import dataclass

import numpy as np

from contact import FLOOR, Contact
from crossing import RADIUS, build
from element import Maxwell
from mesh import Grading
from wheel import NotConverged


@dataclass
class Release:
    """The instant at which the lower wall stops carrying."""

    gap: float
    height: float
    x: float
    largest_thrust: float  # per width and relaxed shear modulus, mm
    steps: int
    iterations: int
    elements: int


def on_floor(wheel, load, x, angle, h):
    """Relaxed rubber on the lower wall under `load`."""
    state = wheel.rest(np.array([x, RADIUS - 0.1]), angle, Contact(wheel.mesh, h))
    state.contact.update(state.x, np.zeros(state.x.size))
    state = wheel.solve(state, 0.0, angle=angle)
    for part in np.linspace(min(1.0, -state.hub_force[1] / load), 1.0, 6)[1:]:
        state = wheel.solve(state, 0.0, load=part * load, angle=angle)
    return state


def edge_inside(wheel, state, h):
    """Place of the rim's element corner nearest to the edge, if the edge is within the rim."""
    at = state.x[wheel.mesh.rim] - state.centre
    edge = np.array([0.0, h]) - state.centre
    turn = np.arctan2(at[:, 0] * edge[1] - at[:, 1] * edge[0], at @ edge)
    order = np.argsort(turn)
    if np.hypot(*edge) >= np.interp(0.0, turn[order], np.hypot(*at.T)[order]):
        return None
    return 2 * int(np.argmin(np.abs(turn[::2])))


def crossing(
    thickness, h, load, speed, ratio, tau, grading=Grading(), stride=0.1, run_up=12.0, law=Maxwell, driven=False
):
    """Release under `load` (per width and relaxed modulus) at `speed`, mm/s, from rest.

    Pushed: no torque at the hub, no friction. Driven: torque instead of push while the wheel
    climbs, and nodes that bear on the step stay where they touched it.
    """
    wheel = build(thickness, grading)
    height = RADIUS - 0.5
    for _ in range(2):
        meet = -np.sqrt(RADIUS**2 - (height - h) ** 2)
        x = meet - run_up
        state = on_floor(wheel, load, x, np.arctan2(h - height, -meet) + run_up / RADIUS, h)
        height = state.centre[1]
    memory = law(wheel.rubber, state.x, ratio, tau)
    steps = iterations = 0
    thrust = 0.0

    def advance(state, dx, floor=True):
        memory.begin(dx / speed)
        climbing = state.contact.edge is not None
        if not floor:
            state = state.copy()
            state.contact.floor_open = False
            state.contact.sets[FLOOR][:] = False
        push = 0.0 if driven and climbing else None
        return wheel.solve(state, dx, load=load, angle=None if climbing else state.angle - dx / RADIUS, push=push)

    step = 2 * stride
    while state.centre[0] < -0.3:
        try:
            after = advance(state, step)
        except NotConverged:
            step /= 2
            if step < stride / 20:
                raise
            continue
        iterations += after.iterations
        thrust = max(thrust, float(after.hub_force[0]))
        if not after.contact.sets[FLOOR].any():
            return _release(advance, state, step, (thrust, steps, iterations, len(wheel.mesh.elements)))
        memory.commit(after.x)
        state, steps = after, steps + 1
        if state.contact.edge is None:
            place = edge_inside(wheel, state, h)
            if place is not None:
                state.contact.pin(place)
                state.contact.grip = driven
        near = state.contact.edge is not None or state.centre[0] > meet - 4 * stride
        step = min(1.5 * step, stride if near else 2 * stride)
    raise NotConverged("the lower wall is never released")


def _release(advance, state, step, counts):
    """Finds the part of the step after which the rim just touches the lower wall, by secants."""

    def lowest(dx):
        found = advance(state, dx, floor=False)
        return found.contact.lowest(found.x)[0], found

    low, high = 1e-3 * step, step
    bottom, _ = lowest(low)
    top, after = lowest(high)
    for _ in range(12):
        if abs(top) < 1e-6:
            break
        at = high - top * (high - low) / (top - bottom)
        value, found = lowest(at)
        low, bottom = high, top
        high, top, after = at, value, found
    else:
        raise NotConverged("the release is not found")
    thrust, steps, iterations, elements = counts
    x, height = (float(v) for v in after.centre)
    return Release(after.gap(RADIUS), height, x, thrust, steps, iterations, elements)
