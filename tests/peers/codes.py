"""The other codes. Each assembles the internal force and its derivative at given displacements, with its own elements,
quadrature, assembly and, where it has them, laws; nodes are numbered as in `block.Mesh`."""

import laws
import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree


def permutation(places, x):
    """For each node of the other code the number of ours at the same place."""
    distance, ours = cKDTree(x).query(places)
    assert distance.max() < 1e-12 and len(set(ours)) == len(x), "the codes have different nodes"
    return ours


class FElupe:
    """Its own linear elasticity, neo-Hookean law (ln J) and volumetric law; the rest by automatic differentiation."""

    name = "FElupe"

    def __init__(self, mesh, law):
        import felupe
        import felupe.constitution.tensortrax as auto
        from tensortrax.math import sqrt, trace
        from tensortrax.math.linalg import det

        def stable(C):
            J = sqrt(det(C))
            return laws.MU / 2 * (trace(C) - 3) - laws.MU * (J - 1) + (laws.LAMBDA + laws.MU) / 2 * (J - 1) ** 2

        models, bulk = auto.models.hyperelastic, felupe.Volumetric(bulk=laws.KAPPA)
        material = {
            "linear": lambda: felupe.LinearElastic(E=laws.E, nu=laws.NU),
            "st-venant-kirchhoff": lambda: auto.Hyperelastic(models.saint_venant_kirchhoff, mu=laws.MU, lmbda=laws.LAMBDA),
            "neo-hookean": lambda: felupe.NeoHookeCompressible(mu=laws.MU, lmbda=laws.LAMBDA),
            "stable-neo-hookean": lambda: auto.Hyperelastic(stable),
            "mooney-rivlin": lambda: auto.Hyperelastic(models.mooney_rivlin, C10=laws.C10, C01=laws.C01) & bulk,
            "yeoh": lambda: auto.Hyperelastic(models.yeoh, C10=0.5 * laws.MU, C20=laws.C20, C30=laws.C30) & bulk,
        }[law]()
        if mesh.order == 1:
            region = felupe.RegionTetra(felupe.Mesh(mesh.x, mesh.tets, "tetra"))
        else:
            # Its table of the four points has seven digits, which alone makes a difference of 1e-8: all digits here.
            points = felupe.TetrahedronQuadrature(order=2)
            near, far = (5 + 3 * 5**0.5) / 20, (5 - 5**0.5) / 20
            points.points = np.where(points.points > 0.5, near, far)
            region = felupe.RegionQuadraticTetra(felupe.Mesh(mesh.x, mesh.tets, "tetra10"), quadrature=points)
        self.field = felupe.FieldContainer([felupe.Field(region, dim=3)])
        self.body = felupe.SolidBody(material, self.field)

    def assemble(self, u):
        self.field[0].values[:] = u
        f = self.body.assemble.vector(self.field)
        return np.asarray(f.todense()).ravel(), csr_matrix(self.body.assemble.matrix(self.field))


class ScikitFem:
    """P(F) by hand (`laws.stress`)."""

    name = "scikit-fem"

    def __init__(self, mesh, law):
        import skfem

        element = skfem.ElementTetP1() if mesh.order == 1 else skfem.ElementTetP2()
        grid = skfem.MeshTet(mesh.corners.T.copy(), mesh.linear.T.copy())
        self.basis = skfem.Basis(grid, skfem.ElementVector(element), intorder=mesh.order if mesh.order == 2 else 1)
        places, ours = self.basis.doflocs.T, np.empty(self.basis.N, dtype=int)
        for component, of in enumerate(component_dofs(self.basis)):
            ours[of] = 3 * permutation(places[of], mesh.x) + component
        self.ours, self.law = ours, law

        @skfem.LinearForm
        def force(v, w):
            return np.einsum("ijeq,ijeq->eq", w.P, v.grad)

        @skfem.BilinearForm
        def stiffness(u, v, w):
            return np.einsum("ijkleq,kleq,ijeq->eq", w.A, u.grad, v.grad)

        self.force, self.stiffness = force, stiffness

    def assemble(self, u):
        grad = self.basis.interpolate(u.ravel()[self.ours]).grad
        F = np.moveaxis(grad, (0, 1), (2, 3)) + np.eye(3)
        P = np.moveaxis(laws.stress(self.law, F), (2, 3), (0, 1))
        A = np.moveaxis(laws.tangent(self.law, F), (2, 3, 4, 5), (0, 1, 2, 3))
        f = self.force.assemble(self.basis, P=P)
        K = self.stiffness.assemble(self.basis, A=A)
        return renumbered(f, K, self.ours)


def component_dofs(basis):
    names = basis.dofs.element.elem.dofnames
    assert len(names) == 1 or names == ["u", "u"], names
    nodal, edge = basis.nodal_dofs, basis.edge_dofs
    return [np.concatenate([nodal[c], edge[c] if edge.size else []]).astype(int) for c in range(3)]


class SfePy:
    """Its own terms: linear elasticity, Mooney-Rivlin and the bulk penalty."""

    name = "SfePy"
    laws = ("linear", "mooney-rivlin")

    def __init__(self, mesh, law):
        from sfepy.base.base import output
        from sfepy.discrete import Equation, Equations, FieldVariable, Integral, Material, Problem
        from sfepy.discrete.fem import FEDomain, Field
        from sfepy.discrete.fem import Mesh as Grid
        from sfepy.mechanics.matcoefs import stiffness_from_lame
        from sfepy.terms import Term

        output.set_output(quiet=True)
        grid = Grid.from_data("block", mesh.corners, None, [mesh.linear.astype(np.int32)],
                              [np.zeros(len(mesh.linear), dtype=np.int32)], ["3_4"])
        domain = FEDomain("domain", grid)
        omega = domain.create_region("Omega", "all")
        field = Field.from_args("fu", np.float64, "vector", omega, approx_order=mesh.order)
        u, v = FieldVariable("u", "unknown", field), FieldVariable("v", "test", field, primary_var_name="u")
        integral = Integral("i", order=mesh.order)
        if law == "linear":
            m = Material("m", D=stiffness_from_lame(3, laws.LAMBDA, laws.MU))
            terms = Term.new("dw_lin_elastic(m.D, v, u)", integral, omega, m=m, v=v, u=u)
        else:
            m = Material("m", mu=2 * laws.C10, kappa=2 * laws.C01, K=laws.KAPPA)
            names = ["dw_tl_he_neohook(m.mu, v, u)", "dw_tl_he_mooney_rivlin(m.kappa, v, u)", "dw_tl_bulk_penalty(m.K, v, u)"]
            terms = sum((Term.new(n, integral, omega, m=m, v=v, u=u) for n in names[1:]),
                        Term.new(names[0], integral, omega, m=m, v=v, u=u))
        self.problem = Problem("block", equations=Equations([Equation("balance", terms)]))
        self.problem.update_materials()
        self.problem.time_update()
        self.problem.equations.init_state()
        nodes = permutation(field.get_coor(), mesh.x)
        self.ours = (3 * nodes[:, None] + np.arange(3)).ravel()
        self.evaluator = self.problem.get_evaluator()

    def assemble(self, u):
        state = u.ravel()[self.ours]
        f = self.evaluator.eval_residual(state).copy()
        return renumbered(f, self.evaluator.eval_tangent_matrix(state), self.ours)


def renumbered(f, K, ours):
    K = K.tocoo()
    out = np.empty_like(f)
    out[ours] = f
    return out, csr_matrix((K.data, (ours[K.row], ours[K.col])), shape=K.shape)


CODES = [FElupe, ScikitFem, SfePy]
