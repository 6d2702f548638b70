/* SPDX-License-Identifier: BSD-3-Clause */
/* The page of modes: their list, the mechanism moving along the one that is chosen, where eigenvalues are and went. */
"use strict";

const TAU = 2 * Math.PI;
const locus = data.locus && data.locus.values.length > 0 ? data.locus : null;
const modes = data.modes.map((mode, k) => ({ ...mode, re: mode.eigenvalue[0], im: mode.eigenvalue[1], zero: mode.index < data.zeros, ...data.moving[k] }));
const first = modes.findIndex((mode) => mode.frames >= 0 && !mode.zero);
let chosen = first >= 0 ? first : modes.findIndex((mode) => mode.frames >= 0);

/* -- words -------------------------------------------------------------------------------------------------- */

const swings = (mode) => mode.im > 0;
const share = (x) => x.toFixed(3).replace(/^-(0\.0+)$/, "$1");

function eigenvalue(mode) {
    if (mode.zero) return "0";
    return digits(mode.re, 5) + (swings(mode) ? ` \u00b1 ${digits(mode.im, 5)} i` : "");
}

/* The number that varies: a value as the page shows it, and the words of one. */
const shownValue = (value) => data.sweep.factor * value;
const valueWords = (value) => `${digits(shownValue(value), 5)} ${data.sweep.unit}`.trim();
const namedValue = (value) => `${locus.name} = ${valueWords(value)}`;

function title(mode) {
    if (mode.zero) return "zero eigenvalue";
    if (swings(mode)) return `${digits(mode.frequency, 5)} Hz`;
    return mode.re > 0 ? "grows" : "decays";
}

function writeVerdict() {
    const sentences = (locus ? locus.critical : []).map(({ value, eigenvalue: [, im], grows }) => `${namedValue(value)}: a mode ${im > 0 ? `of ${digits(im / TAU, 5)} Hz ` : ""}grows ${grows} it`);
    writeHead([`${sentence(data.status)}: ${data.stability}`], [], [...data.warnings.split("\n"), data.reasons.replace(/^[a-z]+: /, ""), ...sentences]);
}

/* -- the list ----------------------------------------------------------------------------------------------- */

function writeModes() {
    const table = byId("modes");
    table.append(headRow(["", "frequency", "damping", "eigenvalue, 1/s", "participation"]));
    modes.forEach((mode, k) => {
        const button = buttonOf(String(k + 1), false, () => {}), row = element(mode.re > 0 ? "tr.grows" : "tr");
        button.dataset.mode = k;
        button.disabled = mode.frames < 0;
        button.setAttribute("aria-label", `Show mode ${k + 1}`);
        row.append(element("td", button), ...[title(mode), swings(mode) ? digits(mode.damping, 5) : "\u2013", eigenvalue(mode)].map((words) => element("td", words)), element("td.words", mode.moves));
        if (mode.frames >= 0) row.addEventListener("click", () => choose(k));
        table.append(row);
    });
}

function choose(k) {
    chosen = k;
    writeChosen();
    if (stage) stage.restart();
    drawPlots();
}

function writeChosen() {
    for (const button of document.querySelectorAll("#modes button")) {
        const is = Number(button.dataset.mode) === chosen;
        button.setAttribute("aria-pressed", String(is));
        button.closest("tr").classList.toggle("advised", is);
    }
    const table = byId("coordinates");
    byId("shape").hidden = chosen < 0;
    if (chosen < 0) return;
    const { shape, kinetic, potential } = modes[chosen];
    table.replaceChildren(headRow(["coordinate", "amplitude", "phase, deg", "kinetic energy", "elastic energy"]));
    for (const { name, unit, factor } of data.coordinates) {
        const [re, im] = shape[name], size = Math.hypot(re, im), still = size < 1e-9; /* rounding */
        const angle = (360 / TAU) * Math.atan2(im, re), phase = still ? "\u2013" : digits(Math.abs(angle) < 1e-9 ? 0 : angle, 5);
        table.append(rowOf(name, still ? "0" : `${three(factor * size)} ${unit}`, phase, share(kinetic[name]), share(potential[name])));
    }
}

/* -- the picture -------------------------------------------------------------------------------------------- */

/* The duration of a period, limited to a visible range. */
function periodOf(mode) {
    return swings(mode) ? Math.min(Math.max(1 / mode.frequency, 1), 3) : 3;
}

function stageWords() {
    const mode = modes[chosen], notes = [`Mode ${chosen + 1}: ${title(mode)}, magnified ${three(mode.amplitude)} times.`];
    const factor = swings(mode) ? periodOf(mode) * mode.frequency : 1;
    if (factor > 1.01) notes.push(`Slowed down ${three(factor)} times.`);
    if (factor < 0.99) notes.push(`Speeded up ${three(1 / factor)} times.`);
    return notes.join(" ");
}

/* -- plots -------------------------------------------------------------------------------------------------- */

/* Distant real eigenvalues are cut off, so that the others remain visible. */
function leftOf(datasets) {
    const points = datasets.flatMap((set) => set.data), top = Math.max(0, ...points.map((p) => p.y || 0));
    const far = Math.min(-3 * top, ...points.filter((p) => p.y > 0).map((p) => p.x));
    return top > 0 && points.some((p) => p.x < far) ? { min: far } : {};
}

function plot(id, datasets, across, up, label) {
    const axis = (name, more) => axisOf("linear", name, { maxTicksLimit: 8, maxRotation: 0 }, more);
    drawPlot(id, datasets, { x: axis(across, id === "plane" ? leftOf(datasets) : {}), y: axis(up, { min: 0 }) }, label);
}

/* The eigenvalue is not above the highest frequency that was asked for. */
const isDrawn = (re, im) => !locus || !isNumber(data.sweep.highest) || Math.hypot(re, im) <= data.sweep.highest;

/* A curve for each eigenvalue; `point` gives its drawn value, null for none. */
function branches(point) {
    if (!locus) return [];
    const pointOf = (value, [re, im]) => (isDrawn(re, im) ? point(value, re, Math.abs(im)) : null);
    const sets = locus.eigenvalues[0].map((_, b) => locus.values.map((value, k) => pointOf(value, locus.eigenvalues[k][b])).filter((p) => p));
    return sets.map((points, b) => curveOf(points, curveColour(b >> 1), { borderWidth: 2, pointRadius: (item) => (item.dataIndex === 0 ? 3.5 : 0) })).filter((set) => set.data.length > 0);
}

const crosses = (points) => curveOf(points, inkColour(), { showLine: false, pointStyle: "crossRot", pointRadius: 7, pointBorderWidth: 2.5 });

/* The modes of the list; the chosen one larger. */
function dots(point) {
    const points = modes.map((mode, k) => (isDrawn(mode.re, mode.im) ? { ...point(mode), mode: k } : { x: NaN, y: NaN, mode: k }));
    const pointRadius = modes.map((mode, k) => (k === chosen ? 8 : 4.5)), backgroundColor = modes.map((mode) => (mode.re > 0 ? styleOf("--bad") : softColour()));
    return curveOf(points, inkColour(), { showLine: false, pointRadius, pointBorderWidth: 2, backgroundColor });
}

function words(item) {
    const raw = item.raw;
    if (isNumber(raw.mode)) return `mode ${raw.mode + 1}: ${title(modes[raw.mode])}, ${eigenvalue(modes[raw.mode])}`;
    return raw.words || "";
}

function drawCampbell() {
    const top = Math.max(0, ...locus.eigenvalues.flat().filter(([re, im]) => isDrawn(re, im)).map(([, im]) => Math.abs(im))) / TAU;
    const sets = branches((value, re, im) => (im > 0 ? { x: shownValue(value), y: im / TAU, words: `${namedValue(value)}: ${digits(im / TAU, 5)} Hz, ${digits(re, 5)} 1/s` } : null));
    sets.push(crosses(locus.critical.map(({ value, frequency }) => ({ x: shownValue(value), y: frequency, words: `critical: ${namedValue(value)}, ${digits(frequency, 5)} Hz` }))));
    for (const order of data.sweep.orders) {
        const ends = [Math.min(...locus.values), Math.max(...locus.values)].map((v) => Math.min(Math.max(v, 0), (top * TAU) / order));
        sets.push(curveOf(ends.map((v) => ({ x: shownValue(v), y: (order * v) / TAU, words: `order ${digits(order, 5)}` })), softColour(), { borderDash: [7, 4] }));
    }
    plot("campbell", sets, data.sweep.unit ? `${locus.name}, ${data.sweep.unit}` : locus.name, "frequency, Hz", words);
}

/* Without a varied parameter: damping over frequency. */
function drawDamping() {
    const shown = modes.map((mode, k) => ({ mode, k })).filter((m) => swings(m.mode));
    const set = dots((mode) => ({ x: mode.frequency, y: mode.damping }));
    set.data = set.data.filter((p, k) => swings(modes[k]));
    set.pointRadius = shown.map((m) => (m.k === chosen ? 8 : 4.5));
    set.backgroundColor = softColour();
    plot("campbell", [set], "frequency, Hz", "damping ratio", words);
}

function drawPlots() {
    const sets = branches((value, re, im) => ({ x: re, y: im, words: `${namedValue(value)}: ${digits(re, 5)} \u00b1 ${digits(im, 5)} i` }));
    if (locus) sets.push(crosses(locus.critical.map(({ value, eigenvalue: [re, im] }) => ({ x: re, y: im, words: `critical: ${namedValue(value)}` }))));
    sets.push(dots((mode) => ({ x: mode.re, y: mode.im })));
    plot("plane", sets, leftOf(sets).min ? "real part, 1/s (some values are outside to the left)" : "real part, 1/s", "imaginary part, rad/s", words);
    if (locus) drawCampbell();
    else drawDamping();
}

function writePlots() {
    const orders = locus && data.sweep.orders.length > 0 ? " and order lines" : "";
    byId("plots-title").append(locus ? `Sweep of ${locus.name}` : "Eigenvalues and damping");
    byId("plots-note").append(locus ? `${locus.name} from ${digits(shownValue(locus.values[0]), 5)} (dots on the curves) to ${valueWords(locus.values[locus.values.length - 1])}; larger dots: modes of the list; crosses: critical values.` : "Modes with a positive real part grow. The larger dot is the chosen mode.");
    byId("right-title").append(locus ? `Frequencies${orders}` : "Damping and frequency");
}

/* -- the whole page ----------------------------------------------------------------------------------------- */

function begin() {
    writeVerdict();
    writeModes();
    writePlots();
    writeChosen();
    byId("view").setAttribute("aria-label", "Animation of a mode");
    byId("time").setAttribute("aria-label", "Phase of the period");
    drawPage(drawPlots, chosen < 0 || !data.picture ? null : { ...data.picture, pathless: true }, {
        span: () => [modes[chosen].frames, modes[chosen].frames + data.frames - 1],
        seconds: () => periodOf(modes[chosen]),
        note: stageWords,
        clock: (t) => `${Math.round((360 * t) / (data.frames - 1))}\u00b0`,
        shown: () => {},
    });
}

begin();
