"""cutis and codes that others use, on the same block, law, motion and accuracy: CPU time of a step, error, ratio.

    benches/peers/run             # about 1,200 and 10,400 tetrahedra
    benches/peers/run --small     # the first alone

    skull (held)     gap     mandible          advance: equilibrium, the mandible goes by 1.1 mm a step, ten steps
    ============            ==========         shake:   dynamics, weight, the bone below shaken at 2 Hz, 60 steps of 1/60 s

The codes without a solver of their own get Newton's method with the bones' motion in its first system, and PARDISO. Times
are CPU time of one thread, the median step; errors are of the nodes, against cutis's Newton at 1e-12 m with the same law
(MuJoCo: against the stable neo-Hookean law, so its own law counts as error).
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "peers"), str(ROOT / "tests" / "fmu")]
import laws  # noqa: E402
from block import Mesh  # noqa: E402
from clib import Library  # noqa: E402
from codes import FElupe, ScikitFem, SfePy  # noqa: E402

SIZE = np.array([0.1, 0.1, 0.04])
SIZES = {"1k": (8, 8, 3), "10k": (17, 17, 6)}
SETS = {"skull": lambda x: (np.abs(x[:, 2]) < 1e-12) & (x[:, 0] < 0.0401),
        "mandible": lambda x: (np.abs(x[:, 2]) < 1e-12) & (x[:, 0] > 0.0599)}
FLOOR = {"bone": lambda x: np.abs(x[:, 2]) < 1e-12}
STEP = np.array([0.0, 1e-3, 0.5e-3])
DENSITY, WEIGHT = 1000.0, 9.80665
# What cutis and the codes are asked to be accurate to on the skin, m.
ACCURATE = 1e-6


class NeoHookean(ScikitFem):
    """scikit-fem with the tangent of its law written out: by complex steps it would take most of the time."""

    def __init__(self, mesh):
        super().__init__(mesh, "neo-hookean")
        self.tangent = laws.tangent
        laws.tangent = lambda law, F: neo_hookean_tangent(F)


def neo_hookean_tangent(F):
    G, lnJ = np.swapaxes(np.linalg.inv(F), -1, -2), np.log(np.linalg.det(F))
    eye = np.eye(3)
    out = laws.LAMBDA * np.einsum("...ij,...kl->...ijkl", G, G)
    out -= (laws.LAMBDA * lnJ - laws.MU)[..., None, None, None, None] * np.einsum("...il,...kj->...ijkl", G, G)
    return out + laws.MU * np.einsum("ik,jl->ijkl", eye, eye)


class Cutis:
    """Through its C library, as any host has it."""

    def __init__(self, library, mesh, law, solver, more=""):
        bones = "".join(f'[[bone]]\nname = "{name}"\n' + ('drive = "held"\n' if name == "skull" else "") for name in mesh.sets)
        with tempfile.TemporaryDirectory() as folder:
            mesh.write(Path(folder) / "block.msh")
            start = time.process_time()
            self.sim = library.from_text(
                f'[mesh]\nfile = "block.msh"\n[[tissue]]\nenergy = "{law}"\n{laws.SCENE[law]}density = {DENSITY}\n'
                f"{bones}[solver]\n{solver}{more}", folder)
            self.sim.initialise()
            self.setup = time.process_time() - start
        rest = self.sim.get("skin.restPosition")
        order = lambda x: np.lexsort(np.round(x, 12).T)
        self.ours = np.empty(len(rest), dtype=int)
        self.ours[order(rest)] = order(mesh.x)
        self.rest, self.bones = rest, len(mesh.sets)

    def step(self, t, dt):
        moved = np.zeros((self.bones, 3))
        moved[-1] = t
        start = time.process_time()
        self.sim.set("bone.translation", moved)
        self.sim.step(dt)
        x = self.sim.get("skin.position")
        spent = time.process_time() - start
        u = np.empty_like(x)
        u[self.ours] = x - self.rest
        return u, spent


class Newton:
    """A code that assembles, with Newton's method around it."""

    def __init__(self, code, mesh):
        from pypardiso import PyPardisoSolver

        self.code, self.mesh, self.solver = code, mesh, PyPardisoSolver(mtype=11)
        dofs = lambda nodes: (3 * nodes[:, None] + np.arange(3)).ravel()
        self.moved = dofs(mesh.sets["mandible"])
        self.free = np.ones(mesh.x.size, dtype=bool)
        self.free[dofs(np.concatenate(list(mesh.sets.values())))] = False
        self.u = np.zeros(mesh.x.size)

    def step(self, t, _):
        start = time.process_time()
        step = np.zeros_like(self.u)
        step[self.moved] = np.tile(t, len(self.moved) // 3) - self.u[self.moved]
        for _ in range(20):
            f, K = self.code.assemble(self.u.reshape(-1, 3))
            rows = K[self.free]
            step[self.free] = self.solver.solve(rows[:, self.free].tocsr(), -(f[self.free] + rows @ step))
            self.u += step
            if np.abs(step[self.free]).max() < ACCURATE:
                break
            step = np.zeros_like(self.u)
        return self.u.reshape(-1, 3).copy(), time.process_time() - start


class MuJoCo:
    """A flexible body whose floor is pinned; the shaking is the weight of a frame that is shaken."""

    def __init__(self, mesh, dt):
        import mujoco

        self.mujoco = mujoco
        numbers = lambda a: " ".join(repr(v) for v in np.asarray(a).ravel().tolist())
        mass = np.zeros(len(mesh.x))
        np.add.at(mass, mesh.tets.ravel(), np.repeat(DENSITY * volumes(mesh) / 4, 4))
        start = time.process_time()
        self.model = mujoco.MjModel.from_xml_string(f"""
            <mujoco><option timestep="{dt!r}" solver="CG" integrator="discrete"/>
            <size memory="2G"/><worldbody><flexcomp name="f" type="direct" dim="3" mass="{float(mass.sum())!r}" radius="1e-4"
              point="{numbers(mesh.x)}" element="{numbers(mesh.tets)}">
              <elasticity young="{laws.E!r}" poisson="{laws.NU!r}" damping="0"/>
              <contact selfcollide="none" contype="0" conaffinity="0"/>
              <pin id="{numbers(mesh.sets['bone'])}"/></flexcomp></worldbody></mujoco>""")
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.setup = time.process_time() - start
        self.rest = self.data.flexvert_xpos.copy()

    def step(self, t, acceleration):
        self.model.opt.gravity[:] = [-acceleration, 0, -WEIGHT]
        start = time.process_time()
        self.mujoco.mj_step(self.model, self.data)
        spent = time.process_time() - start
        # Places of the vertices follow at the next forward pass; asking for them now is not the step's cost.
        self.mujoco.mj_kinematics(self.model, self.data)
        self.mujoco.mj_flex(self.model, self.data)
        return self.data.flexvert_xpos - self.rest + t, spent


def volumes(mesh):
    x = mesh.x[mesh.tets]
    return np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / 6


def off(u, truth):
    return 1e3 * max(np.linalg.norm(a - b, axis=1).max() for a, b in zip(u, truth))


def row(name, size, law, times, error, ours=None):
    median = 1e3 * float(np.median(times))
    ratio = "" if ours is None else f"{median / ours:.1f}"
    print(f"| {name} | {size} | {law} | {median:.3g} | {error:.1e} | {ratio} |", flush=True)
    return median


def advance(library, size):
    mesh = Mesh(1, SIZE, SIZES[size], 0.0, SETS)
    path = [k * STEP for k in range(1, 11)]
    for law in ("neo-hookean", "mooney-rivlin"):
        run = lambda code: zip(*[code.step(t, 0.1) for t in path])
        truth, _ = run(Cutis(library, mesh, law, 'method = "newton"\ntolerance = 1e-12\n'))
        u, times = run(Cutis(library, mesh, law, f"tolerance = {ACCURATE}\n"))
        ours = row("cutis", size, law, times, off(u, truth))
        codes = [FElupe(mesh, law), NeoHookean(mesh)] if law == "neo-hookean" else [SfePy(mesh, law)]
        for code in codes:
            u, times = run(Newton(code, mesh))
            row(code.name, size, law, times, off(u, truth), ours)


def shake(library, size):
    mesh = Mesh(1, SIZE, SIZES[size], 0.0, FLOOR)
    dt, law = 1 / 60, "stable-neo-hookean"
    omega, reach = 4 * np.pi, 0.01
    place = lambda k: np.array([reach * np.sin(omega * k * dt), 0, 0])
    # The bone's acceleration as backward Euler sees it: at rest before the start.
    jolt = lambda k: (place(k) - 2 * place(k - 1) + place(max(k - 2, 0)))[0] / dt**2
    dynamic = '[gravity]\n[inertia]\nstart = "rest"\n'
    run = lambda code: zip(*[code.step(place(k), dt) for k in range(1, 61)])
    truth, _ = run(Cutis(library, mesh, law, 'method = "newton"\ntolerance = 1e-12\n', dynamic))
    u, times = run(Cutis(library, mesh, law, f"tolerance = {ACCURATE}\n", dynamic))
    ours = row("cutis", size, law + ", backward Euler", times, off(u, truth))
    code = MuJoCo(mesh, dt)
    u, times = zip(*[code.step(place(k), jolt(k)) for k in range(1, 61)])
    row("MuJoCo flex", size, "its own, implicit", times, off(u, truth), ours)


def main():
    release = ROOT / "target" / "release"
    library = max((p for p in [release / "libcutis.so", release / "deps" / "libcutis.so"] if p.exists()),
                  key=lambda p: p.stat().st_mtime)
    library = Library(library)
    import sfepy.terms  # noqa: F401  (says at import that jax is missing; not amid the table)

    print("| code | tets | law | ms a step | off by mm | times cutis |\n| --- | --- | --- | --- | --- | --- |")
    for size in ["1k"] if "--small" in sys.argv else SIZES:
        advance(library, size)
        shake(library, size)


if __name__ == "__main__":
    main()
