/* SPDX-License-Identifier: BSD-3-Clause */
/* Runs that were monitored: residuals, energy balance and step size over time, and their log. A page says by
 * recordName(shown) and recordLook(shown) how it calls and draws a run. */
"use strict";

const hiddenRuns = new Set();

/* -- over time ---------------------------------------------------------------------------------------------- */

const KIND_STYLES = { exchange: "triangle", "change point": "star", event: "crossRot", restart: "rectRot" };
const markStyle = (kind) => KIND_STYLES[kind] || "rect";

function shownSets(values) {
    return data.shown.filter((shown, k) => !hiddenRuns.has(k)).map((shown) => curveOf(values(shown), recordLook(shown).borderColor, { shown, spanGaps: true, ...recordLook(shown) }));
}

/* Rows are evenly spaced, but for the last one of a run that ends early; zeros are left out on a logarithmic axis. */
function rowPoints(shown, values) {
    const timeOf = (k) => Math.min(shown.t_start + k * shown.spacing, shown.t_end);
    return values.map((x, k) => ({ x: timeOf(k), y: Math.abs(x) > 0 ? Math.abs(x) : null }));
}

function drawHistory(id, values, span) {
    const sets = shownSets((shown) => rowPoints(shown, values(shown)));
    const range = rangeOf(data.shown.flatMap((shown) => values(shown).map(Math.abs)), 1.5) || [1e-17, 1e-15];
    const label = (item) => [recordName(item.dataset.shown), `${short(item.raw.y)} at ${three(item.raw.x)} s`];
    drawPlot(id, sets, { x: evenAxis(span, "s"), y: logAxis(...range) }, label);
}

/* Steps in a row are [time, shortest, longest]. */
function stepAt({ steps }, t) {
    const [low, high, part] = placeIn(steps.map((step) => step[0]), t);
    return (steps[part < 1 ? low : high] || [])[2];
}

function stepPoints(shown, part) {
    const points = shown.steps.map((step) => ({ x: step[0], y: step[part] }));
    if (points.length > 0) points.push({ x: shown.t_end, y: points[points.length - 1].y });
    return points;
}

/* A line, or the band between the shortest and the longest of several steps; marks where something happened. */
function stepSets() {
    const sets = [];
    for (const set of shownSets((shown) => stepPoints(shown, 2))) {
        const shown = set.shown;
        Object.assign(set, { stepped: "before", each: shown.each });
        sets.push(set);
        if (shown.each > 1) {
            const fill = `${set.borderColor}4d`;
            sets.push({ ...set, data: stepPoints(shown, 1), fill: "-1", backgroundColor: fill, borderWidth: 0.75 });
        }
        const marks = shown.log.map((entry) => ({ x: entry.t, y: stepAt(shown, entry.t), entry })), pointStyle = shown.log.map((entry) => markStyle(entry.kind));
        if (marks.length > 0) sets.push(curveOf(marks, inkColour(), { shown, showLine: false, pointStyle, pointRadius: 5.5, pointBorderWidth: 1.5, backgroundColor: set.borderColor }));
    }
    return sets;
}

/* A run in parts has no steps of the whole. */
function drawSteps(span) {
    const stepped = data.shown.some((shown) => shown.steps.length > 0);
    byId("over-step").closest("figure").hidden = !stepped;
    if (!stepped) return;
    const range = rangeOf(data.shown.flatMap((shown) => shown.steps.flatMap((step) => step.slice(1))), 1.5) || [1e-3, 1];
    const label = (item) => {
        const entry = item.raw.entry;
        if (entry) return [recordName(item.dataset.shown), `${entry.kind} at ${three(entry.t)} s: ${entry.text}`];
        const each = item.dataset.each > 1 ? ` (longest and shortest of ${item.dataset.each})` : "";
        return [recordName(item.dataset.shown), `step of ${short(item.raw.y, 2)} s at ${three(item.raw.x)} s${each}`];
    };
    drawPlot("over-step", stepSets(), { x: evenAxis(span, "s"), y: logAxis(...range) }, label);
}

/* `nameOf`: the elements that name the run of an entry. */
function writeLog(nameOf) {
    const symbols = { triangle: "\u25b3", star: "\u2217", crossRot: "\u00d7", rectRot: "\u25c7", rect: "\u25a1" };
    const log = data.shown.flatMap((shown) => shown.log.map((entry) => ({ shown, ...entry })));
    const all = data.shown.reduce((sum, shown) => sum + shown.log_count, 0), table = byId("log").querySelector("table");
    byId("marks").textContent = [...new Set(log.map((entry) => entry.kind))].map((kind) => `${symbols[markStyle(kind)]} ${kind}`).join("  ");
    byId("log").hidden = log.length === 0;
    if (log.length === 0) return;
    byId("log").querySelector("summary").append(`Log: ${count(all)}` + (all > log.length ? `, the first ${log.length} are listed` : ""));
    table.append(headRow(["run", "t, s", "", ""]));
    for (const entry of log) table.append(rowOf(element("td", ...nameOf(entry.shown)), three(entry.t), element("td.words", entry.kind), element("td.words", entry.text)));
}

function beginRecords(title, note, nameOf) {
    byId("history").hidden = data.shown.length === 0;
    for (const figure of document.querySelectorAll(".closures")) figure.hidden = data.m === 0;
    byId("history").querySelector("h2").append(title);
    byId("history").querySelector(".note").append(note);
    writeLog(nameOf);
}

/* All plots of the runs over a span of time. */
function drawRecords(span) {
    if (data.shown.length === 0) return;
    if (data.m > 0) {
        drawHistory("over-h", (shown) => shown.h, span);
        drawHistory("over-hdot", (shown) => shown.hdot, span);
    }
    drawHistory("over-energy", (shown) => shown.energy, span);
    drawSteps(span);
}
