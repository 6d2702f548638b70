/* SPDX-License-Identifier: BSD-3-Clause */
/* The largest force and moment of each joint over time, or those of one instant, with their components. */
"use strict";

const COMPONENTS = ["x", "y", "z"], MOST_JOINTS = 6;

/* The columns of forces or of moments, as [title, name]; none where no joint has one. */
function reactionColumns(given, what, single) {
    const at = given.columns.indexOf(what);
    if (!given.rows.some((row) => isNumber(row[at]))) return [];
    const time = single ? [] : [["at t, s", `${what}.t`]];
    return [[`${what}, ${given.units[at]}`, what], ...time, ...COMPONENTS.map((axis) => [axis, `${what}.${axis}`])];
}

/* Rounding of the largest is 0. */
const cleaned = (x, largest) => (isNumber(x) && Math.abs(x) <= 1e-12 * largest ? 0 : x);

/* The joints with the largest forces, in the card of the result. */
function writeLargest(given, rows, cell, single) {
    const list = rows.filter((row) => cell(row, "force") > 0).sort((a, b) => cell(b, "force") - cell(a, "force"));
    const place = byId("joint-forces"), table = place.querySelector("table");
    place.hidden = list.length === 0;
    table.append(headRow(["joint", `force, ${given.units[given.columns.indexOf("force")]}`, ...(single ? [] : ["at t, s"])]));
    for (const row of list.slice(0, MOST_JOINTS)) table.append(rowOf(cell(row, "joint") + (cell(row, "unique") === 0 ? " (not unique)" : ""), digits(cell(row, "force")), ...(single ? [] : [digits(cell(row, "force.t"), 4)])));
}

function writeReactions() {
    const given = data.reactions;
    byId("reactions").hidden = byId("joint-forces").hidden = !given;
    if (!given) return;
    const cell = (row, name) => row[given.columns.indexOf(name)];
    const times = given.rows.flatMap((row) => [cell(row, "force.t"), cell(row, "moment.t")]).filter(isNumber);
    const single = new Set(times).size < 2, numbered = given.columns.includes("equilibrium") && cell(given.rows[given.rows.length - 1], "equilibrium") > 0;
    const columns = [...reactionColumns(given, "force", single), ...reactionColumns(given, "moment", single)];
    writeLargest(given, numbered ? [] : given.rows, cell, single); /* of one result */
    const largest = Math.max(...given.rows.flatMap((row) => [cell(row, "force"), cell(row, "moment")]).filter(isNumber), 0);
    const table = byId("reactions-table");
    table.append(headRow(["joint", ...(numbered ? ["equilibrium"] : []), ...columns.map(([title]) => title)]));
    for (const row of given.rows) {
        const kind = cell(row, "kind"), of = kind === "joint" ? "" : ` (${kind})`;
        const cells = columns.map(([, name]) => digits(name.endsWith(".t") ? cell(row, name) : cleaned(cell(row, name), largest)));
        table.append(rowOf(cell(row, "joint") + of + (cell(row, "unique") === 0 ? " *" : ""), ...(numbered ? [digits(cell(row, "equilibrium") + 1)] : []), ...cells));
    }
    const notes = ["On the second body of each joint, in ground axes."];
    if (data.reaction_peaks) notes.push(`The largest of the motion from ${digits(data.reaction_peaks[0])} to ${digits(data.reaction_peaks[1])} s, between rows too.`);
    else if (!single) notes.push("The largest of all rows.");
    if (given.rows.some((row) => cell(row, "unique") === 0)) notes.push("* not unique: redundant constraints share the load.");
    for (const row of given.rows) if (cell(row, "note")) notes.push(`${cell(row, "joint")}: ${cell(row, "note")}.`);
    byId("reactions-note").append(notes.join(" "));
    writeBearings();
}

/* The loads of the bearings of a model that has some. */
function writeBearings() {
    const given = data.bearings;
    byId("bearings").hidden = !given;
    if (!given) return;
    const at = (name) => given.columns.indexOf(name), titled = (name) => `${name}, ${given.units[at(name)]}`;
    const largest = Math.max(...given.rows.map((row) => row[at("radial")]).filter(isNumber), 0);
    const table = byId("bearings-table");
    table.append(headRow(["bearing", titled("at"), titled("radial"), "at t, s", titled("axial"), "at t, s", titled("equivalent"), "p"]));
    for (const row of given.rows) {
        const loads = ["radial", "radial.t", "axial", "axial.t", "equivalent"].map((name) => digits(name.endsWith(".t") ? row[at(name)] : cleaned(row[at(name)], largest)));
        table.append(rowOf(`${row[at("bearings")]} ${row[at("bearing")]}${row[at("unique")] === 0 ? " *" : ""}`, digits(row[at("at")]), ...loads, digits(row[at("life")])));
    }
}
