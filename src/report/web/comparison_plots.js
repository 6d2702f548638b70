/* SPDX-License-Identifier: BSD-3-Clause */
/* Plots of a comparison: work-precision diagram, and the runs shown in detail. */
"use strict";

const QUANTITIES = ["q", "qd", "\u03bb"];
const hiddenMethods = new Set();
let quantity = 0;

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
        const runs = data.runs.filter((run) => run.method === w && run.status === "complete" && run.error[quantity] > 0);
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
    const range = rangeOf(data.runs.filter((run) => run.status === "complete").map(work), 1.5) || [1, 10];
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

/* -- runs in detail ----------------------------------------------------------------------------------------- */

const recordName = (shown) => runName(data.runs[shown.run]);
const recordColour = (shown) => colourOf(data.runs[shown.run].method);

function drawHistories() {
    byId("shown").replaceChildren(...data.shown.map((shown, k) => {
        const run = data.runs[shown.run];
        return legendEntry(run.method, runName(run), hiddenRuns.has(k), () => turn(hiddenRuns, k));
    }));
    drawRecords([0, data.t_end]);
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
    showLog((shown) => [swatch(data.runs[shown.run].method), recordName(shown)]);
    drawPlots();
}
