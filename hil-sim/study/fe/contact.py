"""Contact of rim nodes with the walls, as an active set.

The lower wall is y = 0, the riser x = 0, the upper wall y = h; the sharp edge is at (0, h). One rim
node is pinned to the edge. Nodes ahead of it may bear on the upper wall, nodes behind it on the
riser or the lower wall. A bearing node keeps one coordinate and is free along the wall;
with `grip` a node on the step keeps both.
"""

import numpy as np

FLOOR, FACE, TOP = 0, 1, 2


class Contact:
    def __init__(self, mesh, h):
        self.h, self.rim = h, mesh.rim
        n = len(mesh.rim)
        arc = np.linalg.norm(np.diff(mesh.nodes[mesh.rim], axis=0, append=mesh.nodes[mesh.rim[:1]]), axis=1)
        self.arc = np.concatenate([[0.0], np.cumsum(arc)[:-1]])
        self.around = arc.sum()
        self.edge = None  # place in `rim` of the pinned node
        self.floor_open = True  # whether the lower wall is there
        self.sets = [np.zeros(n, bool) for _ in range(3)]
        self.seen = set()
        self.grip = False  # whether nodes that bear on the step stay where they touched it
        self.held_at = np.zeros((n, 2))

    def pin(self, place):
        self.edge = place

    def _candidates(self):
        """Which nodes may touch the lower wall, the riser and the upper wall."""
        if self.edge is None:
            return np.ones(len(self.rim), bool), np.zeros(len(self.rim), bool), np.zeros(len(self.rim), bool)
        ahead = (self.arc - self.arc[self.edge]) % self.around
        behind = self.around - ahead
        free = ahead > 0
        return free & (behind < 50), free & (behind < 8), free & (ahead < 15)

    def fixed(self):
        """Degrees of freedom that are held, and where."""
        dofs = [2 * self.rim[self.sets[FLOOR]] + 1, 2 * self.rim[self.sets[FACE]], 2 * self.rim[self.sets[TOP]] + 1]
        values = [np.zeros(len(dofs[0])), np.zeros(len(dofs[1])), np.full(len(dofs[2]), self.h)]
        if self.grip:
            for kind, along in ((FACE, 1), (TOP, 0)):
                dofs.append(2 * self.rim[self.sets[kind]] + along)
                values.append(self.held_at[self.sets[kind], along])
        if self.edge is not None:
            node = self.rim[self.edge]
            dofs.append(np.array([2 * node, 2 * node + 1]))
            values.append(np.array([0.0, self.h]))
        return np.concatenate(dofs).astype(int), np.concatenate(values)

    def update(self, x, force):
        """Lets go of nodes that are pulled, takes hold of nodes that are through; True if any."""
        at, f = x[self.rim], force.reshape(-1, 2)[self.rim]
        floor, face, top = self._candidates()
        through = [
            floor & (at[:, 1] < -1e-9) & self.floor_open,
            face & (at[:, 0] > 1e-9) & (at[:, 1] < self.h + 1),
            top & (at[:, 1] < self.h - 1e-9),
        ]
        push = [f[:, 1], -f[:, 0], f[:, 1]]
        new = []
        for old, enter, value, may in zip(self.sets, through, push, (floor, face, top)):
            new.append((old & (value > -1e-12) | enter & ~old) & may)
        key = b"".join(np.packbits(s).tobytes() for s in new)
        changed = any((a != b).any() for a, b in zip(new, self.sets))
        if changed and key in self.seen:
            return False  # a node at the end of a patch that neither bears nor clears
        self.seen.add(key)
        fresh = (new[FACE] & ~self.sets[FACE]) | (new[TOP] & ~self.sets[TOP])
        self.held_at = np.where(fresh[:, None], at, self.held_at)
        self.sets = new
        return changed

    def floor_load(self, force):
        return float(force[2 * self.rim[self.sets[FLOOR]] + 1].sum())

    def lowest(self, x):
        """Height of the lowest point behind the edge, on the rim's quadratic, and its weights."""
        y = x[self.rim, 1].copy()
        if self.edge is not None:
            y[~self._candidates()[0]] = np.inf
        n = len(y)
        best = None
        i = int(np.argmin(y))
        for mid in (i - 1, i, i + 1):
            if mid % 2 == 0:
                continue
            trio = np.array([mid - 1, mid % n, mid + 1]) % n
            a, b, c = x[self.rim[trio], 1]
            bend = a - 2 * b + c
            s = np.clip((a - c) / (2 * bend), -1, 1) if bend > 0 else float(np.sign(a - c))
            w = np.array([s * (s - 1) / 2, 1 - s * s, s * (s + 1) / 2])
            value = float(w @ [a, b, c])
            if best is None or value < best[0]:
                best = value, self.rim[trio], w
        return best

    def copy(self):
        other = object.__new__(Contact)
        other.__dict__ = dict(self.__dict__, sets=[s.copy() for s in self.sets], seen=set())
        return other
