"""A general ODE solver on exactly the ring's equations.

Reads one problem as JSON from standard input, prints one JSON object: for every
solver, resolution and tolerance the figures of the crossing and the time it took.
The equations are compiled (ring.c), so that no interpreter is timed inside them.

Two forms. `reduced` eliminates the height of the centre by Newton's method in every
evaluation and leaves an ODE of the internal displacements, which is not stiff.
`damped` sets a damper beside the contact and keeps the height as a state; the
smaller the damper, the stiffer, and the nearer to the balance.
"""

import ctypes
import json
import math
import pathlib
import subprocess
import sys
import time

import numpy as np
import scipy
import scipy.sparse as sparse
from scipy.integrate import odeint, solve_ivp

HERE = pathlib.Path(__file__).parent


class Problem(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_double)
        for name in (
            "radius", "width", "k_inf", "k_0", "tau", "step", "speed", "preload",
            "start", "pitch", "damping",
        )
    ] + [("count", ctypes.c_long), ("angle", ctypes.POINTER(ctypes.c_double))]


def compiled(folder):
    """The equations as a shared library, built by the C compiler."""
    target = pathlib.Path(folder) / "ring.so"
    subprocess.run(
        ["cc", "-O3", "-march=native", "-fno-math-errno", "-shared", "-fPIC",
         "-o", str(target), str(HERE / "ring.c"), "-lm"],
        check=True,
    )
    library = ctypes.CDLL(str(target))
    library.rates_reduced.restype = ctypes.c_long
    return library


def pointer(array):
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


class Ring:
    """One crossing with `elements` around the ring."""

    def __init__(self, library, given, elements, damping=1.0):
        self.library = library
        self.end_s = (given["end_mm"] - given["start_mm"]) / given["speed_mm_s"]
        pitch = 2 * math.pi / elements
        # Elements that can touch the wall at some time between start and end.
        turn = (given["end_mm"] - given["start_mm"]) / given["radius_mm"]
        first, last = math.ceil(-0.7 / pitch), math.floor((turn + 0.7) / pitch)
        self.angle = np.arange(first, last + 1) * pitch
        if len(self.angle) > elements:
            raise ValueError("the wheel turns more than once")
        self.count = len(self.angle)
        self.problem = Problem(
            given["radius_mm"], given["width_mm"], given["k_inf"], given["k_0"], given["tau_s"],
            given["step_height_mm"], given["speed_mm_s"], given["preload_n"], given["start_mm"],
            pitch, damping, self.count, pointer(self.angle),
        )
        self.by_reference = ctypes.byref(self.problem)
        self.rate = np.zeros(self.count + 1)
        self.given = given
        self.reset()

    def reset(self):
        self.height = ctypes.c_double(self.given["radius_mm"] - 0.01)
        self.evaluations = 0
        self.sums = 0

    def reduced(self, t, q):
        rate = np.empty(self.count)
        q = np.ascontiguousarray(q)
        self.evaluations += 1
        sums = self.library.rates_reduced(
            self.by_reference, ctypes.c_double(t), pointer(q), ctypes.byref(self.height),
            pointer(rate))
        if sums < 0:
            raise ArithmeticError("no height balances the preload")
        self.sums += sums
        return rate

    def damped(self, t, state):
        rate = np.empty(self.count + 1)
        state = np.ascontiguousarray(state)
        self.evaluations += 1
        self.sums += 1
        self.library.rates_damped(
            self.by_reference, ctypes.c_double(t), pointer(state), pointer(rate))
        return rate

    def damped_jacobian(self, t, state):
        column, row = np.empty(self.count), np.empty(self.count + 1)
        state = np.ascontiguousarray(state)
        self.sums += 1
        self.library.jacobian_damped(
            self.by_reference, ctypes.c_double(t), pointer(state), pointer(column), pointer(row))
        diagonal = sparse.diags(np.full(self.count, -1 / self.problem.tau))
        return sparse.bmat(
            [[diagonal, column[:, None]], [row[None, :-1], row[None, -1:]]], format="csc")

    def at(self, t, q, height=None):
        """Place, height, floor pressure and axial force in this state."""
        q = np.ascontiguousarray(q)
        if height is None:
            self.reduced(t, q)
            height = self.height.value
        out = np.empty(4)
        self.library.read_out(
            self.by_reference, ctypes.c_double(t), pointer(q), ctypes.c_double(height),
            pointer(out))
        return self.given["start_mm"] + self.given["speed_mm_s"] * t, out[0], out[2], out[1]

    def figures(self, times, states):
        """Gap and largest axial force, read from the solution at `times`; not timed."""
        radius = self.given["radius_mm"]
        run = math.sqrt(radius**2 - (radius - self.given["step_height_mm"])**2)
        damped = states.shape[1] > self.count
        reads = []
        self.reset()
        for t, state in zip(times, states):
            reads.append(self.at(t, state[: self.count], state[-1] if damped else None))
        near = [read[3] for read in reads if abs(read[0]) < run + 0.5 * radius]
        for index, (a, b) in enumerate(zip(reads, reads[1:])):
            if -run < a[0] and b[0] < 0 and a[2] > 0 >= b[2]:
                if not damped:
                    a, b = self.narrowed(times[index: index + 2], states[index: index + 2])
                part = a[2] / (a[2] - b[2])
                x, y = (p + part * (q - p) for p, q in zip(a[:2], b[:2]))
                return math.hypot(x, y) - radius, max(near)
        return None, max(near)

    def narrowed(self, times, states):
        """The sixteenth of this interval in which the floor stops carrying."""
        width = times[1] - times[0]
        rates = [self.reduced(t, q) for t, q in zip(times, states)]
        before = None
        for s in np.linspace(0, 1, 17):
            # Cubic through states and rates of both ends.
            q = ((1 + 2 * s) * (1 - s)**2 * states[0] + s * (1 - s)**2 * width * rates[0]
                 + s**2 * (3 - 2 * s) * states[1] - s**2 * (1 - s) * width * rates[1])
            now = self.at(times[0] + s * width, q)
            if before and before[2] > 0 >= now[2]:
                return before, now
            before = now
        return before, before[:2] + (-before[2],) + before[3:]


def start_height(ring):
    """The balanced height at the start, where no element has memory yet."""
    ring.reset()
    ring.reduced(0.0, np.zeros(ring.count))
    return ring.height.value


def grid(ring, stride_mm=0.02):
    return np.linspace(0, ring.end_s, int(ring.end_s * ring.given["speed_mm_s"] / stride_mm) + 1)


def by_odeint(ring, tolerance):
    """LSODA, its loop itself compiled."""
    times = grid(ring, 0.1)
    states, info = odeint(
        ring.reduced, np.zeros(ring.count), times, tfirst=True, rtol=tolerance,
        atol=tolerance, mxstep=100_000, full_output=True)
    return times, lambda _: states, int(info["nst"][-1])


def by_runge_kutta(method):
    def solve(ring, tolerance):
        out = solve_ivp(ring.reduced, (0, ring.end_s), np.zeros(ring.count), method=method,
                        rtol=tolerance, atol=tolerance, dense_output=True)
        return grid(ring), lambda times: out.sol(times).T, len(out.t) - 1
    return solve


def by_implicit(method):
    def solve(ring, tolerance):
        begin = np.zeros(ring.count + 1)
        begin[-1] = start_height(ring)
        ring.reset()
        out = solve_ivp(ring.damped, (0, ring.end_s), begin, method=method, rtol=tolerance,
                        atol=tolerance, jac=ring.damped_jacobian, dense_output=True)
        return grid(ring), lambda times: out.sol(times).T, len(out.t) - 1
    return solve


def measure(ring, solve, tolerance, repeats, budget_s):
    """Figures of a solution and the least processor time that it took."""
    best, spent = math.inf, 0.0
    for _ in range(repeats):
        ring.reset()
        begun = time.thread_time()
        times, states, steps = solve(ring, tolerance)
        took = time.thread_time() - begun
        best, spent = min(best, took), spent + took
        if spent + took > budget_s:
            break
    evaluations, sums = ring.evaluations, ring.sums
    gap, force = ring.figures(times, states(times))
    return {"seconds": best, "gap_mm": gap, "corner_force_n": float(force), "steps": steps,
            "evaluations": evaluations, "contact_sums": sums}


# Tolerances from the loosest that holds to where the elements' own error is left.
SOLVERS = {
    "LSODA": (by_odeint, (1e-2, 1e-3, 1e-4, 1e-5)),
    "RK23": (by_runge_kutta("RK23"), (1e-2, 1e-3, 1e-4, 1e-5)),
    "DOP853": (by_runge_kutta("DOP853"), (1e-2, 1e-3, 1e-4)),
    "Radau": (by_implicit("Radau"), (1e-2, 1e-3, 1e-4)),
    "BDF": (by_implicit("BDF"), (1e-2, 1e-3, 1e-4)),
}

# Damper beside the contact, N s/mm: it settles within a millisecond, a hundredth of
# the rubber's relaxation.
DAMPING = 0.1


def main():
    given = json.load(sys.stdin)
    library = compiled(given["folder"])
    points = []
    for name, (solve, tolerances) in SOLVERS.items():
        for elements in given["elements"]:
            for tolerance in tolerances:
                try:
                    ring = Ring(library, given, elements, DAMPING)
                    point = measure(ring, solve, tolerance, given["repeats"], given["budget_s"])
                except (ArithmeticError, ValueError) as error:
                    print(f"{name} {elements} {tolerance}: {error}", file=sys.stderr)
                    continue
                points.append({"name": name, "elements": elements, "tolerance": tolerance,
                               **point})
    json.dump({"version": f"SciPy {scipy.__version__}", "points": points}, sys.stdout)


if __name__ == "__main__":
    main()
