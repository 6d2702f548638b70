// SPDX-License-Identifier: BSD-3-Clause
// The first run of live pages in Node.js: times, statuses, errors. Used by docs/live_examples.py --measure; the job is on standard input.
import { readFileSync } from "node:fs";

const LIMIT = 30; // s
const job = JSON.parse(readFileSync(0, "utf8"));
const { Kempe } = await import(job.module);
const kempe = await Kempe.start();
for (const { name, end, files } of job.runs) {
    const model = Object.fromEntries(Object.entries(files).map(([path, text]) => [path, Buffer.from(text, "base64")]));
    const control = new AbortController(), limit = setTimeout(() => control.abort(new Error(`more than ${LIMIT} s`)), 1000 * LIMIT), began = performance.now();
    let words;
    try {
        const { text, files: written, table } = await kempe.simulate(model, { noConvergenceCheck: true, animation: "/out/motion.json", ...(end ? { tEnd: end } : {}) }, { signal: control.signal });
        words = `${written["motion.json"]?.length ?? 0} bytes, ${table.rowCount} rows: ${text.split("\n")[0]}`;
    } catch (error) {
        words = `none: ${error.message.split("\n")[0]}`;
    }
    clearTimeout(limit);
    console.log(`${name.padEnd(24)} ${((performance.now() - began) / 1000).toFixed(2)} s  ${words}`);
}
kempe.close();
