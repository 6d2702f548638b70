#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Regimes of bogie_track.yaml over its clearance and one other quantity, or over two others at 2 mm and 6.5 mm.

    python3 map_bogie_track.py run kempe -o bogie_regimes.csv
    python3 map_bogie_track.py run kempe wear coupling -o two.csv
    python3 map_bogie_track.py run kempe --rtol 1e-7 -o coarse.csv
    python3 map_bogie_track.py run kempe --rtol 1e-9 --every 2 -o tight.csv
    python3 map_bogie_track.py compare bogie_regimes.csv tight.csv
    python3 map_bogie_track.py count bogie_regimes.csv
    python3 map_bogie_track.py search kempe

`search` has no map: with neither wear nor coupling it counts pairs of regimes over a Sobol sequence of all that SEARCH names. `run` starts one `kempe ensemble` for each map. A run of 120 s is judged by its last third. An axle is at a rail from 0.32 mm before the clearance on. REGIMES has the rules.
"""
import argparse
import collections
import csv
import pathlib
import subprocess
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
END, FROM = 120, 80  # s
AT_RAIL = 0.32  # mm before the clearance; flanges touch 0.06 mm before a clearance of 2 mm, 0.17 mm before one of 6.5 mm
CLEARANCES = tuple(1.25 + 0.75 * k for k in range(9))
PAIR = (2.0, 6.5)

# Title, axis, quantities that vary (name, factor from SI to the axis, first and last value in SI, number), other values, clearances.
MAPS = {
    "wear": ("a: wear of one driven wheel", "worn, mm", [("worn", 1e3, 0, 0.5e-3, 11)], {}, CLEARANCES),
    "coupling": ("b: coupling of the driven wheels", "motors, kN m s", [("motors", 1e-3, 0, 10e3, 11)], {}, CLEARANCES),
    "damper": ("c: yaw damper", "yaw_damper, kN m s", [("yaw_damper", 1e-3, 0, 50e3, 11)], {}, CLEARANCES),
    "speed": ("d: speed, negative: driven axle in front", "speed, m/s", [("speed", 1, -18, 18, 10)], {}, CLEARANCES),
    "cross_level": ("e: no wear; cross level", "cross_level, mm", [("cross_level", 1e3, 0, 20e-3, 11)], {"worn": 0}, CLEARANCES),
    "plain": ("f: no wear, no coupling", "speed, m/s", [("speed", 1, -18, 18, 10)], {"worn": 0, "motors": 0}, CLEARANCES),
    "torque": ("g: no wear, no coupling; torque", "wheel_torque, kN m", [("wheel_torque", 1e-3, -1250, 1250, 11)],
               {"worn": 0, "motors": 0, "speed": -10, "yaw_damper": "20 kN*m*s", "cross_level": "-1.5 mm", "turn": 0.5e-3}, CLEARANCES),
    "both": ("h: wear and coupling", "worn, mm", [("worn", 1e3, 0, 0.5e-3, 11), ("motors", 1e-3, 0, 10e3, 11)], {}, PAIR),
}
SEARCH = ("speed=-18:18,yaw_damper=0:50e3,wheel_torque=-1000:1000,friction=0.1:0.5,turn=-1e-3:1e-3,cross_level=-3e-3:3e-3", 64)

NAMES = ("left", "right", "hits_left", "hits_right", "top", "low")

REGIMES = {  # in the last third of a run
    "leans left": "an axle is at the left rail all the time",
    "leans right": "an axle is at the right rail all the time",
    "both rails": "it comes to both rails",
    "left rail": "it comes to the left rail and leaves it again",
    "right rail": "it comes to the right rail and leaves it again",
    "no rail": "it comes to no rail",
}


def regime(row):
    left, right = float(row["left"]) / (END - FROM), float(row["right"]) / (END - FROM)
    if left > 0 and right > 0:
        return "both rails"
    if left > 0 or right > 0:
        side = "left" if left > 0 else "right"
        return f"leans {side}" if max(left, right) > 0.999 else f"{side} rail"
    return "no rail"


def leans(name):
    return name.startswith("leans")


def rebounds(name):
    return name in ("both rails", "left rail", "right rail")


def quantities():
    small = "q(y) - 1.7 m*q(yaw)"
    most, least, level = f"max(q(y), {small})", f"min(q(y), {small})", f"(sigma - {AT_RAIL} mm)"
    late = f"from {FROM} s"
    return "; ".join((f"left = duration({most} > {level}) {late}", f"right = duration({least} < -{level}) {late}",
                      f"hits_left = count({most} > {level}) {late}", f"hits_right = count({least} < -{level}) {late}",
                      f"top = max({most}) {late}", f"low = min({least}) {late}"))


def grid(clearances, varied):
    clearance = f"sigma={clearances[0]:g} mm:{clearances[-1]:g} mm:{len(clearances)}"
    return ["--design", "grid", "--sample", ",".join([clearance, *(f"{name}={low:g}:{high:g}:{count}" for name, _, low, high, count in varied)])]


def instances(kempe, sample, others, rtol=1e-8):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "ends.csv"
        words = [word for name, value in others.items() for word in ("--set", f"{name}={value}")]
        subprocess.run([kempe, "ensemble", HERE / "bogie_track.yaml", "--no-convergence-check", "--threads", "1", "--t-end", str(END), "--rtol",
                        f"{rtol:g}", *sample, *words, "--quantity", quantities(), "-o", out],
                       check=True, stdout=subprocess.DEVNULL)
        with out.open(newline="") as file:
            return list(csv.DictReader(file))


def run(arguments):
    with open(arguments.output, "w") as file:
        write(arguments, lambda line: print(line, file=file, flush=True))


def write(arguments, put):
    put(f"# map_bogie_track.py: last third of {END} s; x, y: the varied quantities, clearance in mm; left, right: time at a rail, s;\n"
          "# hits: arrivals there; top, low: farthest places of an axle, m")
    put("map,x,y,clearance," + ",".join(NAMES) + ",regime")
    for name in arguments.maps or MAPS:
        _, _, varied, others, clearances = MAPS[name]
        if arguments.every > 1:
            clearances = PAIR
            varied = [(n, f, low, high, (count + arguments.every - 1) // arguments.every if count % 2 else count) for n, f, low, high, count in varied]
        for row in instances(arguments.kempe, grid(clearances, varied), others, arguments.rtol):
            at = [f"{factor * float(row[n]):.6g}" for n, factor, *_ in varied] + [""]
            said = regime(row) if row["status"].startswith("complete") else "failed"
            put(",".join([name, *at[:2], f"{1e3 * float(row['sigma']):g}", *(f"{float(row[n]):.4g}" if row[n] else "" for n in NAMES), said]))


def search(arguments):
    ranges, number = SEARCH
    pairs = [[regime(row) if row["status"].startswith("complete") else "failed" for row in
              instances(arguments.kempe, ["--design", "sobol", "--instances", str(number), "--sample", ranges], {"worn": 0, "motors": 0, "sigma": f"{clearance:g} mm"})]
             for clearance in PAIR]
    print("| 2 mm | 6.5 mm | samples |\n|---|---|---|")
    for (small, big), times in sorted(collections.Counter(zip(*pairs)).items(), key=lambda item: (-item[1], item[0])):
        print(f"| {small} | {big} | {times} |")


def table(path):
    with open(path, newline="") as file:
        return {(row["map"], row["x"], row["y"], row["clearance"]): row for row in csv.DictReader(line for line in file if line[0] != "#")}


def compare(arguments):
    one, other = table(arguments.tables[0]), table(arguments.tables[1])
    same = [key for key in other if one[key]["regime"] == other[key]["regime"]]
    print(f"{len(same)} of {len(other)} regimes are the same")
    for key in other:
        if key not in same:
            print(*key, one[key]["regime"], "->", other[key]["regime"])


def count(arguments):
    """Counts pairs of runs that differ in the clearance alone: those that lean on a rail with 2 mm, and those that rebound with 6.5 mm."""
    rows = table(arguments.tables[0])
    print("| map | pairs | leaning with 2 mm | rebounding with 6.5 mm | both |\n|---|---|---|---|---|")
    for name in dict.fromkeys(key[0] for key in rows):
        pairs = [(rows[key]["regime"], rows[*key[:3], "6.5"]["regime"]) for key in rows if key[0] == name and key[3] == "2"]
        print(f"| {name} | {len(pairs)} | {sum(leans(a) for a, _ in pairs)} | {sum(rebounds(b) for _, b in pairs)} | "
              f"{sum(leans(a) and rebounds(b) for a, b in pairs)} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    one = commands.add_parser("run")
    one.add_argument("kempe")
    one.add_argument("maps", nargs="*", metavar="MAP", help=", ".join(MAPS))
    one.add_argument("-o", dest="output", metavar="FILE", required=True)
    one.add_argument("--rtol", type=float, default=1e-8)
    one.add_argument("--every", type=int, default=1, help="every N-th value of odd numbers of values, with 2 mm and 6.5 mm alone")
    one.set_defaults(work=run)
    one = commands.add_parser("search")
    one.add_argument("kempe")
    one.set_defaults(work=search)
    for name, tables, work in (("compare", 2, compare), ("count", 1, count)):
        one = commands.add_parser(name)
        one.add_argument("tables", nargs=tables)
        one.set_defaults(work=work)
    arguments = parser.parse_args()
    arguments.work(arguments)


if __name__ == "__main__":
    main()
