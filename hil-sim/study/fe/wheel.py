"""Equilibrium of the wheel: Newton's method over the tread and the rigid hub's height and angle."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu


class NotConverged(ArithmeticError):
    pass


@dataclass
class State:
    """Positions are those of the nodes; forces are per width and relaxed shear modulus, mm."""

    x: np.ndarray
    p: np.ndarray
    centre: np.ndarray
    angle: float
    contact: object
    force: np.ndarray = None
    hub_force: np.ndarray = None  # of the hub on the tread
    torque: float = 0.0
    iterations: int = 0

    def gap(self, radius):
        return float(np.hypot(*self.centre) - radius)

    def copy(self):
        return replace(self, x=self.x.copy(), p=self.p.copy(), centre=self.centre.copy(), contact=self.contact.copy())


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def unit_columns(dofs, size):
    return sp.csc_matrix((np.ones(len(dofs)), (dofs, np.arange(len(dofs)))), shape=(size, len(dofs)))


class Wheel:
    def __init__(self, mesh, rubber):
        self.mesh, self.rubber = mesh, rubber
        self.inner = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.hub)

    def rest(self, centre, angle, contact):
        x = self.mesh.nodes @ turned(angle).T + centre
        return State(x, np.zeros((len(self.mesh.elements), 3)), np.array(centre, float), angle, contact)

    def solve(self, start, travel, *, load=None, touch=False, angle=None, push=None, limit=40, tol=1e-9):
        """State after the hub has moved by `travel` along the wall.

        Height: given by `load`, or by the lowest point on the lower wall without force (`touch`),
        or kept. Angle: prescribed by `angle`, or free with zero torque,
        or free with the hub's horizontal force `push`.
        """
        s = start.copy()
        mesh, n = self.mesh, len(self.mesh.nodes)
        hub_x, hub_y = 2 * mesh.hub, 2 * mesh.hub + 1
        move_height, move_angle = load is not None or touch, angle is None
        self._place(s, travel, 0.0, (angle - s.angle) if angle is not None else 0.0)
        hub_shift = s.x - start.x
        s.x = start.x.copy()
        s.contact.seen.clear()
        for iteration in range(1, limit + 1):
            held, values = s.contact.fixed()
            given = np.zeros((n, 2))
            if iteration == 1:
                given[mesh.hub] = hub_shift[mesh.hub]
            given.reshape(-1)[held] = values - s.x.reshape(-1)[held]
            try:
                stiffness, force, kept = self.rubber.system(s.x, s.p)
            except ArithmeticError as error:
                raise NotConverged(str(error)) from error
            free = np.setdiff1d((2 * self.inner[:, None] + np.arange(2)).ravel(), held)
            arm = (s.x + hub_shift * (iteration == 1))[mesh.hub] - s.centre
            columns, rows, wanted = [], [], []
            unit = lambda dofs, v: sp.csc_matrix((v, (dofs, np.zeros(len(dofs), int))), shape=(2 * n, 1))
            lift = unit(hub_y, np.ones(len(hub_y)))
            turn = unit(np.concatenate([hub_x, hub_y]), np.concatenate([-arm[:, 1], arm[:, 0]]))
            if move_height:
                columns.append(lift)
                rows.append(0 * lift if touch else lift)
                low = s.contact.lowest(s.x + given) if touch else None
                wanted.append(0.0 if touch else -load)
            if move_angle:
                columns.append(turn)
                rows.append(turn if push is None else unit(hub_x, np.ones(len(hub_x))))
                wanted.append(0.0 if push is None else push)
            pick = unit_columns(free, 2 * n)
            right = sp.hstack([pick] + columns, format="csc")
            left = sp.hstack([pick] + rows, format="csc")
            residual = left.T @ (force + stiffness @ given.reshape(-1))
            nf = len(free)
            residual[nf:] -= wanted
            matrix = left.T @ stiffness @ right
            extra = sp.lil_matrix(matrix.shape)
            if touch:
                extra[nf] = sp.csr_matrix((low[2], (np.zeros(3, int), 2 * low[1] + 1)), shape=(1, 2 * n)) @ right
                residual[nf] = low[0]
            if move_angle and push is None:
                extra[-1, -1] -= (force.reshape(n, 2)[mesh.hub] * arm).sum()
            matrix = matrix + extra.tocsr()
            try:
                step = -splu(sp.csc_matrix(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01).solve(residual)
            except RuntimeError as error:
                raise NotConverged(str(error)) from error
            dx = (right @ step).reshape(n, 2) + given
            size = np.abs(dx).max()
            if not np.isfinite(size) or size > 5:
                raise NotConverged("step too large")
            s.p = self.rubber.pressure(s.p, dx, kept)
            hub_before = s.x[mesh.hub]
            s.x = s.x + dx
            s.x[mesh.hub] = hub_before
            self._place(
                s,
                0.0,
                step[nf] if move_height else 0.0,
                step[nf + move_height] if move_angle else 0.0,
            )
            if size < 1e-2:
                # Forces that belong to the corrected state, to first order.
                changed = s.contact.update(s.x, force + stiffness @ dx.reshape(-1))
                if size < tol and not changed:
                    break
        else:
            raise NotConverged(f"{limit} iterations")
        s.force, s.iterations = force, iteration
        f = force.reshape(n, 2)[mesh.hub]
        s.hub_force = f.sum(0)
        arm = s.x[mesh.hub] - s.centre
        s.torque = float((arm[:, 0] * f[:, 1] - arm[:, 1] * f[:, 0]).sum())
        return s

    def _place(self, s, dx, dy, turn):
        """Moves the hub."""
        s.centre = s.centre + np.array([dx, dy])
        s.angle += turn
        s.x = s.x.copy()
        s.x[self.mesh.hub] = self.mesh.nodes[self.mesh.hub] @ turned(s.angle).T + s.centre
