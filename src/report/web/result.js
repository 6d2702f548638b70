/* SPDX-License-Identifier: BSD-3-Clause */
/* The page of a result: words, curves of its columns, the animation at the same place, the model. */
"use strict";

const GROUPS = { q: "coordinates", qd: "rates", qdd: "accelerations", lambda: "multipliers", position: "positions", velocity: "velocities", acceleration: "accelerations of points", reaction: "reactions", moment: "moments of reactions", force: "forces", energy: "energies", sensor: "sensors", contact: "contacts", input: "inputs", tau: "actuators", power: "powers" };
const MOST_AT_ONCE = 24;
const series = data.series, columns = series ? series.columns.map(readColumn) : [];
const abscissa = series ? columns.find((column) => column.name === series.x) : null;
const chosen = new Set(series ? series.first.filter((name) => columns.some((column) => column.name === name)) : []);
const tied = abscissa !== null && !series.scattered && data.picture !== null && data.picture.frames.count > 1; /* to the animation */
const bodyNumbers = new Map(data.picture ? data.picture.bodies.map(({ name }, b) => [name, b]) : []);
let looks = new Map(); /* { colour, dashes } of the columns that are drawn */
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

function writeResult() {
    const marked = data.stopped_at.length > 0 ? `Marked in the picture: ${data.stopped_at.join(", ")}` : "";
    writeHead([data.answer], data.facts, [marked, ...data.warnings.split("\n")]);
    byId("text").textContent = data.text;
    byId("printed").hidden = !data.text;
    byId("printed").open = !series;
    document.querySelector(".first").classList.toggle("alone", !series);
}

function writeModel() {
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

/* Angles that turn more than twice would flatten all others. */
const TWO_TURNS = { rad: 4 * Math.PI, deg: 720 };
const revolves = ({ name, unit, summary: [low, , high] }) => name.startsWith("q.") && high - low > TWO_TURNS[unit];

/* Requested outputs before all others, and rates behind. */
const rankOfColumn = ({ name }) => (series.first.includes(name) ? 0 : 2) + /^(qd|qdd|velocity|acceleration|angular_\w+)\./.test(name);

/* A figure for each unit, with the curves that have it and their points; residuals and angles that revolve have figures of
 * their own. */
function figuresOf(list) {
    const figures = [];
    for (const column of [...list].sort((a, b) => rankOfColumn(a) - rankOfColumn(b))) {
        const apart = column.look === "residuals", turns = revolves(column);
        const of = figures.find((figure) => figure.unit === column.unit && figure.apart === apart && figure.turns === turns);
        if (of) of.members.push(column);
        else figures.push({ unit: column.unit, apart, turns, members: [column] });
    }
    return figures;
}

/* Rounding of the largest value of a figure. */
const noiseOf = (members) => 1e-12 * Math.max(...members.flatMap(({ summary: [low, , high] }) => [Math.abs(low), Math.abs(high)]));
const clean = (x, noise) => (Math.abs(x) <= noise ? 0 : x);

/* A value all along, to the digits of texts or up to rounding for the largest value of the figure; null: there is none. */
function constantOf(column, members) {
    if (series.scattered || members.some(({ look }) => look)) return null;
    const ends = [column.summary[0], column.summary[2], column.values[column.values.length - 1]];
    const noise = noiseOf(members);
    if (!ends.every(isNumber) || Math.max(...ends) - Math.min(...ends) > Math.max(1e-6 * Math.max(...ends.map(Math.abs)), noise)) return null;
    return clean(ends[0], noise);
}

/* The body that a column belongs to, and has its colour from; undefined: none. */
function ownerOf({ name }) {
    const [word, ...rest] = name.split("."), ofPoint = /^(position|velocity|acceleration|angular_\w+|axes|section\w*)$/.test(word);
    const places = rest.map((_, k) => rest.slice(0, rest.length - k).join("."));
    return places.map((place) => (ofPoint ? bodyNumbers.get(place) : data.owners[place])).find((b) => b > 0);
}

/* Curves have the colours of their bodies, other curves of a figure colours that it does not have; dashes distinguish curves of one
 * colour apart. Points look as their curve where it is drawn. */
function chooseLooks(figures) {
    looks = new Map();
    for (const { members } of figures) {
        const times = new Map(), own = members.map(ownerOf), taken = new Set(own.filter((b) => b).map((b) => (b - 1) % COLOURS.length));
        members.forEach((column, k) => {
            if (looks.has(column.of)) return looks.set(column.name, looks.get(column.of));
            const free = own[k] ? own[k] - 1 : COLOURS.map((_, c) => (c + bodyNumbers.size - 1) % COLOURS.length).find((c) => !taken.has(c)), number = free ?? k, colour = number % COLOURS.length;
            const rank = Math.max(Math.floor(number / COLOURS.length), times.get(colour) || 0);
            taken.add(colour);
            times.set(colour, rank + 1);
            return looks.set(column.name, { colour: curveColour(colour), dashes: dashesOf(rank) });
        });
    }
}

const markOf = ({ name, look }) => (look || (series.scattered && !series.joins) ? swatchOf(looks.get(name).colour) : lineMark(looks.get(name).colour, looks.get(name).dashes));

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
    const { colour, dashes } = looks.get(column.name);
    if (series.joins) return joinedSet(column, colour);
    if (series.scattered || column.look) return curveOf(pointsOf(column), colour, { column, showLine: false, clip: 4, pointRadius: 2.5, pointHitRadius: 4 });
    const begin = over !== abscissa; /* is marked; Chart.js asks for the marks of all points then */
    return curveOf(pointsOf(column), colour, { column, borderDash: dashes, pointRadius: begin ? ({ dataIndex }) => (dataIndex === 0 ? 3.5 : 0) : 0 });
}

/* The curve of an earlier run behind that of a column: dotted, in the same colour. Over time alone. */
const earlier = series && series.earlier ? new Map(series.earlier.columns.map(({ name, values }) => [name, floatsOf(values)])) : null;

function earlierSet(column) {
    const values = earlier && over === abscissa ? earlier.get(column.name) : null, points = [];
    if (!values) return [];
    earlier.get("t").forEach((x, k, all) => {
        if ((all[k + 1] ?? x) >= range[0] && (all[k - 1] ?? x) <= range[1]) points.push({ x: Number(x), y: isFinite(values[k]) ? Number(values[k]) : null });
    });
    return [curveOf(points, looks.get(column.name).colour, { column: { ...column, name: `${column.name} of ${series.earlier.name}` }, borderDash: [1.5, 3], borderWidth: 2.4 })];
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
    for (const column of list) caption.append(element("span.curve", markOf(column), ...breakable(column.name)), " ");
    if (list[0].unit) caption.append(element("small", list[0].unit));
    return caption;
}

function drawFigure({ unit, apart, members: list }, number) {
    const canvas = byId(`plot-${number}`);
    canvas.closest("figure").querySelector("figcaption").replaceWith(captionOf(list));
    canvas.closest("figure").classList.toggle("apart", apart);
    const sets = [...list.map(curveSet), ...list.flatMap(earlierSet)], scales = { x: acrossAxis(), y: upAxis(list, unit) };
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
    const list = drawn().slice(0, MOST_AT_ONCE), all = figuresOf(list), constant = [];
    const figures = all.map((figure) => ({ ...figure, members: figure.members.filter((column) => {
        const value = constantOf(column, figure.members);
        if (value !== null) constant.push(`${column.name} = ${digits(value)} ${column.unit}`.trim());
        return value === null;
    }) })).filter(({ members }) => members.length > 0);
    chooseLooks(all);
    byId("constants").textContent = constant.length > 0 ? `Constant: ${constant.join(", ")}` : "";
    byId("choice").querySelector("summary").textContent = `Outputs: ${list.length} of ${columns.length - 1} are drawn; choose others`;
    byId("whole").disabled = range.every((x, k) => x === wholeRange()[k]);
    makeFigures(figures.length);
    figures.forEach(drawFigure);
    drawStrip();
    writeExtremes(all);
}

/* -- values ------------------------------------------------------------------------------------------------- */

const MOST_PEAKS = 12;

function moreNote(place, count) {
    place.querySelector(".note").textContent = count > 0 ? `${count} more are in the table below the curves.` : "";
}

/* The extreme values of the outputs that are drawn at first. */
function writePeaks() {
    const list = series ? figuresOf(drawn()).flatMap(({ members }) => members.map((column) => [column, constantOf(column, members), noiseOf(members)])) : [], place = byId("peaks"), table = place.querySelector("table");
    place.hidden = list.length === 0;
    if (list.length === 0) return;
    const x = withUnit(abscissa), at = x.length < 9 ? `at ${x}`.replace(/ /g, "\u00a0") : `at ${x}`;
    place.querySelector("h2").append(data.command === "simulate" ? "Requested outputs" : "Extreme values");
    table.append(headRow(["output", "minimum", at, "maximum", at]));
    for (const [column, value, noise] of list.slice(0, MOST_PEAKS)) {
        const [low, lowAt, high, highAt] = column.summary, name = element("td.words", ...breakable(withUnit(column)));
        if (value !== null) table.append(rowOf(name, digits(value), "", "constant", ""));
        else table.append(rowOf(name, digits(clean(low, noise)), digits(lowAt, 4), digits(clean(high, noise)), digits(highAt, 4)));
    }
    moreNote(place, list.length - MOST_PEAKS);
}

/* Parts of a name, between which a line may end. */
const breakable = (name) => name.split(/(?<=[._/(])/).flatMap((part) => [part, element("wbr")]);

function writeExtremes(figures) {
    const x = withUnit(abscissa), table = byId("extremes");
    table.replaceChildren(headRow(["output", tied ? "now" : "", "minimum", `at ${x}`, "maximum", `at ${x}`, "mean", "RMS"]));
    for (const { members } of figures)
        for (const column of members) {
            const now = element("td"), noise = noiseOf(members);
            Object.assign(now.dataset, { column: column.name, noise });
            table.append(rowOf(element("td.name", markOf(column), ...breakable(withUnit(column))), now, ...column.summary.map((value, k) => digits(k === 1 || k === 3 ? value : clean(value, noise)))));
        }
    table.parentElement.hidden = figures.length === 0;
}

function writeValues(x) {
    for (const cell of document.querySelectorAll("#extremes [data-column]"))
        cell.textContent = digits(clean(valueAt(columns.find((column) => column.name === cell.dataset.column), x), Number(cell.dataset.noise)));
}

function showPlace(x) {
    if (!tied) return;
    if (over === abscissa) showCursor(x);
    writeValues(x);
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
const recordLook = () => ({ borderColor: styleOf("--accent") });

function drawAll() {
    if (series) drawCurves();
    drawRecords(range);
    drawVehicle();
}

function writeCurves() {
    const notes = [];
    byId("curves").hidden = !series;
    if (!series) return;
    byId("curves-title").append(abscissa.name === "t" ? "Time histories" : series.scattered ? `Values over ${abscissa.name}` : `Curves over ${abscissa.name}`);
    byId("curves-note").append("Drag across a plot to enlarge a range" + (tied ? ", click for the position of the mechanism." : ".") + (series.joins ? " Solid lines are stable, dashed ones unstable." : "") + (earlier ? ` Dotted: ${series.earlier.name}, of the outputs that are drawn at first.` : ""));
    if (series.stride > 1) notes.push(`Every ${series.stride}th of ${series.rows} rows is drawn; the extreme values are those of all rows.`);
    if (data.locked) notes.push("The last row, where the run stopped, is no part of the extreme values.");
    if (series.left_out > 0) notes.push(`${series.left_out} outputs of the model are left out for the size of the page.`);
    byId("series-note").append(notes.join(" "));
    beginChoice();
    beginRange();
}

function begin() {
    writeResult();
    writePeaks();
    writeModel();
    writeContacts();
    writeQuantities();
    writeReactions();
    writeVehicle();
    beginSpeeds();
    writeCurves();
    beginRecords("Accuracy over time", "The run, repeated with monitoring.", () => [""]);
    for (const id of ["over-h", "over-hdot", "over-energy", "over-step"]) listenToRange(byId(id), () => plots[id], (low, high) => zoom([low, high]), (x) => stage && stage.seek(x));
    drawPage(drawAll, data.picture, {
        span: spanOf,
        seconds: () => (seconds > 0 && seconds !== PLAY_SECONDS ? seconds * (spanOf()[1] - spanOf()[0]) : PLAY_SECONDS),
        note: resultNote,
        clock: (t) => (data.separate ? `${Math.round(t) + 1} of ${data.picture.frames.count}` : tied ? clockOf(spanOf()[0] + t, spanOf()[1], abscissa.unit) : ""),
        shown: (t) => showPlace(spanOf()[0] + t),
        over: forceArrows,
    });
    if (stage) beginForces();
}

begin();
