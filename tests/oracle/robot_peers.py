# SPDX-License-Identifier: BSD-3-Clause
"""Another program's model of a robot: Pinocchio's of URDF and robot.yaml, MuJoCo's of MJCF, Drake's of SDFormat."""


def peers(path, model, system):
    """Tree, loops (None: none that are known), and whether states are closed from near the assembled start."""
    if path.suffix in (".xml", ".mjcf"):
        import mujoco_tree
        tree = mujoco_tree.Tree(path, system.coordinates)
        return tree, mujoco_tree.Loops(path, tree, system.coordinates), True
    if path.suffix == ".sdf":
        import drake_models
        tree = drake_models.Tree(path, model, system)
        return tree, drake_models.Loops(tree) if tree.cuts else None, False
    import pinocchio_tree
    robot, kinds, pairs = pinocchio_tree.loops_beside(path)
    tree = pinocchio_tree.Tree(robot, system.coordinates, kinds)
    loops = pinocchio_tree.Loops(robot, tree, system.coordinates, pairs)
    tree.data = tree.model.createData()
    return tree, loops, bool(pairs)


def name_of(path):
    return path.stem if path.stem != "robot" else path.resolve().parent.name
