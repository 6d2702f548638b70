#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A Craig-Bampton blade of one to ten modes in two closed loops, for Kempe and for Exudyn: the files of Kempe, and the runs of Exudyn.

    blade_peers.py write FOLDER
    blade_peers.py exudyn loop|four_bar START.json SECONDS

`loop`: the blade on an inclined hinge, its corner joined by a rod to a driven crank. `four_bar`: the blade is the coupler; crank and
rocker are rigid and balanced, and nothing is driven; no gravity. Exudyn has the same body with the same modes and damping
(ObjectFFRFreducedOrder), rotors of one coordinate and no functions in Python. Its load by gravity leaves out that the torque about the
frame changes with the deformation: forces at nodes of the same resultant for all modes are a second way. START.json is what `kempe assemble --json` wrote.
Prints a line a setting: `way, K modes|steps|seconds of processor time|t x y z ...`. SECONDS: finer steps are left out after a run of so long.
"""
import json
import pathlib
import sys
import time

import numpy as np

sys.dont_write_bytecode = True
ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent), str(ROOT / "tests")]
import closed  # noqa: E402
import flexible_files  # noqa: E402

END, RATE = 0.15, 30.0
CRANK, COUPLER, ROCKER, GROUND = 0.12, 0.5, 0.3, 0.5
CRANK_INERTIA, ROCKER_INERTIA = 0.01, 0.002
CORNER, MIDDLE = 313, 307                                 # nodes at (L, b/2, 0) and (L, 0, 0)
IN_PLANE = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0.0]]) # turns z to -y: angles go from x to z
FOUR_BAR = f"""kempe: 1
gravity: [0, 0, 0]
ground: {{points: {{D: [{GROUND}, 0, 0]}}}}
bodies:
  crank: {{joint: {{name: A, revolute: -y, at: ground}}, inertia: {{yy: {CRANK_INERTIA}}}, points: {{P: [{CRANK}, 0, 0]}}}}
  blade: {{joint: {{name: B, revolute: -y, at: crank.P}}, flexible: {{file: blade.npz, damping: {{ratio: 0.01}}}}, points: {{P: {{interface: B}}}}}}
  rocker: {{joint: {{name: C, revolute: -y, at: ground.D}}, inertia: {{yy: {ROCKER_INERTIA}}}, points: {{P: [{ROCKER}, 0, 0]}}}}
loops: {{L: {{ball: [blade.P, rocker.P]}}}}
start: {{q: {{A: 90 deg, B: -70 deg, C: 100 deg}}, qd: {{A: {RATE}}}, hold: [A]}}
run: {{t_end: {END}, output_step: 0.01, outputs: [position(blade.P)]}}
"""
MODELS = {"loop": flexible_files.BLADE, "four_bar": FOUR_BAR}
MODES = (1, 3, 10)                                        # the slowest ones in the frame; 10: all


def write(folder):
    np.savez(folder / "blade.npz", **flexible_files.blade())
    for name, text in MODELS.items():
        for modes in MODES:
            (folder / f"blade_{name}_{modes}.yaml").write_text(text.replace("file: blade.npz", f"file: blade.npz, modes: {modes}"))
    lines = [",".join(map(repr, (t, *numbers[2]))) for t, numbers in flexible_files.MOTION.items()]
    (folder / "blade_loop.csv").write_text("\n".join(["t,x,y,z", *lines, ""]))


# -- Exudyn ------------------------------------------------------------------------------------------------------------


class Scene:
    """A system with the blade, its frame at `place` with these axes and velocities."""
    def __init__(self, file, place, axes, velocity, turning, gravity=(0, 0, 0)):
        import exudyn as exu
        import exudyn.itemInterface as items
        import scipy.sparse
        from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
        self.exu, self.items = exu, items
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        count, modes = len(file["nodes"]), file["K"].shape[0]
        mass = scipy.sparse.coo_matrix((file["mass_value"], (file["mass_row"], file["mass_col"])), (count, count))
        body = FEMinterface()
        body.nodes = {"Position": file["nodes"]}
        body.massMatrix = scipy.sparse.kron(mass, np.eye(3)).tocsr()
        body.stiffnessMatrix = scipy.sparse.csr_matrix((3 * count, 3 * count)) # that of the modes is given below
        body.modeBasis = {"matrix": file["modes"].reshape(3 * count, modes), "type": "HCBmodes"}
        made = ObjectFFRFreducedOrderInterface(body, roundMassMatrix=1e-14, roundStiffnessMatrix=1e-14)
        self.blade = made.AddObjectFFRFreducedOrder(self.mbs, positionRef=list(place), rotationMatrixRef=axes, initialVelocity=list(velocity),
                                                    initialAngularVelocity=list(turning), gravity=list(gravity))
        for name, matrix in (("stiffness", file["K"]), ("damping", 0.02 * np.sqrt(file["K"]))):
            self.mbs.SetObjectParameter(self.blade["oFFRFreducedOrder"], name + "MatrixReduced", exu.MatrixContainer(matrix))
        self.ground = self.mbs.AddObject(items.ObjectGround())
        self.frame = self.mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=self.blade["nRigidBody"]))

    def weigh(self, file):
        """Gravity by forces at few nodes, with weights whose sums are the mass, its first moments and those of the modes."""
        import scipy.linalg
        mass = np.zeros(len(file["nodes"]))
        np.add.at(mass, file["mass_row"], file["mass_value"])
        sums = np.vstack([mass * 0 + 1, file["nodes"].T, file["modes"].reshape(len(mass), -1).T])
        _, left, order = scipy.linalg.qr(sums, pivoting=True, mode="economic")
        rank = int((abs(np.diag(left)) > 1e-10 * abs(left[0, 0])).sum())
        nodes = order[:rank]
        weights = np.linalg.lstsq(sums[:, nodes], sums @ mass, rcond=None)[0]
        assert abs(sums[:, nodes] @ weights - sums @ mass).max() < 1e-12
        marker = self.mbs.AddMarker(self.items.MarkerSuperElementPosition(bodyNumber=self.blade["oFFRFreducedOrder"], meshNodeNumbers=list(map(int, nodes)),
                                                                          weightingFactors=list(weights / mass.sum())))
        self.mbs.AddLoad(self.items.LoadForceVector(markerNumber=marker, loadVector=[0, 0, -9.81 * mass.sum()]))

    def rotor(self, place, inertia, angle, rate):
        """A body that turns from x to z: object and node."""
        node = self.mbs.AddNode(self.items.Node1D(referenceCoordinates=[angle], initialCoordinates=[0], initialVelocities=[rate]))
        return self.mbs.AddObject(self.items.ObjectRotationalMass1D(physicsInertia=inertia, nodeNumber=node, referencePosition=list(place),
                                                                    referenceRotation=IN_PLANE)), node

    def hinge(self, marker, axes, own_axes):
        """z of both axes turn about each other."""
        self.mbs.AddObject(self.items.GenericJoint(markerNumbers=[marker, self.frame], constrainedAxes=[1, 1, 1, 1, 1, 0],
                                                   rotationMarker0=axes, rotationMarker1=own_axes))

    def at(self, body, x, kind="Position"):
        return self.mbs.AddMarker(getattr(self.items, f"MarkerBody{kind}")(bodyNumber=body, localPosition=[x, 0, 0]))

    def node(self, number):
        """Marker of a node of the blade, whose place is written."""
        marker = self.mbs.AddMarker(self.items.MarkerSuperElementPosition(bodyNumber=self.blade["oFFRFreducedOrder"], meshNodeNumbers=[number],
                                                                          weightingFactors=[1.0]))
        self.sensor = self.mbs.AddSensor(self.items.SensorMarker(markerNumber=marker, storeInternal=True,
                                                                 outputVariableType=self.exu.OutputVariableType.Position))
        return marker


def turned(angle):
    return IN_PLANE @ np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]) @ IN_PLANE.T


def loop(file, q, qd, at_nodes):
    axis, x = np.array([0, np.sqrt(0.75), 0.5]), np.array([1.0, 0, 0])
    cross = np.cross(np.eye(3), axis)
    axes = np.eye(3) + np.sin(q["th"]) * cross + (1 - np.cos(q["th"])) * cross @ cross
    scene = Scene(file, np.zeros(3), axes, np.zeros(3), qd["th"] * axis, (0, 0, 0 if at_nodes else -9.81))
    if at_nodes:
        scene.weigh(file)
    along = np.column_stack([x, np.cross(axis, x), axis])
    scene.hinge(scene.at(scene.ground, 0, "Rigid"), along, along)
    crank, node = scene.rotor((0.5, 0.05, -0.35), 1, q["A"], qd["A"])
    fixed = scene.mbs.AddNode(scene.items.NodePointGround())
    scene.mbs.AddObject(scene.items.CoordinateConstraint(
        markerNumbers=[scene.mbs.AddMarker(scene.items.MarkerNodeCoordinate(nodeNumber=n, coordinate=0)) for n in (fixed, node)],
        velocityLevel=True, offset=qd["A"]))
    scene.mbs.AddObject(scene.items.DistanceConstraint(markerNumbers=[scene.at(crank, 0.06), scene.node(CORNER)], distance=0.32))
    return scene


def four_bar(file, q, qd, _at_nodes):
    angle, rate = q["A"] + q["B"], qd["A"] + qd["B"]
    arm = IN_PLANE @ [np.cos(q["A"]), np.sin(q["A"]), 0]
    scene = Scene(file, CRANK * arm, turned(angle), CRANK * qd["A"] * IN_PLANE @ [-np.sin(q["A"]), np.cos(q["A"]), 0], [0, -rate, 0])
    crank, _ = scene.rotor((0, 0, 0), CRANK_INERTIA, q["A"], qd["A"])
    rocker, _ = scene.rotor((GROUND, 0, 0), ROCKER_INERTIA, q["C"], qd["C"])
    scene.hinge(scene.at(crank, CRANK, "Rigid"), np.eye(3), IN_PLANE)
    scene.mbs.AddObject(scene.items.SphericalJoint(markerNumbers=[scene.at(rocker, ROCKER), scene.node(MIDDLE)], constrainedAxes=[1, 1, 1]))
    return scene


def run(make, file, start, at_nodes, steps, index2, radius):
    """Seconds of the integration, and rows t x y z."""
    scene = make(file, start["q"], start["qd"], at_nodes)
    scene.mbs.Assemble()
    settings = closed.exudyn_settings(END, steps, index2, radius)
    settings.solutionSettings.sensorsWritePeriod = 0.01 - 1e-8               # not a step later by rounding
    settings.timeIntegration.adaptiveStep = False
    begin = time.thread_time()
    scene.mbs.SolveDynamic(settings)
    return time.thread_time() - begin, scene.mbs.GetSensorStoredData(scene.sensor).ravel()


def truncated(file, modes):
    """The file with the slowest of its modes, of which it has the diagonal K."""
    return {**file, "K": file["K"][:modes, :modes], "modes": file["modes"][..., :modes]}


def exudyn(name, start, seconds):
    closed.LIMIT = seconds
    start = json.loads(pathlib.Path(start).read_text())
    make = {"loop": loop, "four_bar": four_bar}[name]
    for modes in MODES:
        file = truncated(flexible_files.blade(), modes)
        for at_nodes in (False, True) if name == "loop" else (False,):
            for way, *how in (("generalised alpha (0.9), index 3", False, 0.9), ("generalised alpha (0.6), index 3", False, 0.6), ("trapezoidal, index 2", True, 1.0)):
                closed.sweep(f"Exudyn {way}{', gravity at nodes' * at_nodes}, {modes} modes", [15 * 2**k for k in range(13 if modes == 10 else 7)],
                             lambda steps, file=file, how=how, at_nodes=at_nodes: run(make, file, start, at_nodes, steps, *how))


if __name__ == "__main__":
    if sys.argv[1] == "write":
        write(pathlib.Path(sys.argv[2]))
    else:
        exudyn(sys.argv[2], sys.argv[3], float(sys.argv[4]))
