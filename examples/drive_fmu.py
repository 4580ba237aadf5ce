"""The jaw opens in an FMI 3.0 host; the skin comes back as one array.

        bone.translation [bones, 3] --> +-----------+ --> skin.position [vertices, 3]
        bone.rotation    [bones, 3] --> | cutis.fmu | --> marker.position, bone.reactionForce, ...
                                        +-----------+
    cutis fmu fmu/scene.toml -o target/fmu
    python examples/drive_fmu.py target/fmu/cutis.fmu

Number to expect: some point of the skin has moved 2.1 mm when the jaw has gone down 2.0 mm.
"""

import sys

import fmpy
import numpy as np

STEPS, DT = 8, 1 / 64

archive = sys.argv[1] if len(sys.argv) > 1 else "target/fmu/cutis.fmu"
variables = {v.name: v for v in fmpy.read_model_description(archive).modelVariables}
bones = variables["bone.translation"].shape  # this importer stacks inputs, so it takes those of one shape
inputs = [v for v in variables.values() if v.causality == "input" and v.shape == bones]

signals = np.zeros(STEPS + 1, dtype=[("time", "f8")] + [(v.name, "f8", tuple(v.shape)) for v in inputs])
signals["time"] = DT * np.arange(STEPS + 1)
signals["bone.translation"][:, -1, 2] = -2e-3 * np.arange(STEPS + 1) / STEPS  # the last bone is the jaw, z points up

result = fmpy.simulate_fmu(
    archive, stop_time=(STEPS + 1) * DT, output_interval=DT, input=signals, output=["skin.position", "solver.residual"], set_stop_time=False
)
skin = np.array([row.reshape(-1, 3) for row in result["skin.position"]])
motion = np.linalg.norm(skin - skin[0], axis=2).max(axis=1)
for t, most, residual in zip(result["time"], motion, result["solver.residual"]):
    print(f"t = {t:.4f} s  the skin has moved {1e3 * most:.2f} mm  residual {residual:.1e} N")
sys.exit(0 if abs(motion[-1] - 2e-3) < 2e-4 else 1)
