"""Materials times jaw openings, each an FMU run of its own, in parallel by Dask: here, or on a cluster.

    factors on E x angles  -->  scheduler  -->  workers, one FMU instance each  -->  sweep.csv, sweep.png

    pip install fmpy==0.3.32 numpy "dask[distributed]" matplotlib
    cargo build --release
    python examples/sweep.py                                # a cluster of this machine's cores
    python examples/sweep.py --address tcp://host:8786      # one that runs already; its workers want fmpy and numpy

Number to expect: the torque on the jaw at 8 degrees grows in proportion to the stiffness, 0.62 N m a factor of one.
"""

import argparse
import csv
import hashlib
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
STEPS = 4  # increments to a pose


def archive_bytes(cutis, scene, factor):
    """The component of `scene` with every E multiplied by `factor`."""
    scaled = re.sub(r"(?m)^E\s*=\s*(\S+)", lambda m: f"E = {float(m[1]) * factor!r}", Path(scene).read_text())
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "scene.toml").write_text(scaled)
        subprocess.run([cutis, "fmu", f"{folder}/scene.toml", "-o", folder], check=True, stdout=subprocess.DEVNULL)
        return (Path(folder) / "cutis.fmu").read_bytes()


def opened(archive, factor, angle):
    """One run: the jaw turned by `angle`, rad. Torque on it, N m, and the position of every marker, m."""
    import fmpy
    from fmpy.fmi3 import FMU3Slave

    # Runs of one archive share a folder on their worker.
    folder = Path(tempfile.gettempdir()) / f"cutis-sweep-{hashlib.sha256(archive).hexdigest()[:16]}"
    path = folder / "cutis.fmu"
    if not (folder / "unpacked").exists():
        folder.mkdir(exist_ok=True)
        path.write_bytes(archive)
        unpacked = tempfile.mkdtemp(dir=folder)
        fmpy.extract(str(path), unzipdir=unpacked)
        try:
            Path(unpacked).rename(folder / "unpacked")
        except OSError:
            pass  # another run was faster
    about = fmpy.read_model_description(str(folder / "unpacked"))
    variables = {v.name: v for v in about.modelVariables}
    fmu = FMU3Slave(
        guid=about.instantiationToken, unzipDirectory=str(folder / "unpacked"), modelIdentifier="cutis", instanceName="run"
    )
    fmu.instantiate()
    try:
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        rotation = np.zeros(variables["bone.rotation"].shape)
        for k in range(STEPS):
            rotation[-1, 0] = angle * (k + 1) / STEPS
            fmu.setFloat64([variables["bone.rotation"].valueReference], rotation.ravel().tolist())
            fmu.doStep(k / STEPS, 1 / STEPS)
        read = lambda name: np.array(  # noqa: E731
            fmu.getFloat64([variables[name].valueReference], int(np.prod(variables[name].shape)))
        ).reshape(variables[name].shape)
        return factor, angle, float(np.linalg.norm(read("bone.reactionTorque")[-1])), read("marker.position").ravel().tolist()
    finally:
        fmu.freeInstance()


def plot(path, rows):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(figsize=(6, 3.6))
    for factor in sorted({row[0] for row in rows}):
        angle, torque = zip(*sorted((row[1], row[2]) for row in rows if row[0] == factor))
        axis.plot(np.degrees(angle), torque, "o-", ms=4, label=f"{factor:g} E")
    axis.set(xlabel="opening of the jaw / degrees", ylabel="torque of the tissue / N m")
    axis.grid(alpha=0.3)
    axis.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", default=ROOT / "fmu" / "scene.toml", help="its last bone is the jaw")
    parser.add_argument("--cutis", default=ROOT / "target" / "release" / "cutis", help="the command line")
    parser.add_argument("--factors", type=float, nargs="+", default=[0.5, 1.0, 2.0, 4.0])
    parser.add_argument("--degrees", type=float, nargs="+", default=[2.0, 4.0, 6.0, 8.0])
    parser.add_argument("--address", help="scheduler of a cluster; a local one if left out")
    parser.add_argument("--workers", type=int, help="of the local cluster; one a core if left out")
    parser.add_argument("-o", "--out", type=Path, default=Path("out/sweep"))
    wanted = parser.parse_args()

    from dask.distributed import Client, LocalCluster, progress

    cluster = wanted.address or LocalCluster(n_workers=wanted.workers, threads_per_worker=1, dashboard_address=None)
    rows = []
    with Client(cluster) as client:
        archives = {factor: archive_bytes(wanted.cutis, wanted.scene, factor) for factor in wanted.factors}
        there = {factor: client.scatter(archive, broadcast=True) for factor, archive in archives.items()}
        runs = [
            client.submit(opened, there[factor], factor, np.radians(angle))
            for factor in wanted.factors
            for angle in wanted.degrees
        ]
        progress(runs, notebook=False)
        print()
        rows = client.gather(runs)
    if not wanted.address:
        cluster.close()

    wanted.out.mkdir(parents=True, exist_ok=True)
    with open(wanted.out / "sweep.csv", "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["factor", "angle", "torque"] + [f"marker{k // 3 + 1}.{'xyz'[k % 3]}" for k in range(len(rows[0][3]))])
        table.writerows([factor, angle, torque, *markers] for factor, angle, torque, markers in rows)
    plot(wanted.out / "sweep.png", rows)
    print(f"{len(rows)} runs; wrote {wanted.out / 'sweep.csv'} and {wanted.out / 'sweep.png'}")
    stiffness = [torque / factor for factor, angle, torque, _ in rows if angle == max(r[1] for r in rows)]
    print(f"torque at the widest opening: {np.mean(stiffness):.3f} N m a factor of one, within {np.ptp(stiffness):.0e}")
    return 0 if np.ptp(stiffness) < 0.01 * np.mean(stiffness) else 1


if __name__ == "__main__":
    sys.exit(main())
