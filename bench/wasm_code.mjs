// SPDX-License-Identifier: BSD-3-Clause
// What code of their own would gain for programs in WebAssembly: the tape's loop beside code emitted from the same records.
//
//     node --experimental-wasm-relaxed-simd bench/wasm_code.mjs build/wasm/javascript
//
// It runs models, takes the records and the values of the segment of the tape that they ran most, and times both with the engine's
// f64x2.relaxed_madd (src/backend/wasm/relaxed_sums.c). Emitted code reads slots in memory as the loop does, or keeps what it computes in
// local variables. Each command would have to compile it, as each has separate memory.
import { readFileSync } from "node:fs";
import { join } from "node:path";

const folder = process.argv[2];
const MODELS = [["four_bar", 1], ["andrews", 0.02], ["bricard", 0.5], ["parallel_robot", 0.3], ["stewart", 0.3]];

/* -- modules ------------------------------------------------------------------------------------------ */

function unsigned(n) {
    const bytes = [];
    do bytes.push((n & 127) | (n > 127 ? 128 : 0)); while ((n >>>= 7));
    return bytes;
}
const section = (id, bytes) => [id, ...unsigned(bytes.length), ...bytes];
const letter = (text) => [1, text.charCodeAt(0)];
const START = [0, 0x61, 0x73, 0x6d, 1, 0, 0, 0];

/* A function r(v) of records, each [d, a, b, c]. */
function emitted(records, keeps) {
    const local = new Map(), code = [], get = (index) => [0x20, ...unsigned(index)];
    const read = (slot) => (keeps && local.has(slot) ? get(local.get(slot)) : [...get(0), 0xfd, 0x5d, 3, ...unsigned(8 * slot)]);
    for (const [d, a, b, c] of records) {
        const value = [...read(a), ...read(b), ...read(c), 0xfd, 0x87, 2];
        if (keeps && !local.has(d)) local.set(d, local.size + 1);
        code.push(...get(0), ...value, ...(keeps ? [0x22, ...unsigned(local.get(d))] : []), 0xfd, 0x5b, 3, ...unsigned(8 * d), 0);
    }
    const body = [...(local.size ? [1, ...unsigned(local.size), 0x7b] : [0]), ...code, 0x0b];
    return new Uint8Array([...START, ...section(1, [1, 0x60, 1, 0x7f, 0]), ...section(2, [1, ...letter("e"), ...letter("m"), 2, 0, 0]), ...section(3, [1, 0]),
        ...section(7, [1, ...letter("r"), 0, 0]), ...section(10, [1, ...unsigned(body.length), ...body])]);
}

/* Three functions of integers that pass their arguments on to `f`: only those of a module go into a table. */
function passing(f) {
    const bytes = new Uint8Array([...START, ...section(1, [1, 0x60, 3, 0x7f, 0x7f, 0x7f, 0]), ...section(2, [1, ...letter("e"), ...letter("f"), 0, 0]),
        ...section(7, [1, ...letter("r"), 0, 0])]);
    return new WebAssembly.Instance(new WebAssembly.Module(bytes), { e: { f } }).exports.r;
}

/* -- the segment that takes most of a run ------------------------------------------------------------ */

async function busiest(name, end) {
    const { Instance } = WebAssembly, runs = new Map();
    let memory, loop;
    WebAssembly.Instance = function (module, imports) {
        const made = new Instance(module, imports);
        if (!made.exports.n) return made;
        [memory, loop] = [imports.e.m, made.exports.n];
        const count = (first, past, v) => {
            const key = `${first} ${past} ${v}`;
            runs.set(key, (runs.get(key) ?? 0) + 1);
            loop(first, past, v);
        };
        return { exports: { ...made.exports, n: passing(count) } };
    };
    const kempeModule = new Function(`${readFileSync(join(folder, "kempe_module.js"), "utf8")}; return kempeModule;`)();
    const instance = await kempeModule({
        instantiateWasm: (imports, done) => {
            WebAssembly.instantiate(readFileSync(join(folder, "kempe_module.wasm")), imports).then((made) => done(made.instance));
            return {};
        },
        print() {}, printErr() {},
    });
    instance.FS.writeFile("/model.yaml", readFileSync(`examples/${name}/${name}.yaml`));
    try {
        instance.callMain(["simulate", "/model.yaml", "--t-end", String(end), "--no-convergence-check", "--integrator", "dop853"]);
    } catch (error) {
        if (typeof error?.status !== "number") throw error;
    }
    WebAssembly.Instance = Instance;
    if (!loop) throw new Error("the engine has no f64x2.relaxed_madd");
    const work = ([key, count]) => count * (key.split(" ")[1] - key.split(" ")[0]);
    const most = [...runs].sort((a, b) => work(b) - work(a))[0], all = [...runs].reduce((sum, run) => sum + work(run), 0);
    const [first, past, v] = most[0].split(" ").map(Number);
    return { memory, loop, first, past, v, runs: most[1], all: all / work([most[0], 1]) };
}

/* ns of a run: the least of many trials, in whose pauses the engine's compiler finishes. */
async function time(run, count) {
    const times = Math.ceil(4e5 / count);
    let least = Infinity;
    for (let trial = 0; trial < 60; trial++) {
        const began = performance.now();
        for (let k = 0; k < times; k++) run();
        least = Math.min(least, (performance.now() - began) / times);
        await new Promise((done) => setTimeout(done, 1));
    }
    return 1e6 * least;
}

console.log("# ns of a run of the segment that takes most of the model's run, and what all of its segments take, ms; times: the loop's over that");
console.log("# of code; compiled: code of this segment with its first run, ms");
console.log("model           records    runs    loop all of them   code in memory  times  compiled   in local variables  times  compiled");
for (const [name, end] of MODELS) {
    const { memory, loop, first, past, v, runs, all } = await busiest(name, end), count = (past - first) / 8;
    const numbers = [...new Uint16Array(memory.buffer, first, 4 * count)], records = [];
    for (let k = 0; k < count; k++) records.push(numbers.slice(4 * k, 4 * k + 4));
    const loops = await time(() => loop(first, past, v), count), wide = (number, digits, width) => number.toFixed(digits).padStart(width);
    let row = name.padEnd(16) + wide(count, 0, 7) + wide(runs, 0, 8) + wide(loops, 0, 8) + wide((all * loops) / 1e6, 2, 12);
    for (const keeps of [false, true]) {
        const bytes = emitted(records, keeps), began = performance.now();
        const { r } = new WebAssembly.Instance(new WebAssembly.Module(bytes), { e: { m: memory } }).exports;
        r(v);
        const compiled = performance.now() - began, code = await time(() => r(v), count);
        row += wide(code, 0, keeps ? 21 : 17) + wide(loops / code, 2, 7) + wide(compiled, 1, 10);
    }
    console.log(row);
}
