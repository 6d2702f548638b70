/* SPDX-License-Identifier: BSD-3-Clause */
/* The texts and tables of the page, and its start: everything is drawn from the data in the page. */
"use strict";

/* -- colours ------------------------------------------------------------------------------------------------ */

/* A hue for each formulation; its methods have lighter shades in turn. */
const formulations = [...new Set(data.methods.map((method) => method.formulation))];
const HUES = { reduced: 208, projected: 140, dae: 8 };
const OTHER_HUES = [290, 335, 85, 60];
const HUE_SPREAD = 54;
const STYLES = ["circle", "rect", "triangle", "rectRot", "star", "crossRot"];
const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3], [4, 2], [1, 2]];
function hueOf(formulation) {
    return formulation in HUES ? HUES[formulation] : OTHER_HUES[formulations.filter((r) => !(r in HUES)).indexOf(formulation) % OTHER_HUES.length];
}

/* The rank of a method within its formulation. */
const rankOf = (method) => data.methods.slice(0, method).filter((other) => other.formulation === data.methods[method].formulation).length;

function colourOf(method) {
    const mates = data.methods.filter((other) => other.formulation === data.methods[method].formulation).length;
    const part = mates > 1 ? rankOf(method) / (mates - 1) : 0;
    const light = isDark() ? 70 - 8 * part : 36 + 16 * part, hue = hueOf(data.methods[method].formulation) + HUE_SPREAD * part;
    return `hsl(${hue} ${isDark() ? 70 : 78}% ${light}%)`;
}

const nameOf = (method) => data.methods[method].name.replace(" none ", " ");

function runName(run) {
    return `${nameOf(run.method)}, rtol ${tolerance(run.rtol)}`;
}

/* -- summary ------------------------------------------------------------------------------------------------ */

const advised = data.advice.run >= 0 ? data.runs[data.advice.run] : null;
const adviceLevel = data.levels.findIndex((l) => l.level === data.advice.level);

function fact(name, value) {
    return element("div", element("dt", name), element("dd", value));
}

function tellAnswer() {
    const answer = byId("answer");
    if (advised) {
        answer.append("Use ", element("em", nameOf(advised.method)), " ", element("small", `at rtol ${tolerance(advised.rtol)}`));
        const error = isNumber(advised.error[0]) ? power(advised.error[0]) : advised.below ? "< " + power(10 * data.reference.uncertainty[0]) : "unknown";
        byId("facts").append(fact("error of q", error), fact("CPU time", duration(advised.cpu)), fact("evaluations", count(advised.rhs)));
    } else {
        byId("facts").hidden = true;
        answer.append(data.status.startsWith("complete") || data.status === "not trustworthy" ? "No recommendation is possible" : data.status === "stopped" ? "Stopped before the end" : "No run reached the end");
    }
    if (data.reason) byId("because").append(element("li.failed", data.reason));
    fillList(byId("because"), data.advice.reasons);
    byId("because").hidden = byId("because").children.length === 0;
}

/* Bars of the times that the other methods take for the error of the advice; the scale is logarithmic. */
function tellOthers() {
    const others = byId("others"), most = 7;
    if (!advised || adviceLevel < 0) return;
    const level = data.levels[adviceLevel];
    const best = level.cost[level.best][0];
    const rows = data.methods.map((method, w) => ({ method: w, ratio: level.run[w] >= 0 ? level.cost[w][0] / best : Infinity }));
    rows.sort((a, b) => a.ratio - b.ratio || a.method - b.method);
    const top = Math.max(2, ...rows.map((row) => row.ratio).filter(isFinite));
    others.append(element("h3", `CPU time for an error of q of ${power(level.level)}`));
    const table = element("table");
    for (const row of rows.slice(0, most)) {
        const bar = element("i");
        bar.style.width = isFinite(row.ratio) ? `${8 + (92 * Math.log(row.ratio)) / Math.log(top)}%` : "0";
        bar.style.background = colourOf(row.method);
        bar.dataset.method = row.method;
        if (!isFinite(row.ratio)) bar.hidden = true;
        const words = isFinite(row.ratio) ? ratio(row.ratio) : "not attained";
        table.append(element(isFinite(row.ratio) ? "tr" : "tr.none", element("td", nameOf(row.method)), element("td", bar), element("td", words)));
    }
    others.append(table);
    if (rows.length > most) others.append(element("p.note", `and ${rows.length - most} more in the table of CPU time at equal error`));
}

function tellReference() {
    const [q, qd, lambda] = data.reference.uncertainty;
    let words = data.reference.there ? `Reference: ${data.reference.source}` : `No reference: ${data.reference.source === "none" ? "errors are unknown" : data.reference.source.replace(/^none: /, "")}`;
    if (data.reference.there && q > 0) words += `; its estimated error is ${power(q)} in q, ${power(qd)} in qd` + (isNumber(lambda) ? `, ${power(lambda)} in \u03bb` : "");
    byId("reference").append(words + ".");
    const failed = data.runs.filter((run) => run.status !== "complete" && !run.left_out).length;
    if (failed + data.failures.length + data.warnings.length === 0) return;
    const link = element("a", failed > 0 ? `${failed} of ${data.runs.length} runs failed: reasons` : "Failed runs and warnings");
    link.href = "#failures";
    byId("trouble").append(link);
}

function tellScene() {
    byId("model").append(data.model);
    byId("scene").append(`0 to ${three(data.t_end)} s \u00b7 ${data.n} coordinate${data.n === 1 ? "" : "s"}, ${data.m} closure row${data.m === 1 ? "" : "s"}`);
}

/* -- tables ------------------------------------------------------------------------------------------------- */

function swatch(method) {
    const made = element("span.swatch");
    made.style.background = colourOf(method);
    made.dataset.method = method;
    return made;
}

function levelCell(level, w) {
    const run = data.runs[level.run[w]];
    if (level.blank) return element("td");
    if (!run) return element("td", "\u2013");
    const cpu = level.cost[w][0];
    const cell = element(w === level.best ? "td.best" : "td", three(1e3 * cpu));
    if (w !== level.best) cell.append(element("small", ratio(cpu / level.cost[level.best][0])));
    cell.title = runName(run);
    return cell;
}

function tellLevels() {
    const section = byId("levels");
    if (data.levels.length === 0) {
        section.hidden = true;
        return;
    }
    const blank = data.levels.some((level) => level.blank);
    section.querySelector(".note").append("CPU time in ms of each method for an error of q, and the ratio to the fastest method of the column." +
        (blank ? " Columns below ten times the estimated error of the reference are blank." : ""));
    const table = section.querySelector("table");
    table.append(headRow(["error of q", ...data.levels.map((level) => power(level.level))]));
    data.methods.forEach((method, w) => {
        table.append(element("tr", element("td", swatch(w), nameOf(w)), ...data.levels.map((level) => levelCell(level, w))));
    });
}

/* Time, steps, evaluations a step and time of an evaluation at a level, and what multiple of the base's time it is. */
function costCells(level, method, base) {
    const [cpu, steps, rhs] = level.cost[method];
    if (!isNumber(cpu)) return [element("td", "\u2013"), ...Array.from({ length: 4 }, () => element("td"))];
    const [ofCpu, ofSteps, ofRhs] = level.cost[base];
    const cell = (value, multiple) => {
        const made = element("td", value);
        if (method !== base) made.append(element("small", ratio(multiple)));
        return made;
    };
    return [element("td", three(1e3 * cpu)), element("td", method === base ? "1" : ratio(cpu / ofCpu)), cell(count(Math.round(steps)), steps / ofSteps),
        cell(three(rhs / steps), ((rhs / steps) * ofSteps) / ofRhs), cell(three((1e6 * cpu) / rhs), ((cpu / rhs) * ofRhs) / ofCpu)];
}

function tellTable(id, rows) {
    const section = byId(id);
    section.hidden = rows.length === 0;
    const table = section.querySelector("table"), levels = data.aims.map((l) => data.levels[l]);
    table.append(headRow(["method", ...levels.flatMap((level) => [`ms for ${power(level.level)}`, "ratio", "steps", "evaluations a step", "\u00b5s an evaluation"])]));
    for (const row of rows)
        table.append(element("tr", element("td", swatch(row.method), nameOf(row.method)), ...levels.flatMap((level, k) => costCells(level, row.method, row.base[k]))));
}

function tellFailures() {
    const list = byId("failures").querySelector("ul");
    fillList(list, data.failures);
    fillList(list, data.warnings);
    byId("failures").hidden = list.children.length === 0;
}

const COLUMNS = ["method", "rtol", "error q", "qd", "\u03bb", "|h|", "|h\u2019|", "energy", "steps", "rejected", "evaluations", "Newton", "Jacobians", "factored", "exchanges", "CPU ms", "preparation ms", "memory kB"];

const endAlike = (a, b) => a && b && a.status !== "complete" && a.status === b.status && a.method === b.method && a.reason === b.reason;

/* Incomplete runs of a method with the same reason are one row; null for all but the first of them. */
function runRow(run, k) {
    if (endAlike(data.runs[k - 1], run)) return null;
    let last = k;
    while (endAlike(data.runs[last + 1], run)) last++;
    const begins = k > 0 && data.runs[k - 1].method !== run.method;
    const at = tolerance(run.rtol) + (last > k ? ` to ${tolerance(data.runs[last].rtol)}` : "");
    const row = element("tr" + (begins ? ".begins" : "") + (run === advised ? ".advised" : ""), element("td", swatch(run.method), nameOf(run.method)), element("td", at));
    if (run.status !== "complete") {
        const reason = run.reason.split("\n")[0];
        const cell = run.left_out ? element("td.words", reason) : element("td.words", element("span.failed", run.status), ": " + reason);
        cell.colSpan = COLUMNS.length - 2;
        row.append(cell);
        return row;
    }
    for (const x of [...run.error, run.h, run.hdot, run.drift]) row.append(element("td", short(x)));
    for (const x of [run.steps, run.rejected, run.rhs, run.newton, run.jacobians, run.factorizations, run.exchanges]) row.append(element("td", count(x)));
    row.append(element("td", three(1e3 * run.cpu)), element("td", three(1e3 * run.ready)), element("td", isNumber(run.memory) ? three(run.memory / 1024) : "\u2013"));
    return row;
}

function tellRuns() {
    const table = byId("runs").querySelector("table");
    table.append(headRow(COLUMNS));
    table.append(...data.runs.map(runRow).filter((row) => row));
    byId("runs").hidden = data.runs.length === 0;
}

/* -- the whole page ----------------------------------------------------------------------------------------- */

function recolour() {
    for (const mark of document.querySelectorAll("[data-method]")) mark.style.background = colourOf(Number(mark.dataset.method));
    drawPlots();
    if (stage) stage.recolour();
}

let stage = null;

function begin() {
    tellScene();
    tellAnswer();
    tellOthers();
    tellReference();
    tellTable("same", data.same);
    tellTable("bests", data.bests);
    tellLevels();
    tellFailures();
    tellRuns();
    beginPlots();
    stage = beginStage(data.picture, {
        span: () => [0, data.picture.frames.t_end],
        seconds: () => PLAY_SECONDS,
        note: stageNote,
        clock: (t) => clockOf(t, data.picture.frames.t_end),
        shown: showCursor,
    });
    tellReady(recolour);
}

begin();
