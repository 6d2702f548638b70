#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Instructions of the encoder of arm64 against a disassembler: every operation in every form, every kind of distance, and what a
function saves and restores. Runs on any machine.

    tests/arm64/arm64_words.py PROGRAM     PROGRAM: arm64_words, whose lines are described in its head

The meaning of each line of the disassembler is applied to symbols, and the result compared with the operation. The
disassembler is objdump of the binutils for arm64, or llvm-objdump; without one the test is skipped.
"""
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile

SKIPPED = 77
VECTORS = [*range(8), *range(16, 31), *range(8, 16)]  # in the order in which values take them
BINARY = {"fadd": "add", "fsub": "sub", "fmul": "mul", "fdiv": "div"}


def disassemble(words):
    """A line of text for each word."""
    tool = shutil.which("aarch64-linux-gnu-objdump")
    if not tool:
        print("skipped: no objdump for arm64 here (binutils-aarch64-linux-gnu)")
        sys.exit(SKIPPED)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "words.bin"
        path.write_bytes(b"".join(struct.pack("<I", word) for word in words))
        out = subprocess.run([tool, "-D", "-z", "-b", "binary", "-m", "aarch64", str(path)], capture_output=True, text=True, check=True)
    lines = re.findall(r"^ *[0-9a-f]+:\t[0-9a-f]{8} \t(.*)$", out.stdout, re.M)
    assert len(lines) == len(words), (len(lines), len(words))
    return lines


class Machine:
    """Two lanes of each vector register, address registers and a log of transfers, all as symbols."""

    def __init__(self):
        self.v = {k: [f"v{k}.0", f"v{k}.1"] for k in range(32)}
        self.x = {k: (f"x{k}", 0) for k in range(32)}  # a name and a distance
        self.flags = None
        self.transfers = []  # ("load" or "store", base, distance, lanes of value)
        self.written = set()

    def set(self, register, lanes):
        self.v[register] = lanes
        self.written.add(register)

    def step(self, line):
        name, *rest = line.split("\t")
        text = rest[0].split(" //")[0] if rest else ""
        operand = [word.strip() for word in re.sub(r"[\[\]!]", "", text).split(",")]
        number = lambda k: int(re.match(r"[vdxqw](\d+)", operand[k])[1])
        value = lambda k: int(operand[k].split("#")[1], 0)
        two = ".2d" in text or ".16b" in text
        lanes = range(2) if two else range(1)
        one = lambda list_: [*list_, *["0"] * (2 - len(list_))]
        v = self.v
        if name in BINARY:
            d, x, y = number(0), number(1), number(2)
            self.set(d, one([f"({BINARY[name]} {v[x][k]} {v[y][k]})" for k in lanes]))
        elif name in ("fsqrt", "fneg"):
            self.set(number(0), one([f"({name[1:]} {v[number(1)][k]})" for k in lanes]))
        elif name == "fmov":
            self.set(number(0), one([v[number(1)][0]]))
        elif name in ("fmla", "fmls"):
            d, x, y = number(0), number(1), number(2)
            self.set(d, [f"({'fma' if name == 'fmla' else 'fnma'} {v[x][k]} {v[y][k]} {v[d][k]})" for k in lanes])
        elif name in ("fmadd", "fmsub", "fnmsub"):
            x, y, z = (v[number(k)][0] for k in (1, 2, 3))
            self.set(number(0), one([{"fmadd": f"(fma {x} {y} {z})", "fmsub": f"(fnma {x} {y} {z})", "fnmsub": f"(fma {x} {y} (neg {z}))"}[name]]))
        elif name == "fcmp":
            self.flags = (v[number(0)][0], v[number(1)][0])
        elif name == "fcsel":
            x, y = v[number(1)][0], v[number(2)][0]
            assert operand[3] == "gt"
            self.set(number(0), one([f"(if {self.flags[0]}>{self.flags[1]} {x} {y})"]))
        elif name == "fcmgt":
            self.set(number(0), [f"{v[number(1)][k]}>{v[number(2)][k]}" for k in lanes])
        elif name == "bsl":
            d = number(0)
            self.set(d, [f"(if {v[d][k]} {v[number(1)][k]} {v[number(2)][k]})" for k in lanes])
        elif name == "eor":
            self.set(number(0), [f"(xor {v[number(1)][k]} {v[number(2)][k]})" for k in lanes])
        elif name == "orr":
            assert number(1) == number(2)
            self.set(number(0), list(v[number(1)]))
        elif name in ("zip1", "zip2"):
            k = int(name[3]) - 1
            self.set(number(0), [v[number(1)][k], v[number(2)][k]])
        elif name == "ext":
            assert value(3) == 8
            self.set(number(0), [v[number(1)][1], v[number(2)][0]])
        elif name == "dup" or (name == "mov" and re.match(r"d\d", operand[0])):
            lane = re.match(r"v(\d+)\.d(\d)", re.sub(r"[\[\]]", "", text).split(",")[1].strip())
            source = v[int(lane[1])][int(lane[2])]
            self.set(number(0), [source, source] if two else one([source]))
        elif name == "mov" and two:
            self.set(number(0), list(v[number(1)]))
        elif name == "mov" and operand[0].startswith("v"):
            into, source = (re.match(r"v(\d+)\.d(\d)", word) for word in operand)
            result = list(v[int(into[1])])
            result[int(into[2])] = v[int(source[1])][int(source[2])]
            self.set(int(into[1]), result)
        elif name == "mov":
            self.x[number(0)] = ("", value(1))
        elif name == "movk":
            before, high = self.x[number(0)][1], int(operand[1].split("#")[1], 0)
            assert operand[2] == "lsl #16"
            self.x[number(0)] = ("", (before & ~0xFFFF0000) | high << 16)
        elif name == "add":
            base, distance = self.x[number(1)]
            if operand[2].startswith("#"):
                more = value(2) << (12 if len(operand) > 3 and operand[3] == "lsl #12" else 0)
            else:
                assert self.x[number(2)][0] == ""
                more = self.x[number(2)][1]
            self.x[number(0)] = (base, (distance + more + 2**63) % 2**64 - 2**63)
        elif name in ("ldr", "ldur", "str", "stur", "ldp", "stp"):
            self.transfer(name, operand)
        elif name == "ret":
            pass
        else:
            raise AssertionError(f"unknown instruction: {line}")

    def transfer(self, name, operand):
        count = 2 if name.endswith("p") else 1
        wide = 2 if operand[0].startswith("q") else 1
        base = operand[count]
        number = 31 if base == "sp" else int(base[1:])
        distance = sum(int(word.split("#")[1], 0) for word in operand[count + 1:])
        name_of_base, before = self.x[number]
        for k in range(count):
            register = int(operand[k][1:])
            at = before + distance + 8 * wide * k
            if name.startswith("ld"):
                self.set(register, [f"[{name_of_base}+{at + 8 * lane}]" if lane < wide else "0" for lane in range(2)])
                self.transfers.append(("load", name_of_base, at, register, wide))
            else:
                self.transfers.append(("store", name_of_base, at, tuple(self.v[register][:wide]), wide))


def registers_of(form, value):
    return [VECTORS[value]] if form == 1 else [VECTORS[2 * value], VECTORS[2 * value + 1]]


def meant(op, x, y, z=None):
    """The symbol of a lane."""
    return {
        "LOAD": f"{y}", "SQRT": f"(sqrt {y})", "ADD": f"(add {x} {y})", "MUL": f"(mul {x} {y})", "SUB": f"(sub {x} {y})",
        "DIV": f"(div {x} {y})", "MAX": f"(if {x}>{y} {x} {y})", "XOR": f"(xor {x} {y})", "PRODUCT_ADD": f"(fma {x} {y} {z})",
        "PRODUCT_SUB": f"(fma {x} {y} (neg {z}))", "SUB_PRODUCT": f"(fnma {x} {y} {z})",
    }[op]


def joined(op, x, y):
    """The lanes of a pair that is joined."""
    return {"TWICE": [y[0], y[0]], "LOW_LOW": [x[0], y[0]], "LOW_HIGH": [x[0], y[1]], "HIGH_LOW": [x[1], y[0]],
            "HIGH_HIGH": [x[1], y[1]]}[op]


def judge_operation(form, op, values, machine):
    start = Machine().v
    packed = form != 1 or op.endswith("_PAIR") or op == "XOR"
    single = op.removesuffix("_PAIR")
    target, sources = [registers_of(form, values[0]), [registers_of(form, k) for k in values[1:]]]
    for k, d in enumerate(target):
        from_ = [start[source[k]] for source in sources]
        if single in ("TWICE", "LOW_LOW", "LOW_HIGH", "HIGH_LOW", "HIGH_HIGH"):
            lanes = joined(single, *from_)
        else:
            lanes = [meant(single, *(word[lane] for word in from_)) for lane in range(2 if packed else 1)]
        if machine.v[d][:len(lanes)] != lanes:
            return f"register {d} has {machine.v[d]}, not {lanes}"
    others = machine.written - set(target) - {31}
    return f"registers {sorted(others)} are overwritten" if others else None


def judge_memory(form, op, d, base, distance, machine):
    start = Machine().v
    packed = form != 1 or op.endswith("_PAIR")
    wide = 2 if packed else 1
    expected = []
    for k, register in enumerate(registers_of(form, d)):
        lanes = tuple(start[register][1:] if op == "STORE_HIGH" else start[register][:wide])
        expected.append(("load", f"x{base}", distance + 16 * k, register, wide) if op.startswith("LOAD")
                        else ("store", f"x{base}", distance + 16 * k, lanes, wide))
    if machine.transfers != expected:
        return f"transfers are {machine.transfers}, not {expected}"
    used = [k for k in range(32) if machine.x[k] != (f"x{k}", 0)]
    return None if set(used) <= {*range(8, 16), 17} else f"registers x{used} are overwritten"


def judge_function(form, count, lines):
    """Saved registers are those of d8 to d15 that are written, and are restored in the same places."""
    used = {register for value in range(count) for register in registers_of(form, value)}
    pairs = (max([k for k in used if 8 <= k <= 15], default=7) - 7 + 1) // 2
    kept = [f"d{8 + 2 * k}, d{9 + 2 * k}" for k in range(pairs)]
    after = lambda k: f", [sp, #{16 * k}]"
    begin = [f"stp\t{kept[0]}, [sp, #-{16 * pairs}]!"] if pairs else []
    begin += [f"stp\t{kept[k]}{after(k)}" for k in range(1, pairs)]
    end = [f"ldp\t{kept[k]}{after(k)}" for k in range(pairs - 1, 0, -1)]
    end += [f"ldp\t{kept[0]}, [sp], #{16 * pairs}"] if pairs else []
    found = lines[:len(begin)], lines[len(lines) - len(end) - 1:]
    if found != (begin, [*end, "ret"]):
        return f"begins and ends with {found}, not {begin, end}"
    inner = lines[len(begin):len(lines) - len(end) - 1]
    return None if len(inner) == len(used) and all(line.startswith("fadd") for line in inner) else f"has {inner}"


def judge(words, lines):
    kind, form, *rest = words
    form = int(form)
    if kind == "function":
        return judge_function(form, int(rest[0]), lines)
    machine = Machine()
    for line in lines:
        try:
            machine.step(line)
        except (AssertionError, KeyError, TypeError) as fault:
            return f"{line} is not understood: {fault}"
    if kind == "memory":
        return judge_memory(form, rest[0], int(rest[1]), int(rest[2]), int(rest[3]), machine)
    return judge_operation(form, rest[0], [int(word) for word in rest[1:]], machine)


def main():
    out = subprocess.run([sys.argv[1]], capture_output=True, text=True, check=True).stdout
    cases = []
    for line in out.splitlines():
        case, words = line.split(" :")
        cases.append((case, [int(word, 16) for word in words.split()]))
    lines = disassemble([word for _, words in cases for word in words])
    at, wrong = 0, 0
    for case, words in cases:
        mine = lines[at:at + len(words)]
        at += len(words)
        fault = judge(case.split(), mine)
        if fault:
            wrong += 1
            print(f"{case}: {fault}\n    " + "; ".join(mine))
    names = {line.split("\t")[0] for line in lines}
    print(f"{len(cases)} cases, {len(lines)} instructions of {len(names)} kinds ({' '.join(sorted(names))}), {wrong} wrong")
    sys.exit(wrong > 0)


main()
