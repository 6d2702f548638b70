/* SPDX-License-Identifier: BSD-3-Clause */
/* The page of a comparison: the recommendation, the work-precision diagram, the runs shown in detail, tables. */
"use strict";

/* -- methods ------------------------------------------------------------------------------------------------ */

/* A part of the data that belongs to a method has its words; methods are numbered in the order of their runs. */
const keyOf = (part) => ["formulation", "form", "integrator", "linear"].map((word) => part[word]).filter((word) => word && word !== "none").join(" ");
const methods = [...new Map(data.runs.map((run) => [keyOf(run), run])).values()];
for (const run of data.runs) run.method = methods.findIndex((method) => keyOf(method) === keyOf(run));

const nameOf = (method) => keyOf(methods[method]);
const runName = (run) => `${keyOf(run)}, rtol ${tolerance(run.rtol)}`;

const QUANTITIES = ["q", "qd", "\u03bb"];
const hasReference = isNumber(data.reference.until);
const uncertainty = [data.reference.uncertainty, data.reference.uncertainty_qd, data.reference.uncertainty_lambda];
const errorsOf = ({ error }) => [error.q, error.qd, error.lambda];
const hiddenMethods = new Set();
let quantity = 0;
const errorOf = (run) => errorsOf(run)[quantity];

/* -- looks -------------------------------------------------------------------------------------------------- */

/* A colour for each integrator, dashes for each formulation, points for each of its methods with one integrator. */
const [formulations, integrators] = ["formulation", "integrator"].map((word) => [...new Set(methods.map((method) => method[word]))]);
const POINTS = {
    circle: "M11,6a4,4 0 1 0 8,0a4,4 0 1 0 -8,0",
    rect: "M11,2h8v8h-8z",
    triangle: "M15,1l5,9h-10z",
    rectRot: "M15,1l5,5l-5,5l-5,-5z",
    star: "M15,1v10M10,6h10M11.5,2.5l7,7M18.5,2.5l-7,7",
    crossRot: "M11,2l8,8M19,2l-8,8",
};
const STYLES = Object.keys(POINTS);
const partOf = (method) => formulations.indexOf(methods[method].formulation);
const matesOf = (method) => methods.map((_, w) => w).filter((w) => ["formulation", "integrator"].every((word) => methods[w][word] === methods[method][word]));

const colourOf = (method) => curveColour(integrators.indexOf(methods[method].integrator));
const dashesOfMethod = (method) => dashesOf(partOf(method));
const styleOfPoints = (method) => STYLES[(partOf(method) + formulations.length * matesOf(method).indexOf(method)) % STYLES.length];

/* Its line and point, in the present colour. */
function markOf(method) {
    const line = drawn2d("path", { d: "M0,6H30", "stroke-width": 2.5, "stroke-dasharray": dashesOfMethod(method).join(" ") });
    const mark = drawn2d("svg", { class: "method", width: 30, height: 12, "aria-hidden": "true" }, line, drawn2d("path", { d: POINTS[styleOfPoints(method)], "stroke-width": 1.5, fill: "currentColor" }));
    mark.dataset.method = method;
    mark.style.color = colourOf(method);
    return mark;
}

/* -- summary ------------------------------------------------------------------------------------------------ */

const advised = data.runs.find((run) => run.rtol === data.advice.rtol && keyOf(run) === keyOf(data.advice));

function writeAnswer() {
    const sentences = data.advice.reasons, complete = data.status === "complete";
    if (!advised)
        return writeHead([complete || data.status === "not trustworthy" ? "No recommendation is possible" : data.status === "stopped" ? "Stopped before the end" : "No run reached the end"], [], sentences);
    const error = isNumber(advised.error.q) ? power(advised.error.q) : advised.below_reference ? "< " + power(10 * uncertainty[0]) : "unknown";
    const answer = [complete ? "Use " : `${sentence(data.status)}: use `, `${nameOf(advised.method)} `, element("small", `at rtol ${tolerance(advised.rtol)}`)];
    const facts = [["error of q", error], ["CPU time", duration(advised.cpu_s)], ["evaluations", count(advised.work.rhs)]];
    return writeHead(answer, facts.map(([name, value]) => ({ name, value })), sentences);
}

/* Bars of the times that the other methods take for the error of the advice; the scale is logarithmic. */
function writeOthers() {
    const level = data.equal_error.find((l) => l.error === data.advice.error), table = element("table"), most = 7;
    if (!advised || !level) return;
    const rows = level.methods.map((method, w) => ({ method: w, ratio: isNumber(method.ratio) ? method.ratio : Infinity }));
    rows.sort((a, b) => a.ratio - b.ratio || a.method - b.method);
    const top = Math.max(2, ...rows.map((row) => row.ratio).filter(isFinite));
    for (const row of rows.slice(0, most)) {
        const bar = element("i"), attained = isFinite(row.ratio);
        bar.style.width = attained ? `${8 + (92 * Math.log(row.ratio)) / Math.log(top)}%` : "0";
        bar.style.color = colourOf(row.method);
        bar.dataset.method = row.method;
        bar.hidden = !attained;
        table.append(element(attained ? "tr" : "tr.none", element("td", markOf(row.method), nameOf(row.method)), element("td", bar), element("td", attained ? ratio(row.ratio) : "not attained")));
    }
    byId("others").append(element("h3", `CPU time for an error of q of ${power(level.error)}`), table);
    if (rows.length > most) byId("others").append(element("p.note", `and ${rows.length - most} more in the table of CPU time at equal error`));
}

function writeReference() {
    const [q, qd, lambda] = uncertainty, source = data.reference.source || "";
    let words = hasReference ? `Reference: ${source}` : `No reference: ${source === "none" ? "errors are unknown" : source.replace(/^none: /, "")}`;
    if (hasReference && q > 0) words += `; its estimated error is ${power(q)} in q, ${power(qd)} in qd` + (isNumber(lambda) ? `, ${power(lambda)} in \u03bb` : "");
    byId("reference").append(words + ".");
    const failed = data.runs.filter((run) => run.status !== "complete" && !run.left_out).length;
    if (failed + data.failures.length + data.warnings.length === 0) return;
    const link = element("a", failed > 0 ? `${failed} of ${data.runs.length} runs failed: reasons` : "Failed runs and warnings");
    link.href = "#failures";
    byId("trouble").append(link);
}

/* -- tables ------------------------------------------------------------------------------------------------- */

/* The time of a method at a level; that of the fastest one is marked. */
function levelCell({ below_reference: blank, methods: costs }, w) {
    if (blank) return element("td");
    const { cpu_s: cpu, ratio: slower, rtol } = costs[w];
    if (!isNumber(cpu)) return element("td", "\u2013");
    const cell = element(slower === 1 ? "td.best" : "td", three(1e3 * cpu));
    if (slower !== 1) cell.append(element("small", ratio(slower)));
    cell.title = runName({ ...methods[w], rtol });
    return cell;
}

function writeLevels() {
    const levels = data.equal_error, table = byId("levels").querySelector("table");
    byId("levels").hidden = levels.length === 0;
    byId("levels").querySelector(".note").append("CPU time in ms of each method for an error of q, and the ratio to the fastest method of the column." +
        (levels.some((level) => level.below_reference) ? " Columns below ten times the estimated error of the reference are blank." : ""));
    table.append(headRow(["error of q", ...levels.map((level) => power(level.error))]));
    methods.forEach((_, w) => table.append(rowOf(element("td", markOf(w), nameOf(w)), ...levels.map((level) => levelCell(level, w)))));
}

/* Time, steps, evaluations a step and time of an evaluation at a level, and what multiple of the base's time it is. */
function costCells(cost) {
    const { cpu_s: cpu, steps, evaluations, ratio: times, ratio_steps, ratio_evaluations_per_step, ratio_time_per_evaluation } = cost;
    const isBase = times === 1 && ratio_steps === 1;
    if (!isNumber(cpu)) return ["\u2013", "", "", "", ""];
    const cell = (value, multiple) => element("td", value, ...(isBase ? [] : [element("small", ratio(multiple))]));
    return [three(1e3 * cpu), isBase ? "1" : ratio(times), cell(count(Math.round(steps)), ratio_steps), cell(three(evaluations / steps), ratio_evaluations_per_step),
        cell(three((1e6 * cpu) / evaluations), ratio_time_per_evaluation)];
}

function writeTable(id, rows) {
    byId(id).hidden = rows.length === 0;
    (rows.length > 0 ? rows[0].errors : []).forEach(({ error }, k) => {
        const table = element("table", headRow([`error of q ${power(error)}`, "CPU ms", "ratio", "steps", "evaluations a step", "\u00b5s an evaluation"]));
        for (const row of rows) table.append(rowOf(element("td", markOf(methods.findIndex((method) => keyOf(method) === keyOf(row))), keyOf(row)), ...costCells(row.errors[k])));
        byId(id).append(element("div.scroll", table));
    });
}

function writeFailures() {
    fillList(byId("failures").querySelector("ul"), [...data.failures, ...data.warnings]);
    byId("failures").hidden = data.failures.length + data.warnings.length === 0;
}

const COLUMNS = ["method", "rtol", "error q", "qd", "\u03bb", "|h|", "|h\u2019|", "energy", "CPU ms", "preparation ms", "memory kB"];
const COUNTS = { steps: "steps", rejected: "rejected", rhs: "evaluations", newton: "Newton", jacobians: "Jacobians", factorizations: "factored", exchanges: "exchanges" };

const endAlike = (a, b) => a && b && a.status !== "complete" && a.status === b.status && a.method === b.method && a.reason === b.reason;

/* A row for a run, and all until the last one. */
function rowOfRun(k, last = k) {
    const run = data.runs[k], begins = k > 0 && data.runs[k - 1].method !== run.method;
    const at = tolerance(run.rtol) + (last > k ? ` to ${tolerance(data.runs[last].rtol)}` : "");
    return element("tr" + (begins ? ".begins" : "") + (run === advised ? ".advised" : ""), element("td", markOf(run.method), nameOf(run.method)), element("td", at));
}

/* Incomplete runs of a method with the same reason are one row; null for all but the first of them. */
function runRow(run, k) {
    if (endAlike(data.runs[k - 1], run)) return null;
    let last = k;
    while (endAlike(data.runs[last + 1], run)) last++;
    const row = rowOfRun(k, last), { residual } = run;
    if (run.status !== "complete") {
        const reason = run.reason.split("\n")[0];
        const cell = run.left_out ? element("td.words", reason) : element("td.words", element("span.failed", run.status), ": " + reason);
        cell.colSpan = COLUMNS.length - 2;
        row.append(cell);
        return row;
    }
    for (const x of [...errorsOf(run), residual.h_max, residual.hdot_max, run.energy.drift_rel]) row.append(element("td", short(x)));
    for (const x of [1e3 * run.cpu_s, 1e3 * (data.build_s + run.build_s)]) row.append(element("td", three(x)));
    row.append(element("td", isNumber(run.memory_bytes) ? three(run.memory_bytes / 1024) : "\u2013"));
    return row;
}

/* The counts of a complete run; null of any other. */
function countRow({ status, work }, k) {
    const row = status === "complete" ? rowOfRun(k) : null;
    if (row) row.append(...Object.keys(COUNTS).map((key) => element("td", count(work[key]))));
    return row;
}

function writeRuns() {
    const [table, counts] = document.querySelectorAll("#runs table");
    table.append(headRow(COLUMNS), ...data.runs.map(runRow).filter((row) => row));
    counts.append(headRow(["method", "rtol", ...Object.values(COUNTS)]), ...data.runs.map(countRow).filter((row) => row));
    byId("runs").hidden = data.runs.length === 0;
}

/* -- legends ------------------------------------------------------------------------------------------------ */

/* The entry of a member of what is drawn, which goes into the set of hidden ones and out of it. */
function legendEntry(method, words, hidden, member) {
    return element("li", buttonOf([markOf(method), words], !hidden.has(member), () => {
        if (!hidden.delete(member)) hidden.add(member);
        drawPlots();
    }));
}

/* -- work-precision diagram --------------------------------------------------------------------------------- */

function costSets(work) {
    const sets = [];
    methods.forEach((method, w) => {
        if (hiddenMethods.has(w)) return;
        const runs = data.runs.filter((run) => run.method === w && run.status === "complete" && errorOf(run) > 0);
        const advisedHere = (run) => run === advised;
        sets.push(curveOf(runs.map((run) => ({ x: work(run), y: errorOf(run), run })), colourOf(w), {
            borderWidth: 2,
            borderDash: dashesOfMethod(w),
            pointStyle: styleOfPoints(w),
            pointRadius: runs.map((run) => (advisedHere(run) ? 8 : 4)),
            pointBorderColor: runs.map((run) => (advisedHere(run) ? inkColour() : colourOf(w))),
            pointBorderWidth: runs.map((run) => (advisedHere(run) ? 2.5 : 1)),
            pointHoverRadius: 8,
        }));
    });
    return sets;
}

/* The axis of errors ends at the uncertainty of the reference. */
function errorAxis() {
    const floor = 10 * uncertainty[quantity];
    const range = rangeOf(data.runs.map((run) => errorOf(run)), 2) || [1e-12, 1];
    const low = floor > 0 ? floor : range[0];
    return logAxis(low, Math.max(range[1], 10 * low), `error of ${QUANTITIES[quantity]}`);
}

function drawCost(id, work, title) {
    const range = rangeOf(data.runs.filter((run) => run.status === "complete").map(work), 1.5) || [1, 10];
    const label = (item) => {
        const run = item.raw.run;
        return [runName(run), `error of ${QUANTITIES[quantity]} ${short(errorOf(run))}`, `${duration(run.cpu_s)}, ${count(run.work.rhs)} evaluations, ${count(run.work.steps)} steps`];
    };
    drawPlot(id, costSets(work), { x: logAxis(range[0], range[1], title), y: errorAxis() }, label);
    byId(id).dataset.quantity = QUANTITIES[quantity];
}

function drawCosts() {
    const floor = uncertainty[quantity], some = data.runs.some((run) => errorOf(run) > 0);
    document.querySelector("#cost .pair").hidden = byId("methods-shown").hidden = !some;
    byId("floor").textContent = !some ? "No run has an error above the accuracy of the reference." : floor > 0 ? `The axis ends at ten times the estimated error of the reference, ${power(10 * floor)}.` : "";
    byId("methods-shown").replaceChildren(...methods.map((method, w) => legendEntry(w, nameOf(w), hiddenMethods, w)));
    drawCost("by-cpu", (run) => 1e3 * run.cpu_s, "CPU ms");
    drawCost("by-rhs", (run) => run.work.rhs, "evaluations");
}

/* -- all plots -------------------------------------------------------------------------------------------- */

const recordName = (shown) => runName(data.runs[shown.run]);
const recordLook = ({ run }) => ({ borderColor: colourOf(data.runs[run].method), borderDash: dashesOfMethod(data.runs[run].method) });

function drawPlots() {
    if (hasReference) drawCosts();
    byId("shown").replaceChildren(...data.shown.map((shown, k) => legendEntry(data.runs[shown.run].method, recordName(shown), hiddenRuns, k)));
    drawRecords([0, data.t_end]);
}

/* -- the whole page ----------------------------------------------------------------------------------------- */

function beginCost() {
    const buttons = [...document.querySelectorAll(".switch button")];
    byId("cost").hidden = !hasReference || data.runs.length === 0;
    for (const button of buttons) {
        const own = Number(button.dataset.quantity);
        button.hidden = !data.runs.some((run) => isNumber(errorsOf(run)[own]));
        button.addEventListener("click", () => {
            quantity = own;
            for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
            drawCosts();
        });
    }
}

function drawAll() {
    for (const mark of document.querySelectorAll("[data-method]")) mark.style.color = colourOf(Number(mark.dataset.method));
    drawPlots();
}

function stageNote({ frames }) {
    if (frames.t_end === 0) return "The mechanism at its start, as far as it can be assembled.";
    return frames.t_end < 0.999 * data.t_end ? `The animation shows the first ${three(frames.t_end)} s of ${three(data.t_end)} s.` : "";
}

function begin() {
    writeAnswer();
    writeOthers();
    writeReference();
    writeTable("same", data.same_integrator);
    writeTable("bests", data.best_of_formulation);
    writeLevels();
    writeFailures();
    writeRuns();
    beginCost();
    beginRecords("Time histories of residuals and step size", "The recommended run and the best run of each other formulation, repeated with monitoring. The vertical line is the time of the animation.",
        (shown) => [markOf(data.runs[shown.run].method), recordName(shown)]);
    drawPage(drawAll, data.picture, {
        span: () => [0, data.picture.frames.t_end],
        seconds: () => PLAY_SECONDS,
        note: stageNote,
        clock: (t) => clockOf(t, data.picture.frames.t_end),
        shown: showCursor,
    });
}

begin();
