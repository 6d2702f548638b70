// SPDX-License-Identifier: BSD-3-Clause
// The first runs of live pages in Node.js, used by docs/live_examples.py. The job is on standard input: { module, plots, colours, options,
// runs: [{ name, end, files, to }] }. A line for each has its processor time and its status or its error. `to` is a file for what a page
// shows of the run before the module is there: the answer, the picture, and the columns that are plotted at first.
import { readFileSync, writeFileSync } from "node:fs";
import { gzipSync } from "node:zlib";

const LIMIT = 100; // s, on a busy machine
const MOST_NUMBERS = 3000, DIGITS = 5; // of the plotted columns
const MOST_BYTES = 27000; // of all by gzip: with the module and the scripts a page has less than 1.5 MB
const job = JSON.parse(readFileSync(0, "utf8"));
const { Kempe } = await import(job.module);
const { plotChoices, firstChoices } = new Function(`${readFileSync(job.plots, "utf8")}; return { plotChoices, firstChoices };`)();

/* Second differences along each column of rows of `width` numbers, one column after the other; few of them are large, so that they pack well.
 * live_page.js adds them up again. */
function differences(numbers, width) {
    const rows = numbers.length / width, made = [];
    for (let c = 0; c < width; c++)
        for (let k = 0; k < rows; k++) {
            const back = (n) => (k >= n ? numbers[(k - n) * width + c] : 0);
            made.push(numbers[k * width + c] - 2 * back(1) + back(2));
        }
    return made;
}

/* The picture with all that has a row for each frame, or for each instant of the arrows, as such differences: { width, differences }. Of the
 * frames every so many are kept. */
function packed(json, every) {
    const { picture } = JSON.parse(json), { frames, flexible, arrows } = picture;
    const pack = (owner, key, rows, each) => {
        if (!owner?.[key]) return;
        const bytes = Buffer.from(owner[key], "base64"), numbers = new Int16Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length)), width = numbers.length / rows;
        const kept = numbers.filter((_, k) => Math.floor(k / width) % each === 0);
        if (Number.isInteger(width)) owner[key] = { width, differences: differences(kept, width) };
    };
    for (const key of ["position", "rotation"]) pack(frames, key, frames.count, every);
    for (const part of ["shift", "turn", "stress"]) pack(flexible?.[part], "numbers", frames.count, every);
    for (const key of ["parts", "places"]) pack(arrows, key, arrows && Buffer.from(arrows.x, "base64").length / 4, 1);
    frames.count = (frames.count - 1) / every + 1;
    return picture;
}

const sizeOf = (made) => gzipSync(JSON.stringify(made)).length;

/* With all frames, or with as many as make it small: the page's own run, which follows, has all. */
function smallPicture(json, most) {
    const { frames } = JSON.parse(json).picture;
    let every = 1, made = packed(json, every);
    while (sizeOf(made) > most && !frames.t && (frames.count - 1) % (2 * every) === 0) made = packed(json, (every *= 2));
    return made;
}

/* The times and the columns of the first plots, at so many rows. */
function plotted(table) {
    const choices = plotChoices(table, job.colours), names = ["t", ...new Set(firstChoices(choices).flatMap((key) => choices.get(key)))];
    const every = Math.max(1, Math.ceil(((table.rowCount - 1) * names.length) / MOST_NUMBERS)), rows = [];
    for (let row = 0; row < table.rowCount; row += every) rows.push(row);
    if (rows.at(-1) !== table.rowCount - 1) rows.push(table.rowCount - 1);
    return names.map((name) => ({ name, unit: table.unit(name), values: rows.map((row) => Number(table.column(name)[row].toPrecision(DIGITS))) }));
}

function shown({ code, text, messages, summary, files, table }) {
    const reactions = summary.reactions?.map(({ joint, unique }) => ({ joint, unique })) ?? null;
    const columns = plotted(table), picture = smallPicture(Buffer.from(files["motion.json"]).toString(), MOST_BYTES - sizeOf(columns));
    return { code, text: text.split("\n")[0], messages, summary: { status: summary.status, reactions }, picture, columns };
}

const kempe = await Kempe.start();
for (const { name, end, files, to } of job.runs) {
    const model = Object.fromEntries(Object.entries(files).map(([path, text]) => [path, Buffer.from(text, "base64")]));
    const control = new AbortController(), limit = setTimeout(() => control.abort(new Error(`more than ${LIMIT} s`)), 1000 * LIMIT), began = process.cpuUsage();
    let words;
    try {
        const run = await kempe.simulate(model, { ...job.options, animation: "/out/motion.json", ...(end ? { tEnd: end } : {}) }, { signal: control.signal });
        words = `${run.files["motion.json"]?.length ?? 0} bytes, ${run.table.rowCount} rows: ${run.text.split("\n")[0]}`;
        if (to) writeFileSync(to, JSON.stringify(shown(run)));
    } catch (error) {
        words = `none: ${error.message.split("\n")[0]}`;
    }
    clearTimeout(limit);
    const { user, system } = process.cpuUsage(began);
    console.log(`${name.padEnd(24)} ${((user + system) / 1e6).toFixed(2)} s  ${words}`);
}
kempe.close();
