# SPDX-License-Identifier: BSD-3-Clause
"""The bench set: planar and spatial mechanisms of 1 to 100 coordinates, stiff and not, redundant, with drives and events."""
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
GOVERNOR = "K: 8e5, c: 4e4"
# name: model of examples or bench, or the arguments of `bench model_text`; end in s; words replaced; features
MODELS = {
    "stop": ("bench/models/stop", 20, None, "events"),
    "quarter_car": ("examples/quarter_car/quarter_car", 3, None, "driven by the ground"),
    "four_bar": ("examples/four_bar/four_bar", 5, None, "planar"),
    "slider_crank": ("examples/slider_crank/slider_crank", 10, None, "planar, dead centres"),
    "slider_crank_stop": ("bench/models/slider_crank_stop", 3, None, "planar, events"),
    "spatial_slider_crank": ("examples/spatial_slider_crank/spatial_slider_crank", 5, None, "spatial"),
    "car_axis": ("examples/car_axis/car_axis", 3, None, "stiff, closures of time"),
    "governor": ("examples/governor/governor", 10, None, "stiff"),
    "governor_100": ("examples/governor/governor", 10, (GOVERNOR, "K: 8e7, c: 4e6"), "very stiff"),
    "governor_10000": ("examples/governor/governor", 10, (GOVERNOR, "K: 8e9, c: 4e8"), "very stiff"),
    "stephenson": ("examples/stephenson/stephenson", 2, None, "planar"),
    "bricard": ("examples/bricard/bricard", 10, None, "spatial, redundant"),
    "windows_2": ("windows 2", 10, None, "planar"),
    "windows_2_space": ("windows_in_space 2", 10, None, "spatial, redundant"),
    "andrews": ("examples/andrews/andrews", 0.03, None, "planar"),
    "double_wishbone": ("examples/double_wishbone/double_wishbone", 2, None, "spatial, driven"),
    "parallel_robot": ("examples/parallel_robot/parallel_robot", 2, None, "planar, redundant"),
    "windows_10": ("windows 10", 10, None, "planar"),
    "stewart": ("examples/stewart/stewart", 1, None, "spatial"),
    "bogie": ("examples/bogie/bogie", 0.5, None, "spatial, stiff"),
    "suspension": ("examples/suspension/suspension", 1, None, "spatial, stiff"),
    "tree_29": ("tree 29", 1, None, "spatial, a tree"),
    "limousine": ("examples/limousine/limousine", 0.2, None, "a vehicle, stiff"),
    "windows_40": ("windows 40", 10, None, "planar"),
    "tree_100": ("tree 100", 1, None, "spatial, a tree"),
}


def model_file(name, folder, program, root=ROOT):
    """Path of a model, written to the folder where it is no file of its own. root: where the examples are."""
    source, _, changed, _ = MODELS[name]
    place = (root if source.startswith("examples") else ROOT) / f"{source}.yaml"
    if changed is None and " " not in source:
        return place
    text = place.read_text() if changed else subprocess.run([program, "model_text", *source.split()], capture_output=True, text=True, check=True).stdout
    if changed and changed[0] not in text:
        raise ValueError(f"{place} has no {changed[0]!r}")
    made = folder / f"{name}.yaml"
    made.write_text(text.replace(*changed) if changed else text)
    return made
