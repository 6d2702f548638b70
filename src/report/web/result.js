/* SPDX-License-Identifier: BSD-3-Clause */
/* The page of a result: words, curves of its columns, the animation at the same place, the model. */
"use strict";

const GROUPS = { q: "coordinates", qd: "rates", qdd: "accelerations", lambda: "multipliers", position: "positions", velocity: "velocities", acceleration: "accelerations of points", reaction: "reactions", moment: "moments of reactions", force: "forces", energy: "energies", sensor: "sensors", contact: "contacts", input: "inputs", tau: "actuators", power: "powers" };
const MOST_AT_ONCE = 24;
const series = data.series, columns = series ? series.columns.map(readColumn) : [];
const abscissa = series ? columns.find((column) => column.name === series.x) : null;
const chosen = new Set(series ? series.first.filter((name) => columns.some((column) => column.name === name)) : []);
const tied = abscissa !== null && !series.scattered && data.picture !== null && data.picture.frames.count > 1; /* to the animation */
let colours = new Map(); /* of the columns that are drawn */
let over = abscissa, range = abscissa ? wholeRange() : [0, 0], seconds = PLAY_SECONDS;

/* -- columns ------------------------------------------------------------------------------------------------ */

/* Values between the rows of a column that has fewer of them are on straight lines. */
function readColumn(column) {
    const given = floatsOf(column.values), last = series.drawn - 1;
    if (column.every === 1) return { ...column, values: given };
    const values = Float32Array.from({ length: series.drawn }, (_, k) => {
        const at = Math.floor(k / column.every), begin = at * column.every, end = Math.min(begin + column.every, last);
        return k === begin ? given[at] : given[at] + ((given[at + 1] - given[at]) * (k - begin)) / (end - begin);
    });
    return { ...column, values };
}

/* A run that ends where it begins has a range, too. */
function wholeRange() {
    const ends = series.scattered ? [abscissa.summary[0], abscissa.summary[2]] : [abscissa.values[0], abscissa.values[abscissa.values.length - 1]];
    const [low, high] = ends.map(Number).sort((a, b) => a - b);
    return high - low > 1e-12 * Math.max(Math.abs(low), 1e-9) ? [low, high] : [low, low + 1];
}

const groupOf = ({ name }) => (/\.(amplitude|phase)$/.test(name) ? name.split(".").pop() + "s" : GROUPS[name.split(".")[0]] || "others");
const drawn = () => columns.filter((column) => chosen.has(column.name));
const withUnit = (column) => (column.unit ? `${column.name}, ${column.unit}` : column.name);

/* The value of a column at a place of the abscissa, between two rows. */
function valueAt(column, x) {
    const [low, high, part] = placeIn(abscissa.values, x);
    return part === 0 ? column.values[low] : part === 1 ? column.values[high] : (1 - part) * column.values[low] + part * column.values[high];
}

/* -- words -------------------------------------------------------------------------------------------------- */

function tellResult() {
    const marks = {"complete": "em", "complete, not checked": "em.unchecked", "stopped": "em.stopped"};
    const marked = data.stopped_at.length > 0 ? `Marked in the picture: ${data.stopped_at.join(", ")}` : "";
    const sentences = [marked, data.warnings, data.sentences].flatMap((text) => text.split("\n")).filter((line) => line);
    tellHead("Result", [element(marks[data.status] || "em.failed", data.answer)], data.facts, sentences);
    byId("text").textContent = data.text;
    byId("printed").hidden = !data.text;
    byId("printed").open = !series;
}

function tellModel() {
    const table = byId("parameters");
    byId("given").hidden = data.parameters.length + data.inputs.length === 0;
    table.append(headRow(["parameter", "value, SI", "given as"]));
    for (const p of data.parameters) table.append(rowOf(p.name, digits(p.value), element("td.words", p.expression)));
    for (const input of data.inputs) table.append(rowOf(input.name, digits(input.value), element("td.words", `input${input.unit ? `, ${input.unit}` : ""}${input.samples > 1 ? `, ${input.samples} samples` : ""}`)));
    for (const file of data.files) {
        const more = file.cut ? "\n.. and more" : "";
        byId("files").append(element("details", element("summary", file.name), element("div.scroll", element("pre", file.text + more))));
    }
}

/* -- choice of curves --------------------------------------------------------------------------------------- */

function toggle(name, on) {
    if (on) chosen.add(name);
    else chosen.delete(name);
    drawCurves();
}

function choiceOf(column) {
    const box = element("input"), label = element("label");
    box.type = "checkbox";
    box.checked = chosen.has(column.name);
    box.dataset.column = column.name;
    box.addEventListener("change", () => toggle(column.name, box.checked));
    label.append(box, " ", withUnit(column));
    return label;
}

/* The columns whose names contain the words that are looked for, by groups. */
function listChoices() {
    const words = byId("find").value.toLowerCase().split(/\s+/).filter((word) => word), groups = new Map();
    for (const column of columns) {
        if (column === abscissa || !words.every((word) => column.name.toLowerCase().includes(word))) continue;
        const group = groupOf(column);
        groups.set(group, [...(groups.get(group) || []), column]);
    }
    byId("groups").replaceChildren(...[...groups].map(([name, members]) => element("div", element("h3", name), ...members.map(choiceOf))));
}

function beginChoice() {
    const list = byId("across");
    byId("find").addEventListener("input", listChoices);
    byId("choice").addEventListener("toggle", listChoices);
    for (const { name } of [abscissa, ...columns.filter((c) => c !== abscissa)]) list.append(optionOf(name, name));
    list.addEventListener("change", () => {
        over = columns.find((column) => column.name === list.value);
        drawCurves();
    });
    byId("whole").addEventListener("click", () => zoom(wholeRange()));
}

/* -- curves ------------------------------------------------------------------------------------------------- */

function zoom([low, high]) {
    const [first, last] = wholeRange();
    range = [Math.max(low, first), Math.min(high, last)];
    if (!(range[1] > range[0])) range = wholeRange();
    drawAll();
    if (stage && tied) stage.restart();
}

/* A figure for each unit, with the curves that have it and their points; residuals have figures of their own below. */
function figuresOf(list) {
    const figures = [];
    for (const column of list) {
        const apart = column.look === "residuals", of = figures.find((figure) => figure.unit === column.unit && figure.apart === apart);
        if (of) of.members.push(column);
        else figures.push({ unit: column.unit, apart, members: [column] });
    }
    return figures;
}

/* Points have the colour of their curve where it is drawn. */
function colourAll(list) {
    const drawn = new Set(list.map((column) => column.name)), ofCurve = (column) => (column.look && drawn.has(column.of) ? column.of : column.name);
    const names = [...new Set(list.map(ofCurve))];
    colours = new Map(list.map((column) => [column.name, curveColour(names.indexOf(ofCurve(column)))]));
}

function pointsOf(column) {
    const points = [];
    column.values.forEach((y, k) => {
        const x = over.values[k], inside = over === abscissa || (abscissa.values[k] >= range[0] && abscissa.values[k] <= range[1]);
        if (inside) points.push({ x: Number(x), y: isFinite(y) && isFinite(x) ? Number(y) : null, row: k });
    });
    return points;
}

/* A diagram: the line that ends at a row is none (0), solid (1) or dashed (2). */
function joinedSet(column, colour) {
    const points = pointsOf(column), joinTo = (part) => series.joins[points[part.p1DataIndex].row];
    const segment = { borderDash: (part) => (joinTo(part) === 2 ? [6, 4] : undefined), borderColor: (part) => (joinTo(part) === 0 ? "transparent" : undefined) };
    return curveOf(points, colour, { column, segment, clip: 4, pointRadius: 1.5, pointHitRadius: 4 });
}

function curveSet(column) {
    const colour = colours.get(column.name);
    if (series.joins) return joinedSet(column, colour);
    if (series.scattered || column.look) return curveOf(pointsOf(column), colour, { column, showLine: false, clip: 4, pointRadius: 2.5, pointHitRadius: 4 });
    const begin = over !== abscissa; /* is marked; Chart.js asks for the marks of all points then */
    return curveOf(pointsOf(column), colour, { column, pointRadius: begin ? ({ dataIndex }) => (dataIndex === 0 ? 3.5 : 0) : 0 });
}

/* The events between steps, at the foot of a plot. */
function eventSet() {
    const log = data.shown.flatMap((shown) => shown.log);
    return curveOf(log.map((entry) => ({ x: entry.t, y: 0.03, entry })), inkColour(), { yAxisID: "marks", showLine: false, pointStyle: log.map((entry) => markStyle(entry.kind)), pointRadius: 4.5, backgroundColor: softColour(), pointBorderWidth: 1.2 });
}

/* Even, or logarithmic where the abscissa is and values extend over decades. */
function upAxis(list, unit) {
    const values = series.logarithmic ? list.flatMap((column) => Array.from(column.values)).filter((y) => isFinite(y)) : [];
    const positive = rangeOf(values, 1.3);
    if (positive && values.every((y) => y >= 0) && positive[1] > 100 * positive[0]) return logAxis(Math.max(positive[0], 1e-10 * positive[1]), positive[1], unit);
    return axisOf("linear", unit, { maxTicksLimit: 7, callback: (y) => digits(Number(y.toPrecision(8))) }, boundsOf(list));
}

/* Rates grow without bound where a run stops: its last hundredth does not count for the axis, which ends at round numbers. */
function boundsOf(list) {
    if (!data.locked || data.shown.length === 0) return {};
    const values = list.flatMap((column) => Array.from(column.values.slice(0, -Math.max(2, Math.round(column.values.length / 100))))).filter((y) => isFinite(y));
    const [low, high] = values.reduce(([a, b], y) => [Math.min(a, y), Math.max(b, y)], [Infinity, -Infinity]);
    if (!(high > low)) return {};
    const raw = (high - low) / 5, power = 10 ** Math.floor(Math.log10(raw)), each = power * [1, 2, 5, 10].find((part) => part * power >= 0.999 * raw);
    return { min: each * Math.floor(low / each), max: each * Math.ceil(high / each) };
}

function acrossAxis() {
    if (over !== abscissa) return axisOf("linear", withUnit(over), { maxTicksLimit: 8, maxRotation: 0 }, {});
    return series.logarithmic ? logAxis(range[0], range[1], withUnit(abscissa)) : evenAxis(range, abscissa.unit);
}

function labelOf(item) {
    const { entry } = item.raw, column = item.dataset.column;
    if (entry) return [`${entry.kind} at ${three(entry.t)} s`, entry.text];
    return [`${column.name} ${digits(item.raw.y)} ${column.unit}`, `at ${over.name} ${digits(item.raw.x)} ${over.unit}`];
}

function captionOf(list) {
    const caption = element("figcaption");
    for (const column of list) {
        const name = element(column.look ? "span.curve.points" : "span.curve", column.name);
        name.style.color = colours.get(column.name);
        caption.append(name, " ");
    }
    if (list[0].unit) caption.append(element("small", list[0].unit));
    return caption;
}

function drawFigure({ unit, apart, members: list }, number) {
    const canvas = byId(`plot-${number}`);
    canvas.closest("figure").querySelector("figcaption").replaceWith(captionOf(list));
    canvas.closest("figure").classList.toggle("apart", apart);
    const sets = list.map(curveSet), scales = { x: acrossAxis(), y: upAxis(list, unit) };
    if (over === abscissa && data.shown.some((shown) => shown.log.length > 0)) {
        sets.push(eventSet());
        scales.marks = { type: "linear", axis: "y", display: false, min: 0, max: 1 };
    }
    drawPlot(canvas.id, sets, scales, labelOf);
}

/* As many figures as there are units; those that are there stay. */
function makeFigures(count) {
    const place = byId("figures");
    while (place.children.length > count) {
        const id = place.lastChild.querySelector("canvas").id;
        plots[id].destroy();
        delete plots[id];
        place.lastChild.remove();
    }
    while (place.children.length < count) {
        const canvas = element("canvas"), number = place.children.length;
        canvas.id = `plot-${number}`;
        place.append(element("figure.card", element("figcaption"), element("div.plot", canvas, element("i"))));
        listenToRange(canvas, () => plots[canvas.id], (low, high) => over === abscissa && zoom([low, high]), (x) => tied && over === abscissa && stage.seek(x));
    }
}

function drawCurves() {
    const list = drawn().slice(0, MOST_AT_ONCE), figures = figuresOf(list), inFigures = figures.flatMap((figure) => figure.members);
    colourAll(inFigures);
    byId("choice").querySelector("summary").textContent = `Outputs: ${list.length} of ${columns.length - 1} are drawn; choose others`;
    byId("whole").disabled = range.every((x, k) => x === wholeRange()[k]);
    makeFigures(figures.length);
    figures.forEach(drawFigure);
    tellExtremes(inFigures);
}

/* -- values ------------------------------------------------------------------------------------------------- */

function tellExtremes(list) {
    const x = withUnit(abscissa), table = byId("extremes");
    table.replaceChildren(headRow(["output", tied ? "now" : "", "minimum", `at ${x}`, "maximum", `at ${x}`, "mean", "RMS"]));
    for (const column of list) {
        const now = element("td");
        now.dataset.column = column.name;
        table.append(rowOf(element("td", swatchOf(colours.get(column.name)), withUnit(column)), now, ...column.summary.map((value) => digits(value))));
    }
    table.parentElement.hidden = list.length === 0;
}

function tellValues(x) {
    for (const cell of document.querySelectorAll("#extremes [data-column]"))
        cell.textContent = digits(valueAt(columns.find((column) => column.name === cell.dataset.column), x));
}

function showPlace(x) {
    if (!tied) return;
    if (over === abscissa) showCursor(x);
    tellValues(x);
}

/* -- time --------------------------------------------------------------------------------------------------- */

function beginSpeeds() {
    const list = element("select"), slower = [["in 10 s", 0], ["real time", 1], ["1/10", 10], ["1/100", 100], ["1/1000", 1000]];
    list.setAttribute("aria-label", "Speed of the animation");
    byId("clock").after(list);
    list.hidden = !abscissa || abscissa.unit !== "s";
    list.append(...slower.map(([words, factor]) => optionOf(words, factor)));
    list.addEventListener("change", () => (seconds = Number(list.value)));
}

function spanOf() {
    const { t_start: first, t_end: last } = data.picture.frames;
    if (!tied) return [first, last];
    const span = [Math.max(first, range[0]), Math.min(last, range[1])];
    return span[1] > span[0] ? span : [first, last];
}

function resultNote({ frames }) {
    const part = tied && spanOf()[1] - spanOf()[0] < 0.999 * (frames.t_end - frames.t_start);
    return part ? "The animation shows the range of the curves." : "";
}

/* -- the whole page ----------------------------------------------------------------------------------------- */

const recordName = () => "";
const recordColour = () => curveColour(0);

function drawAll() {
    if (series) drawCurves();
    drawRecords(range);
    drawVehicle();
}

function tellCurves() {
    const notes = [];
    byId("curves").hidden = !series;
    if (!series) return;
    byId("curves-title").append(abscissa.name === "t" ? "Time histories" : series.scattered ? `Values over ${abscissa.name}` : `Curves over ${abscissa.name}`);
    byId("curves-note").append("Drag across a plot to enlarge a range" + (tied ? ", click for the position of the mechanism." : ".") + (series.joins ? " Solid lines are stable, dashed ones unstable." : ""));
    if (series.stride > 1) notes.push(`Every ${series.stride}th of ${series.rows} rows is drawn; the extreme values are those of all rows.`);
    if (data.locked) notes.push("The last row, where the run stopped, is no part of the extreme values.");
    if (series.left_out > 0) notes.push(`${series.left_out} outputs of the model are left out for the size of the page.`);
    byId("series-note").append(notes.join(" "));
    beginChoice();
}

function begin() {
    tellResult();
    tellModel();
    tellContacts();
    tellQuantities();
    tellReactions();
    tellVehicle();
    beginSpeeds();
    tellCurves();
    beginRecords("Accuracy over time", "The run, repeated with monitoring.", () => [""]);
    for (const id of ["over-h", "over-hdot", "over-energy", "over-step"]) listenToRange(byId(id), () => plots[id], (low, high) => zoom([low, high]), (x) => stage && stage.seek(x));
    drawPage(drawAll, data.picture, {
        span: spanOf,
        seconds: () => (seconds > 0 && seconds !== PLAY_SECONDS ? seconds * (spanOf()[1] - spanOf()[0]) : PLAY_SECONDS),
        note: resultNote,
        clock: (t) => (data.separate ? `${Math.round(t) + 1} of ${data.picture.frames.count}` : tied ? clockOf(spanOf()[0] + t, spanOf()[1], abscissa.unit) : ""),
        shown: (t) => showPlace(spanOf()[0] + t),
    });
}

begin();
