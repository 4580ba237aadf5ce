"""Two-way coupling: the jaw is a rigid body of this host, the tissue around it is a co-simulation component.

                      pose: translation, rotation
      +-------------+ --------------------------> +-----------+
      | rigid jaw   |                             | cutis.fmu |     K = d reaction / d pose (6 x 6)
      | m, I, F(t)  | <-------------------------- | tissue    |
      +-------------+   reaction force, torque    +-----------+

  explicit   M (v' - v)/H = r(q)           + F - D v'     q' = q + H v'   stable for H < 2/omega of the stiffest motion
  Jacobian   M (v' - v)/H = r(q) + K H w/2 + F - D w      q' = q + H w    w = (v + v')/2: stable for any H

    pip install fmpy==0.3.32 numpy matplotlib
    cutis fmu examples/coupling/scene.toml -o target/coupling
    python examples/coupling/jaw.py target/coupling/cutis.fmu --plot out/coupling.png

K comes from fmi3GetDirectionalDerivative and makes the implicit midpoint rule of it, one linear solve a step.

Number to expect: explicit exchange runs away at steps of 12 ms and more, with the Jacobian none of the steps does.
"""

import argparse
import shutil
import sys
from ctypes import POINTER, c_double, c_uint32

import fmpy
import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave

MASS, INERTIA = 0.1, np.diag([1.2e-4, 1.0e-4, 1.6e-4])  # kg, kg m2: a mandible with its teeth
DAMPING = np.diag([1.0] * 3 + [1e-3] * 3)  # N s/m, N m s: the joints
GRAVITY = np.array([0.0, 0.0, -9.81])  # m/s2; z is up
RUNAWAY = 0.05  # m, rad: further than any jaw goes
M = np.block([[MASS * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), INERTIA]])


def muscles(t):
    """Force at the centre of mass, N: opened for a quarter of a second, then closed."""
    pull = -3.0 * np.sin(np.pi * t / 0.25) if t < 0.25 else 4.0 * np.sin(np.pi * (t - 0.25) / 0.25) if t < 0.5 else 0.0
    return np.array([0.0, 0.2 * pull, pull])


class Tissue:
    """The component: pose of the jaw in, reaction and its derivative out."""

    def __init__(self, archive):
        about = fmpy.read_model_description(archive)
        self.references = {v.name: v.valueReference for v in about.modelVariables}
        self.bones = next(v.shape[0] for v in about.modelVariables if v.name == "bone.translation")
        self.folder = fmpy.extract(archive)
        self.fmu = FMU3Slave(
            guid=about.instantiationToken, unzipDirectory=self.folder, modelIdentifier="cutis", instanceName="tissue"
        )
        self.fmu.instantiate()

    def start(self):
        self.fmu.reset()
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def _rows(self, six):
        """Force-like or motion-like six numbers of the jaw, the last bone, as two arrays of all bones."""
        rows = np.zeros((2, self.bones, 3))
        rows[:, -1] = six.reshape(2, 3)
        return rows.ravel()

    def _refs(self, *names):
        return [self.references[f"bone.{name}"] for name in names]

    def step(self, t, H, q):
        """Reaction on the jaw at pose `q`, N and N m."""
        self.fmu.setFloat64(self._refs("translation", "rotation"), self._rows(q).tolist())
        self.fmu.doStep(t, H)
        r = self.fmu.getFloat64(self._refs("reactionForce", "reactionTorque"), 6 * self.bones)
        return np.array(r).reshape(2, self.bones, 3)[:, -1].ravel()

    def jacobian(self):
        """d reaction / d pose at the last step, N/m and so on: six directional derivatives."""
        out, unknowns = self._refs("reactionForce", "reactionTorque"), 6 * self.bones
        columns = [
            self.fmu.getDirectionalDerivative(out, self._refs("translation", "rotation"), self._rows(e).tolist(), unknowns)
            for e in np.eye(6)
        ]
        return np.array(columns).reshape(6, 2, self.bones, 3)[:, :, -1].reshape(6, 6).T

    def close(self):
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


def run(tissue, H, end, with_jacobian):
    """Times and poses of the jaw; they end early where the exchange runs away."""
    tissue.start()
    q, v = np.zeros(6), np.zeros(6)  # translation and rotation vector; small rotations add up
    times, poses = [0.0], [q]
    for k in range(round(end / H)):
        t = k * H
        try:
            r = tissue.step(t, H, q)
            K = tissue.jacobian() if with_jacobian else np.zeros((6, 6))
        except FMICallException:
            break
        F = np.concatenate([muscles(t + H / 2) + MASS * GRAVITY, np.zeros(3)])
        if with_jacobian:
            half = H / 2 * DAMPING - H * H / 4 * K
            after = np.linalg.solve(M + half, (M - half) @ v + H * (r + F))
            q, v = q + H / 2 * (v + after), after
        else:
            v = np.linalg.solve(M + H * DAMPING, M @ v + H * (r + F))
            q = q + H * v
        times.append(t + H)
        poses.append(q)
        if np.abs(q).max() > RUNAWAY:
            break
    return np.array(times), np.array(poses)


def survey(tissue, steps, end, fine):
    """For every step size: largest distance from the fine run, m, or None where it ran away; by method. And the runs."""
    t0, q0 = run(tissue, fine, end, False)
    table, runs = [], {("fine", fine): (t0, q0)}
    for H in steps:
        row = [H]
        for name, jacobian in (("explicit", False), ("Jacobian", True)):
            t, q = run(tissue, H, end, jacobian)
            runs[name, H] = (t, q)
            arrived = abs(t[-1] - round(end / H) * H) < 1e-9 and np.abs(q).max() < RUNAWAY
            reference = np.array([np.interp(t, t0, q0[:, a]) for a in range(3)]).T
            row.append(np.linalg.norm(q[:, :3] - reference, axis=1).max() if arrived else None)
        table.append(row)
    return table, runs


def plot(path, runs, steps, end):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 3.6), sharey=True)
    (t0, q0) = next(run for (name, _), run in runs.items() if name == "fine")
    for axis, name in zip(axes, ("explicit", "Jacobian")):
        axis.plot(t0, 1e3 * q0[:, 2], "k", lw=1, label=f"{1e3 * (t0[1] - t0[0]):.3g} ms")
        for H in steps:
            t, q = runs[name, H]
            axis.plot(t, 1e3 * q[:, 2], ".-", ms=4, lw=1, label=f"{1e3 * H:.3g} ms")
        axis.set(title="explicit exchange" if name == "explicit" else "with the interface Jacobian", xlabel="t / s")
        axis.set(xlim=(0, end), ylim=(-6, 6))
        axis.grid(alpha=0.3)
        axis.legend(title="step", fontsize=8)
    axes[0].set_ylabel("height of the jaw / mm")
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("archive", nargs="?", default="target/coupling/cutis.fmu")
    parser.add_argument("--steps", type=float, nargs="+", default=[0.004, 0.008, 0.012, 0.02, 0.04], help="s")
    parser.add_argument("--fine", type=float, default=0.001, help="step of the run to compare with, s")
    parser.add_argument("--end", type=float, default=0.6, help="s")
    parser.add_argument("--plot", help="picture to write")
    wanted = parser.parse_args()
    tissue = Tissue(wanted.archive)
    table, runs = survey(tissue, wanted.steps, wanted.end, wanted.fine)
    tissue.close()
    print(f"largest distance from a run with steps of {1e3 * wanted.fine:g} ms\n    step    explicit   with Jacobian")
    for H, *found in table:
        print(f"{1e3 * H:5.1f} ms" + "".join("   runs away" if e is None else f"  {1e3 * e:7.2f} mm" for e in found))
    if wanted.plot:
        plot(wanted.plot, runs, wanted.steps, wanted.end)
    return 0 if all(jacobian is not None for _, _, jacobian in table) and table[-1][1] is None else 1


if __name__ == "__main__":
    sys.exit(main())
