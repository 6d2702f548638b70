/* SPDX-License-Identifier: BSD-3-Clause */
/* Plots: work-precision diagram, and time histories of the runs shown in detail. */
"use strict";

const QUANTITIES = ["q", "qd", "\u03bb"];
const hiddenMethods = new Set(), hiddenRuns = new Set();
let quantity = 0;

/* -- axes --------------------------------------------------------------------------------------------------- */

/* A logarithmic axis with its powers of ten, or 1, 2, 5 of them where it is short; not more than eight. */
function logAxis(low, high, title) {
    const decades = Math.log10(high / low), each = Math.max(1, Math.ceil(decades / 8));
    const ticks = (scale) => {
        const values = [];
        for (let k = Math.floor(Math.log10(scale.min)); k <= Math.ceil(Math.log10(scale.max)); k++)
            for (const part of decades < 2 ? [1, 2, 5] : [1])
                if (k % each === 0 || decades < 2) values.push(Number(`${part}e${k}`));
        scale.ticks = values.filter((x) => x >= scale.min * 0.999999 && x <= scale.max * 1.000001).map((value) => ({ value }));
    };
    const words = (x) => (x >= 10 && x < 1e5 && decades < 4 ? count(x) : decades < 2 ? three(x) : power(x));
    return axisOf("logarithmic", title, { callback: words }, { min: low, max: high, afterBuildTicks: ticks });
}

function timeAxis(end) {
    const words = (x) => three(Number(x.toPrecision(8))) + " s";
    return axisOf("linear", "", { maxTicksLimit: 7, maxRotation: 0, callback: words }, { min: 0, max: end });
}

/* The values of all points, with a little room; null when there are none. */
function rangeOf(values, room) {
    const positive = values.filter((x) => x > 0 && isFinite(x));
    if (positive.length === 0) return null;
    let low = Infinity, high = 0;
    for (const x of positive) {
        low = Math.min(low, x);
        high = Math.max(high, x);
    }
    return [low / room, Math.max(high * room, low * 1.5)];
}

/* -- legends ------------------------------------------------------------------------------------------------ */

function legendEntry(method, words, hidden, toggle) {
    const button = element("button");
    const rank = rankOf(method);
    button.type = "button";
    button.innerHTML = '<svg width="30" height="12" aria-hidden="true"><line x1="0" y1="6" x2="30" y2="6" stroke-width="2.5"/><circle cx="15" cy="6" r="4"/></svg>';
    const line = button.querySelector("line"), dot = button.querySelector("circle");
    line.setAttribute("stroke", colourOf(method));
    line.setAttribute("stroke-dasharray", DASHES[rank % DASHES.length].join(" "));
    dot.setAttribute("fill", colourOf(method));
    button.append(words);
    button.setAttribute("aria-pressed", String(!hidden));
    button.addEventListener("click", toggle);
    return element("li", button);
}

/* Toggles visibility. */
function turn(set, member) {
    if (!set.delete(member)) set.add(member);
    drawPlots();
}

/* -- work-precision diagram --------------------------------------------------------------------------------- */

function costSets(work) {
    const sets = [];
    data.methods.forEach((method, w) => {
        if (hiddenMethods.has(w)) return;
        const runs = data.runs.filter((run) => run.method === w && run.status === "ok" && run.error[quantity] > 0);
        const rank = rankOf(w), advisedHere = (run) => run === advised;
        sets.push({
            data: runs.map((run) => ({ x: work(run), y: run.error[quantity], run })),
            borderColor: colourOf(w),
            backgroundColor: colourOf(w),
            borderWidth: 2,
            borderDash: DASHES[rank % DASHES.length],
            pointStyle: STYLES[rank % STYLES.length],
            pointRadius: runs.map((run) => (advisedHere(run) ? 8 : 4)),
            pointBorderColor: runs.map((run) => (advisedHere(run) ? inkColour() : colourOf(w))),
            pointBorderWidth: runs.map((run) => (advisedHere(run) ? 2.5 : 1)),
            pointHoverRadius: 8,
        });
    });
    return sets;
}

/* The axis of errors ends at the uncertainty of the reference. */
function errorAxis() {
    const floor = 10 * data.reference.uncertainty[quantity];
    const range = rangeOf(data.runs.map((run) => run.error[quantity]), 2) || [1e-12, 1];
    const low = floor > 0 ? floor : range[0];
    return logAxis(low, Math.max(range[1], 10 * low), `error of ${QUANTITIES[quantity]}`);
}

function drawCost(id, work, title) {
    const range = rangeOf(data.runs.filter((run) => run.status === "ok").map(work), 1.5) || [1, 10];
    const label = (item) => {
        const run = item.raw.run;
        return [runName(run), `error of ${QUANTITIES[quantity]} ${short(run.error[quantity])}`, `${duration(run.cpu)}, ${count(run.rhs)} evaluations, ${count(run.steps)} steps`];
    };
    drawPlot(id, costSets(work), { x: logAxis(range[0], range[1], title), y: errorAxis() }, label);
    byId(id).dataset.quantity = QUANTITIES[quantity];
}

function drawCosts() {
    const floor = data.reference.uncertainty[quantity], some = data.runs.some((run) => run.error[quantity] > 0);
    document.querySelector("#cost .pair").hidden = byId("methods-shown").hidden = !some;
    byId("floor").textContent = !some ? "No run has an error above the accuracy of the reference." : floor > 0 ? `The axis ends at ten times the estimated error of the reference, ${power(10 * floor)}.` : "";
    byId("methods-shown").replaceChildren(...data.methods.map((method, w) => legendEntry(w, nameOf(w), hiddenMethods.has(w), () => turn(hiddenMethods, w))));
    drawCost("by-cpu", (run) => 1e3 * run.cpu, "CPU ms");
    drawCost("by-rhs", (run) => run.rhs, "evaluations");
}

/* -- over time ---------------------------------------------------------------------------------------------- */

const KIND_STYLES = { exchange: "triangle", "change point": "star", event: "crossRot", restart: "rectRot" };
const markStyle = (kind) => KIND_STYLES[kind] || "rect";

function shownSets(values) {
    return data.shown.filter((shown, k) => !hiddenRuns.has(k)).map((shown) => {
        const run = data.runs[shown.run], colour = colourOf(run.method);
        return { data: values(shown), borderColor: colour, backgroundColor: colour, borderWidth: 1.5, pointRadius: 0, pointHitRadius: 6, run };
    });
}

/* Rows are evenly spaced from 0 to the run's end; zeros are left out on a logarithmic axis. */
function rowPoints(shown, values) {
    const step = shown.rows > 1 ? shown.t_end / (shown.rows - 1) : 0;
    return values.map((x, k) => ({ x: k * step, y: Math.abs(x) > 0 ? Math.abs(x) : null }));
}

function drawHistory(id, values) {
    const sets = shownSets((shown) => rowPoints(shown, values(shown)));
    const range = rangeOf(data.shown.flatMap((shown) => values(shown).map(Math.abs)), 1.5);
    const label = (item) => [runName(item.dataset.run), `${short(item.raw.y)} at ${three(item.raw.x)} s`];
    for (const set of sets) set.spanGaps = true;
    const axis = range || [1e-17, 1e-15];
    drawPlot(id, sets, { x: timeAxis(data.t_end), y: logAxis(axis[0], axis[1]) }, label);
}

function stepAt(shown, t) {
    let k = 0;
    while (k + 1 < shown.step.count && shown.step.t[k + 1] <= t) k++;
    return shown.step.most[k];
}

function stepPoints(shown, part) {
    const points = shown.step.t.map((t, k) => ({ x: t, y: shown.step[part][k] }));
    if (points.length > 0) points.push({ x: shown.t_end, y: points[points.length - 1].y });
    return points;
}

/* A line, or the band between the shortest and the longest of several steps; marks where something happened. */
function stepSets() {
    const sets = [];
    for (const set of shownSets((shown) => stepPoints(shown, "most"))) {
        const shown = data.shown.find((s) => data.runs[s.run] === set.run);
        Object.assign(set, { stepped: "before", each: shown.each });
        sets.push(set);
        if (shown.each > 1) {
            const fill = set.borderColor.replace(")", " / 0.3)");
            sets.push({ ...set, data: stepPoints(shown, "least"), fill: "-1", backgroundColor: fill, borderWidth: 0.75 });
        }
        if (shown.log.length > 0)
            sets.push({
                data: shown.log.map((entry) => ({ x: entry.t, y: stepAt(shown, entry.t), entry })),
                run: set.run,
                showLine: false,
                pointStyle: shown.log.map((entry) => markStyle(entry.kind)),
                pointRadius: 5.5,
                borderColor: inkColour(),
                pointBorderWidth: 1.5,
                backgroundColor: set.borderColor,
            });
    }
    return sets;
}

function drawSteps() {
    const range = rangeOf(data.shown.flatMap((shown) => [...shown.step.least, ...shown.step.most]), 1.5) || [1e-3, 1];
    const label = (item) => {
        const entry = item.raw.entry;
        if (entry) return [runName(item.dataset.run), `${entry.kind} at ${three(entry.t)} s: ${entry.text}`];
        const each = item.dataset.each > 1 ? ` (longest and shortest of ${item.dataset.each})` : "";
        return [runName(item.dataset.run), `step of ${short(item.raw.y, 2)} s at ${three(item.raw.x)} s${each}`];
    };
    drawPlot("over-step", stepSets(), { x: timeAxis(data.t_end), y: logAxis(range[0], range[1]) }, label);
}

function showLog() {
    const symbols = { triangle: "\u25b3", star: "\u2217", crossRot: "\u00d7", rectRot: "\u25c7", rect: "\u25a1" };
    const log = data.shown.flatMap((shown) => shown.log.map((entry) => ({ run: data.runs[shown.run], ...entry })));
    const all = data.shown.reduce((sum, shown) => sum + shown.log_count, 0);
    const kinds = [...new Set(log.map((entry) => entry.kind))];
    byId("marks").textContent = kinds.map((kind) => `${symbols[markStyle(kind)]} ${kind}`).join("  ");
    byId("log").hidden = log.length === 0;
    if (log.length === 0) return;
    byId("log").querySelector("summary").append(`Log: ${count(all)}` + (all > log.length ? `, the first ${log.length} are listed` : ""));
    const table = byId("log").querySelector("table");
    table.append(headRow(["run", "t, s", "", ""]));
    for (const entry of log)
        table.append(element("tr", element("td", swatch(entry.run.method), runName(entry.run)), element("td", three(entry.t)), element("td.words", entry.kind), element("td.words", entry.text)));
}

function drawHistories() {
    byId("shown").replaceChildren(...data.shown.map((shown, k) => {
        const run = data.runs[shown.run];
        return legendEntry(run.method, runName(run), hiddenRuns.has(k), () => turn(hiddenRuns, k));
    }));
    if (data.m > 0) {
        drawHistory("over-h", (shown) => shown.h);
        drawHistory("over-hdot", (shown) => shown.hdot);
    }
    drawHistory("over-energy", (shown) => shown.energy);
    drawSteps();
}

/* The line of the moving picture's time, laid over the plots so that they need not be drawn again. */
function showCursor(t) {
    for (const id of ["over-h", "over-hdot", "over-energy", "over-step"]) {
        const plot = plots[id];
        if (!plot) continue;
        const line = byId(id).parentElement.querySelector("i"), area = plot.chartArea;
        line.style.display = "block";
        line.style.left = `${plot.scales.x.getPixelForValue(t)}px`;
        line.style.top = `${area.top}px`;
        line.style.height = `${area.bottom - area.top}px`;
    }
}

/* -- both --------------------------------------------------------------------------------------------------- */

function drawPlots() {
    if (data.reference.there) drawCosts();
    if (data.shown.length > 0) drawHistories();
}

function beginPlots() {
    Chart.defaults.font.family = getComputedStyle(document.body).fontFamily;
    byId("cost").hidden = !data.reference.there || data.runs.length === 0;
    byId("history").hidden = data.shown.length === 0;
    for (const figure of document.querySelectorAll(".closures")) figure.hidden = data.m === 0;
    const buttons = [...document.querySelectorAll(".switch button")];
    for (const button of buttons) {
        button.hidden = !data.runs.some((run) => isNumber(run.error[Number(button.dataset.quantity)]));
        button.addEventListener("click", () => {
            quantity = Number(button.dataset.quantity);
            for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
            drawCosts();
        });
    }
    showLog();
    drawPlots();
}
