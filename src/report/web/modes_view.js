/* SPDX-License-Identifier: BSD-3-Clause */
/* The page of modes: their list, the mechanism moving along the one that is chosen, where eigenvalues are and went. */
"use strict";

const TAU = 2 * Math.PI;
const first = data.modes.findIndex((mode) => mode.frames >= 0 && !mode.zero);
let chosen = first >= 0 ? first : data.modes.findIndex((mode) => mode.frames >= 0), stage = null;

/* -- words -------------------------------------------------------------------------------------------------- */

const swings = (mode) => mode.im > 0;
const digits = (x) => (isNumber(x) ? String(Number(x.toPrecision(5))) : "\u2013");

const share = (x) => x.toFixed(3).replace(/^-(0\.0+)$/, "$1");

function eigenvalue(mode) {
    if (mode.zero) return "0";
    return digits(mode.re) + (swings(mode) ? ` \u00b1 ${digits(mode.im)} i` : "");
}

/* The number that varies: a value as the page shows it, and the words of one. */
const shownValue = (value) => data.locus.factor * value;
const namedValue = (value) => `${data.locus.name} = ${digits(shownValue(value))} ${data.locus.unit}`.trim();

function title(mode) {
    if (mode.zero) return "zero eigenvalue";
    if (swings(mode)) return `${digits(mode.frequency)} Hz`;
    return mode.re > 0 ? "grows" : "decays";
}

function tellVerdict() {
    byId("model").append(data.model);
    byId("scene").append(`at ${data.at} \u00b7 ${data.dof} degree${data.dof === 1 ? "" : "s"} of freedom`);
    byId("answer").append(element("em", data.stability));
    const sentences = [data.reasons.replace(/^[a-z]+: /, "")];
    for (const c of data.locus ? data.locus.critical : []) sentences.push(`${namedValue(c.value)}: a mode ${c.im > 0 ? `of ${digits(c.im / TAU)} Hz ` : ""}grows ${c.grows} it`);
    if (data.reason) sentences.push(data.reason);
    fillList(byId("because"), sentences);
}

/* -- the list ----------------------------------------------------------------------------------------------- */

function tellModes() {
    const table = byId("modes");
    table.append(headRow(["", "frequency", "damping", "eigenvalue, 1/s", "participation"]));
    data.modes.forEach((mode, k) => {
        const button = element("button", String(k + 1)), row = element(mode.re > 0 ? "tr.grows" : "tr");
        button.type = "button";
        button.dataset.mode = k;
        button.disabled = mode.frames < 0;
        button.setAttribute("aria-label", `Show mode ${k + 1}`);
        row.append(element("td", button), element("td", title(mode)), element("td", swings(mode) ? digits(mode.damping) : "\u2013"), element("td", eigenvalue(mode)), element("td.words", mode.moves));
        if (mode.frames >= 0) row.addEventListener("click", () => choose(k));
        table.append(row);
    });
}

function choose(k) {
    chosen = k;
    tellChosen();
    if (stage) stage.restart();
    drawPlots();
}

function tellChosen() {
    for (const button of document.querySelectorAll("#modes button")) {
        const is = Number(button.dataset.mode) === chosen;
        button.setAttribute("aria-pressed", String(is));
        button.closest("tr").classList.toggle("advised", is);
    }
    const table = byId("coordinates");
    byId("shape").hidden = chosen < 0;
    if (chosen < 0) return;
    const mode = data.modes[chosen];
    table.replaceChildren(headRow(["coordinate", "amplitude", "phase, deg", "kinetic energy", "elastic energy"]));
    data.coordinates.forEach(({ name, unit, factor }, i) => {
        const [re, im] = [mode.shape_re[i], mode.shape_im[i]], size = Math.hypot(re, im);
        const still = size < 1e-9; /* rounding */
        const phase = !still ? digits((360 / TAU) * Math.atan2(im, re)) : "\u2013";
        table.append(element("tr", element("td", name), element("td", still ? "0" : `${three(factor * size)} ${unit}`), element("td", phase), element("td", share(mode.kinetic[i])), element("td", share(mode.potential[i]))));
    });
}

/* -- the picture -------------------------------------------------------------------------------------------- */

/* The duration of a period, limited to a visible range. */
function periodOf(mode) {
    return swings(mode) ? Math.min(Math.max(1 / mode.frequency, 1), 3) : 3;
}

function stageWords() {
    const mode = data.modes[chosen], notes = [`Mode ${chosen + 1}: ${title(mode)}, magnified ${three(data.modes[chosen].amplitude)} times.`];
    const factor = swings(mode) ? periodOf(mode) * mode.frequency : 1;
    if (factor > 1.01) notes.push(`Slowed down ${three(factor)} times.`);
    if (factor < 0.99) notes.push(`Speeded up ${three(1 / factor)} times.`);
    if (data.picture.bodies.length - 1 < data.picture.of_bodies) notes.push(`${data.picture.bodies.length - 1} of ${data.picture.of_bodies} bodies are drawn.`);
    return notes.join(" ");
}

function beginPicture() {
    byId("view").setAttribute("aria-label", "Animation of a mode");
    byId("time").setAttribute("aria-label", "Phase of the period");
    if (!data.picture || chosen < 0) return beginStage(null);
    data.picture.pathless = true;
    return beginStage(data.picture, {
        span: () => [data.modes[chosen].frames, data.modes[chosen].frames + data.frames - 1],
        seconds: () => periodOf(data.modes[chosen]),
        note: stageWords,
        clock: (t) => `${Math.round((360 * t) / (data.frames - 1))}\u00b0`,
        shown: () => {},
    });
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
const isDrawn = (re, im) => !data.locus || !isNumber(data.locus.highest) || Math.hypot(re, im) <= data.locus.highest;

/* A curve for each eigenvalue; `point` gives its drawn value, null for none. */
function branches(point) {
    const locus = data.locus;
    if (!locus) return [];
    return locus.re[0].map((first, b) => ({
        data: locus.values.map((value, k) => (isDrawn(locus.re[k][b], locus.im[k][b]) ? point(value, locus.re[k][b], Math.abs(locus.im[k][b]), b) : null)).filter((p) => p),
        borderColor: curveColour(b >> 1),
        backgroundColor: curveColour(b >> 1),
        borderWidth: 2,
        pointRadius: (item) => (item.dataIndex === 0 ? 3.5 : 0),
        pointHitRadius: 6,
    })).filter((set) => set.data.length > 0);
}

const marks = (points) => ({ data: points, showLine: false, pointStyle: "crossRot", pointRadius: 7, pointBorderWidth: 2.5, borderColor: inkColour(), backgroundColor: inkColour() });

/* The modes of the list; the chosen one larger. */
function dots(point) {
    return {
        data: data.modes.map((mode, k) => (isDrawn(mode.re, mode.im) ? { ...point(mode, k), mode: k } : { x: NaN, y: NaN, mode: k })),
        showLine: false,
        pointStyle: "circle",
        pointRadius: data.modes.map((mode, k) => (k === chosen ? 8 : 4.5)),
        pointBorderWidth: 2,
        borderColor: inkColour(),
        backgroundColor: data.modes.map((mode) => (mode.re > 0 ? "#c0392b" : softColour())),
    };
}

function words(item) {
    const raw = item.raw;
    if (isNumber(raw.mode)) return `mode ${raw.mode + 1}: ${title(data.modes[raw.mode])}, ${eigenvalue(data.modes[raw.mode])}`;
    return raw.words || "";
}

function drawCampbell() {
    const locus = data.locus, top = Math.max(0, ...locus.im.flatMap((row, k) => row.filter((im, b) => isDrawn(locus.re[k][b], im)).map(Math.abs))) / TAU;
    const sets = branches((value, re, im) => (im > 0 ? { x: shownValue(value), y: im / TAU, words: `${namedValue(value)}: ${digits(im / TAU)} Hz, ${digits(re)} 1/s` } : null));
    sets.push(marks(locus.critical.map((c) => ({ x: shownValue(c.value), y: c.im / TAU, words: `critical: ${namedValue(c.value)}, ${digits(c.im / TAU)} Hz` }))));
    for (const order of locus.orders) {
        const ends = [Math.min(...locus.values), Math.max(...locus.values)].map((v) => Math.min(Math.max(v, 0), (top * TAU) / order));
        sets.push({ data: ends.map((v) => ({ x: shownValue(v), y: (order * v) / TAU, words: `order ${digits(order)}` })), borderColor: softColour(), borderDash: [7, 4], borderWidth: 1.5, pointRadius: 0, pointHitRadius: 6 });
    }
    plot("campbell", sets, locus.unit ? `${locus.name}, ${locus.unit}` : locus.name, "frequency, Hz", words);
}

/* Without a varied parameter: damping over frequency. */
function drawDamping() {
    const shown = data.modes.map((mode, k) => ({ mode, k })).filter((m) => swings(m.mode));
    const set = dots((mode) => ({ x: mode.frequency, y: mode.damping }));
    set.data = set.data.filter((p, k) => swings(data.modes[k]));
    set.pointRadius = shown.map((m) => (m.k === chosen ? 8 : 4.5));
    set.backgroundColor = softColour();
    plot("campbell", [set], "frequency, Hz", "damping ratio", words);
}

function drawPlots() {
    const locus = data.locus;
    const sets = branches((value, re, im) => ({ x: re, y: im, words: `${namedValue(value)}: ${digits(re)} \u00b1 ${digits(im)} i` }));
    if (locus) sets.push(marks(locus.critical.map((c) => ({ x: c.re, y: c.im, words: `critical: ${namedValue(c.value)}` }))));
    sets.push(dots((mode) => ({ x: mode.re, y: mode.im })));
    plot("plane", sets, leftOf(sets).min ? "real part, 1/s (some values are outside to the left)" : "real part, 1/s", "imaginary part, rad/s", words);
    if (locus) drawCampbell();
    else drawDamping();
}

function beginPlots() {
    const locus = data.locus;
    Chart.defaults.font.family = getComputedStyle(document.body).fontFamily;
    byId("plots-title").append(locus ? `Sweep of ${locus.name}` : "Eigenvalues and damping");
    byId("plots-note").append(locus ? `${locus.name} from ${digits(shownValue(locus.values[0]))} (dots on the curves) to ${`${digits(shownValue(locus.values[locus.values.length - 1]))} ${locus.unit}`.trim()}; larger dots: modes of the list; crosses: critical values.` : "Modes with a positive real part grow. The larger dot is the chosen mode.");
    byId("right-title").append(locus ? "Frequencies" + (locus.orders.length > 0 ? " and order lines" : "") : "Damping and frequency");
    drawPlots();
}

/* -- the whole page ----------------------------------------------------------------------------------------- */

function begin() {
    tellVerdict();
    tellModes();
    beginPlots();
    tellChosen();
    stage = beginPicture();
    tellReady(() => {
        drawPlots();
        if (stage) stage.recolour();
    });
}

begin();
