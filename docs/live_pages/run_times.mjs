// SPDX-License-Identifier: BSD-3-Clause
// The first run of live pages in Node.js: processor times, statuses, errors. Used by docs/live_examples.py --measure; the job is on standard input.
import { readFileSync } from "node:fs";

const LIMIT = 100; // s, on a busy machine
const job = JSON.parse(readFileSync(0, "utf8"));
const { Kempe } = await import(job.module);
const kempe = await Kempe.start();
for (const { name, end, files } of job.runs) {
    const model = Object.fromEntries(Object.entries(files).map(([path, text]) => [path, Buffer.from(text, "base64")]));
    const control = new AbortController(), limit = setTimeout(() => control.abort(new Error(`more than ${LIMIT} s`)), 1000 * LIMIT), began = process.cpuUsage();
    let words;
    try {
        const { text, files: written, table } = await kempe.simulate(model, { noConvergenceCheck: true, animation: "/out/motion.json", ...(end ? { tEnd: end } : {}) }, { signal: control.signal });
        words = `${written["motion.json"]?.length ?? 0} bytes, ${table.rowCount} rows: ${text.split("\n")[0]}`;
    } catch (error) {
        words = `none: ${error.message.split("\n")[0]}`;
    }
    clearTimeout(limit);
    const { user, system } = process.cpuUsage(began);
    console.log(`${name.padEnd(24)} ${((user + system) / 1e6).toFixed(2)} s  ${words}`);
}
kempe.close();
