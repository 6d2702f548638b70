// SPDX-License-Identifier: BSD-3-Clause
// The side of Node.js of wasm_commands.py: node wasm_jobs.mjs FOLDER JOBS
//
// FOLDER has kempe.mjs; JOBS is JSON: a list of {words, files, to}: the words of a command, the files that it may read (path in its
// folder: path here), and the folder for what it writes. Prints JSON: {start_s, jobs: [{code, text, messages, seconds, processor_s}]}.
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { pathToFileURL } from "node:url";

const [, , folder, jobs] = process.argv;
const before = performance.now();
const { Kempe } = await import(pathToFileURL(join(folder, "kempe.mjs")));
const kempe = await Kempe.start();
const version = await kempe.version();
const start_s = (performance.now() - before) / 1000, done = [];
for (const { words, files, to } of JSON.parse(readFileSync(jobs, "utf8"))) {
    const given = Object.fromEntries(Object.entries(files).map(([name, path]) => [name, readFileSync(path)]));
    const began = performance.now(), before = process.cpuUsage(), { files: written, ...outcome } = await kempe.command(words, { files: given });
    const { user, system } = process.cpuUsage(before);
    done.push({ ...outcome, seconds: (performance.now() - began) / 1000, processor_s: (user + system) / 1e6 });
    for (const [name, bytes] of Object.entries(written)) {
        mkdirSync(dirname(join(to, name)), { recursive: true });
        writeFileSync(join(to, name), bytes);
    }
}
kempe.close();
process.stdout.write(JSON.stringify({ version, start_s, jobs: done }));
