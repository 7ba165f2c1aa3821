"""Mixed Q2/P1 element: nine nodes for the position, a discontinuous linear pressure.

Compressible neo-Hookean rubber in plane strain,
W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (J - 1)^2, with p = lambda (J - 1) an unknown of its own.
One Maxwell branch adds mu_1/2 (C : C_v^-1 - ...), (C_v^-1)' = (C^-1 - C_v^-1)/tau. Over a time
step its stress has the form of the neo-Hookean one: P = F A + (p J - m) F^-T with A and m fixed
by the past. The pressure is eliminated element by element from the linearised equations, so that
Newton's geometric stiffness carries the pressure that the last solution predicted.
"""

import numpy as np
import scipy.sparse as sp

_G = np.sqrt(0.6) * np.array([-1.0, 0.0, 1.0])
_W = np.array([5.0, 8.0, 5.0]) / 9.0
_EPS = np.array([[0.0, 1.0], [-1.0, 0.0]])
_COFACTOR = np.einsum("ik,JL->iJkL", _EPS, _EPS)  # cof F = _COFACTOR : F in two dimensions


def lagrange(s):
    """Quadratic shape functions at -1, 0, 1 and their derivatives."""
    s = np.asarray(s, dtype=float)
    n = np.stack([s * (s - 1) / 2, 1 - s * s, s * (s + 1) / 2], axis=-1)
    return n, np.stack([s - 0.5, -2 * s, s + 0.5], axis=-1)


def _shapes():
    xi, eta = (a.ravel() for a in np.meshgrid(_G, _G, indexing="ij"))
    (a, da), (b, db) = lagrange(xi), lagrange(eta)
    place = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)]
    n = np.stack([a[:, i] * b[:, j] for i, j in place], axis=1)
    d = np.stack([np.stack([da[:, i] * b[:, j], a[:, i] * db[:, j]], axis=-1) for i, j in place], axis=1)
    return n, d, np.outer(_W, _W).ravel()


class Rubber:
    """Elements of a mesh. Relaxed shear modulus 1: forces scale with it."""

    def __init__(self, nodes, elements, nu):
        self.elements, self.count = elements, len(nodes)
        self.lam = 2 * nu / (1 - 2 * nu)
        n, d, w = _shapes()
        x = nodes[elements]
        jac = np.einsum("eai,gaj->egij", x, d)
        det = np.linalg.det(jac)
        if det.min() <= 0:
            raise ValueError("element turned inside out")
        self.weight = det * w
        self.grad = np.einsum("gaj,egji->egai", d, np.linalg.inv(jac))
        at = np.einsum("ga,eai->egi", n, x)
        local = (at - at.mean(1, keepdims=True)) / np.sqrt(self.weight.sum(1))[:, None, None]
        self.q = np.concatenate([np.ones(local.shape[:2] + (1,)), local], axis=2)
        self.mass_inv = np.linalg.inv(np.einsum("eg,egq,egr->eqr", self.weight, self.q, self.q))
        dofs = (2 * elements[:, :, None] + np.arange(2)).reshape(len(elements), 18)
        self.dofs = dofs
        self.rows, self.cols = np.repeat(dofs, 18, axis=1).ravel(), np.tile(dofs, 18).ravel()
        # Gradient as a matrix from the element's 18 unknowns to the four entries of F.
        g = np.zeros(self.grad.shape[:2] + (4, 18))
        g[:, :, 0, 0::2] = g[:, :, 2, 1::2] = self.grad[..., 0]
        g[:, :, 1, 0::2] = g[:, :, 3, 1::2] = self.grad[..., 1]
        self.b = g.reshape(len(elements), -1, 18)
        self.elastic()

    def elastic(self):
        """Relaxed rubber without memory."""
        shape = self.weight.shape
        self.a, self.m = np.broadcast_to(np.eye(2), shape + (2, 2)), 1.0

    def deformation(self, x):
        return np.einsum("eai,egaJ->egiJ", x[self.elements], self.grad)

    def cofactor(self, f):
        return np.einsum("iJkL,egkL->egiJ", _COFACTOR, f)

    def system(self, x, p):
        """Stiffness and force with the pressure eliminated, and what `pressure` needs."""
        f = self.deformation(x)
        cof = self.cofactor(f)
        j = np.linalg.det(f)
        if j.min() < 0.01:
            raise ArithmeticError("element collapsed")
        inv = np.linalg.inv(f)
        pq = np.einsum("egq,eq->eg", self.q, p)
        stress = f @ self.a + pq[..., None, None] * cof - self.m * cof / j[..., None, None]
        d = pq[..., None, None, None, None] * _COFACTOR + self.m * np.einsum("egLi,egJk->egiJkL", inv, inv)
        d[:, :, 0, :, 0, :] += self.a
        d[:, :, 1, :, 1, :] += self.a
        e, g = self.weight.shape
        d = d.reshape(e, g, 4, 4) * self.weight[..., None, None]
        bg = self.b.reshape(e, g, 4, 18)
        k = self.b.transpose(0, 2, 1) @ (d @ bg).reshape(e, 4 * g, 18)
        force = np.einsum("egc,egcu->eu", stress.reshape(e, g, 4) * self.weight[..., None], bg)
        qcof = np.einsum("eg,egq,egc->eqgc", self.weight, self.q, cof.reshape(e, g, 4))
        div = qcof.reshape(e, 3, 4 * g) @ self.b
        gap = np.einsum("eg,egq,eg->eq", self.weight, self.q, j - 1)
        lift = self.lam * self.mass_inv @ div
        lag = self.lam * np.einsum("eqr,er->eq", self.mass_inv, gap) - p
        k += div.transpose(0, 2, 1) @ lift
        force += np.einsum("equ,eq->eu", div, lag)
        n = 2 * self.count
        stiffness = sp.csr_matrix((k.ravel(), (self.rows, self.cols)), shape=(n, n))
        return stiffness, np.bincount(self.dofs.ravel(), force.ravel(), minlength=n), (lift, lag)

    def pressure(self, p, dx, kept):
        lift, lag = kept
        return p + lag + np.einsum("equ,eu->eq", lift, dx.ravel()[self.dofs])

    def energy(self, x):
        """Stored energy of the relaxed rubber, with the pressure that belongs to x."""
        f = self.deformation(x)
        j = np.linalg.det(f)
        gap = np.einsum("eg,egq,eg->eq", self.weight, self.q, j - 1)
        volume = 0.5 * self.lam * np.einsum("eq,eqr,er->", gap, self.mass_inv, gap)
        shape = 0.5 * (np.einsum("egiJ,egiJ->eg", f, f) - 2) - np.log(j)
        return float((self.weight * shape).sum() + volume)


class Maxwell:
    """Memory of the rubber: the internal variable C_v^-1 at every integration point."""

    def __init__(self, rubber, x, ratio, tau):
        self.rubber, self.mu, self.tau = rubber, ratio - 1.0, tau
        self.past = self.inner = self._inverse(x)

    def _inverse(self, x):
        f = self.rubber.deformation(x)
        return np.linalg.inv(f.transpose(0, 1, 3, 2) @ f)

    def begin(self, dt):
        """Sets the rubber's law for a step; C^-1 runs linearly within it."""
        z = dt / self.tau
        keep = np.exp(-z)
        mean = (1 - keep) / z
        self.parts = keep, mean - keep, 1 - mean
        free = keep * self.inner + (mean - keep) * self.past
        self.rubber.a = np.eye(2) + self.mu * free
        self.rubber.m = 1 + self.mu * (1 - self.parts[2])

    def commit(self, x):
        now = self._inverse(x)
        keep, old, new = self.parts
        self.inner = keep * self.inner + old * self.past + new * now
        self.past = now


class StressMaxwell(Maxwell):
    """The same branch with another finite-strain law, S_1' = T' - S_1/tau.

    T is the deviatoric second Piola-Kirchhoff stress of the branch's spring. Both laws agree at
    small strain. The part of T along C^-1 joins the pressure within the step.
    """

    def __init__(self, rubber, x, ratio, tau):
        super().__init__(rubber, x, ratio, tau)
        self.past = self._spring(x)
        self.inner = np.zeros_like(self.past)

    def _spring(self, x):
        f = self.rubber.deformation(x)
        c = f.transpose(0, 1, 3, 2) @ f
        trace = (c[..., 0, 0] + c[..., 1, 1] + 1) / 3
        return self.mu * (np.eye(2) - trace[..., None, None] * np.linalg.inv(c))

    def begin(self, dt):
        z = dt / self.tau
        keep = np.exp(-z)
        mean = (1 - keep) / z
        self.parts = keep, mean
        self.rubber.a = (1 + self.mu * mean) * np.eye(2) + keep * self.inner - mean * self.past
        self.rubber.m = 1 + self.mu * mean

    def commit(self, x):
        now = self._spring(x)
        keep, mean = self.parts
        self.inner = keep * self.inner + mean * (now - self.past)
        self.past = now
