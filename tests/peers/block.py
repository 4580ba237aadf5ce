"""A distorted block of tetrahedra that every code gets: nodes, corners, mid-edge nodes, node sets, a Gmsh file."""

import itertools

import numpy as np

SIZE = np.array([0.06, 0.04, 0.03])
CELLS = (4, 3, 3)
EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
FACES = [(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)]


class Mesh:
    """`x` (n, 3) m; `tets` (e, 4), or (e, 10) with mid-edge nodes in VTK's order; `sets` name -> node numbers."""

    def __init__(self, order, size=SIZE, cells=CELLS, jitter=0.0015, sets=None):
        """A box of `cells`, its inner corners moved by up to `jitter` (m); `sets` name -> which of (n, 3) places."""
        n = np.array(cells) + 1
        grid = np.stack(np.meshgrid(*[np.arange(k) for k in n], indexing="ij"), -1).reshape(-1, 3)
        self.corners = grid / np.array(cells) * size
        inner = np.all((grid > 0) & (grid < np.array(cells)), axis=1)
        self.corners[inner] += np.random.default_rng(7).uniform(-jitter, jitter, (inner.sum(), 3))
        at = lambda c: (c[0] * n[1] + c[1]) * n[2] + c[2]
        tets = []
        for cube in itertools.product(*[range(k) for k in cells]):
            for walk in itertools.permutations(range(3)):
                path = [np.array(cube)]
                for axis in walk:
                    path.append(path[-1] + np.eye(3, dtype=int)[axis])
                tets.append([at(c) for c in path])
        self.linear = np.array([t if volume(self.corners[t]) > 0 else [t[0], t[1], t[3], t[2]] for t in tets])
        self.x, self.tets = self.corners, self.linear
        if order == 2:
            middle = {}
            number = lambda a, b: middle.setdefault((min(a, b), max(a, b)), len(self.corners) + len(middle))
            self.tets = np.array([[*t, *(number(t[i], t[j]) for i, j in EDGES)] for t in self.linear])
            self.x = np.vstack([self.corners, [self.corners[list(e)].mean(0) for e in middle]])
        # Whole faces of the block, so that mid-edge nodes belong to a set exactly where they lie on its face.
        sets = sets or {"floor": lambda x: np.abs(x[:, 0]) < 1e-12, "handle": lambda x: np.abs(x[:, 0] - size[0]) < 1e-12}
        self.sets = {name: np.flatnonzero(holds(self.x)) for name, holds in sets.items()}
        self.order = order

    def write(self, path):
        """Gmsh 2.2. Its face set `skin` holds every face of every tetrahedron, so that hosts can read every node."""
        faces = {tuple(sorted(t[list(f)])): t[list(f)] for t in self.linear for f in FACES}
        names = ['3 1 "tissue"', '2 2 "skin"', *(f'0 {3 + k} "{s}"' for k, s in enumerate(self.sets))]
        rows = [(4, 1, t) for t in self.linear] + [(2, 2, f) for f in faces.values()]
        for k, nodes in enumerate(self.sets.values()):
            rows += [(15, 3 + k, [a]) for a in nodes if a < len(self.corners)]
        text = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names)), *names]
        text += ["$EndPhysicalNames", "$Nodes", str(len(self.corners))]
        text += [f"{a + 1} " + " ".join(repr(float(c)) for c in x) for a, x in enumerate(self.corners)]
        text += ["$EndNodes", "$Elements", str(len(rows))]
        text += [f"{e + 1} {kind} 2 {tag} {tag} " + " ".join(str(a + 1) for a in nodes)
                 for e, (kind, tag, nodes) in enumerate(rows)]
        path.write_text("\n".join([*text, "$EndElements", ""]))


def volume(x):
    return np.linalg.det(x[1:] - x[0]) / 6
