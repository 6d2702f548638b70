/* SPDX-License-Identifier: BSD-3-Clause */
/* Studies of the model, a tab each: what is asked, the answer with its trust in the first line, curves and tables. */
"use strict";

const DEFAULT_END = 2; /* s, where the model has no end */
const PROGRESS_EACH = 500; /* ms */
const studies = { shown: "motion", kept: null, results: {}, group: "", over: "t", points: new Set(), chosen: -1 };

/* -- columns ------------------------------------------------------------------------------------------------ */

/* The series of a report page as points over its x; columns with fewer rows have fewer points. */
function makeRun(page, reply) {
    const columns = new Map(), list = page.series ? page.series.columns : [], x = list.length ? floatsOf(list[0].values) : [];
    for (const { name, unit, every, values } of list) {
        const numbers = floatsOf(values);
        columns.set(name, { name, unit, x: every === 1 ? x : numbers.map((_, k) => x[Math.min(k * every, x.length - 1)]), y: numbers });
    }
    return { page, reply, columns, column: (name) => columns.get(name) };
}

function valueAtTime(run, name, t) {
    const { x, y } = run.column(name), [low, high, part] = placeIn(x, t);
    return (1 - part) * y[low] + part * y[high];
}

/* "position.bar2.C" of "position.bar2.C.x": what is drawn together. */
function groupOfColumn(name) {
    const parts = name.split(".");
    if (["q", "qd", "qdd", "lambda", "energy"].includes(parts[0])) return parts[0];
    return /^(x|y|z|[1-9])$/.test(parts.at(-1)) ? parts.slice(0, -1).join(".") : name;
}

/* Columns of one unit: "q|rad", "position.bar2.C|m". */
const curveGroup = ({ name, unit }) => `${groupOfColumn(name)}|${unit}`;

function groupWords(key, groups) {
    const [group, unit] = key.split("|"), alone = groups.filter((other) => other.split("|")[0] === group).length === 1;
    return (GROUP_WORDS[group] || group.replaceAll(".", " ")) + (alone ? "" : `, ${unit}`);
}

const GROUP_WORDS = { q: "positions", qd: "velocities", qdd: "accelerations", lambda: "multipliers", energy: "energy" };

/* -- commands ----------------------------------------------------------------------------------------------- */

const OUTPUTS = { page: "/out/page.html", json: "/out/result.json", table: "/out/table.csv" };
const overrides = () => Object.entries(bench.values).flatMap(([name, value]) => ["--set", `${name}=${value}`]);

/* Runs a study on the text as it is; its files as texts, the page's data read. */
async function runCommand(command, words, { report = true, table = true, run = "study" } = {}) {
    const files = [...(report ? ["--report", OUTPUTS.page] : []), ...(table ? ["--output", OUTPUTS.table] : []), "--json", OUTPUTS.json];
    const asked = [command, bench.name, ...words, ...overrides(), ...files];
    const answer = await bench.engine.command(asked, { files: modelFiles(), run });
    const decode = (name) => (answer.files[name] ? new TextDecoder().decode(answer.files[name]) : null), html = decode("page.html"), json = decode("result.json");
    if (html) takeColours(html);
    return { ...answer, asked, html, csv: decode("table.csv"), page: html ? pageData(html) : null, json: json ? JSON.parse(json) : null };
}

/* The colours of bodies and curves, which report pages have from one table of the library. */
function takeColours(html) {
    const found = COLOURS.length === 0 && /const COLOURS = \[\n(.*)\];/.exec(html);
    if (found) COLOURS.push(...JSON.parse(`[${found[1]}]`));
}

const failed = (answer) => answer.messages.filter(({ level }) => level === "error").map(({ text }) => text)[0] || answer.json?.reason || answer.text || `The command ended with code ${answer.code}.`;

/* -- the panel ---------------------------------------------------------------------------------------------- */

/* The first line: a mark, the answer, and whether it can be trusted. */
function writeVerdict(status, words) {
    byId("verdict").dataset.status = status;
    byId("verdict").textContent = `${MARKS[status] || ""} ${words}`.trim();
}

function writeFacts(page, more = []) {
    const facts = (page?.facts || []).map(({ name, value, limit, beyond }) => `${name}: ${neat(value)}${limit ? ` (${beyond ? "beyond" : "within"} the limit ${neat(limit)})` : ""}`);
    const warnings = page ? [page.reason, ...String(page.warnings || "").split("\n")] : [];
    byId("facts").replaceChildren(...[...facts, ...warnings, ...more].filter(Boolean).map((words) => element("p", neat(sentence(words)))));
}

function clearResult() {
    for (const id of ["choose", "table", "facts", "ask"]) byId(id).replaceChildren();
    byId("verdict").textContent = "";
    byId("plot-figure").hidden = true;
    byId("printed").hidden = true;
}

function writePrinted(text) {
    byId("printed").hidden = !text;
    byId("printed").querySelector("pre").textContent = text || "";
}

function inputOf(id, words, value, change = () => {}) {
    const box = element("input");
    Object.assign(box, { id, type: "text", value, autocomplete: "off", spellcheck: false });
    box.addEventListener("change", () => change(box.value.trim()));
    box.addEventListener("keydown", (event) => event.key === "Enter" && runStudy());
    return element("label", `${words} `, box);
}

function selectOf(id, words, options, value, change = () => {}) {
    const box = element("select", ...options.map(([key, label]) => optionOf(label, key)));
    box.id = id;
    if (options.some(([key]) => key === value)) box.value = value;
    box.addEventListener("change", () => change(box.value));
    return element("label", `${words} `, box);
}

/* -- plots -------------------------------------------------------------------------------------------------- */

const curvePoints = ({ x, y }) => Array.from(y, (v, k) => ({ x: x[k], y: v }));

/* Curves { name, points, colour, dashed } with a legend; `even`: x and y have one scale; `least`: the axis begins there. */
function drawCurves(curves, { x = "", y = "", even = false, least = null } = {}) {
    byId("plot-figure").hidden = curves.length === 0;
    byId("plot-figure").querySelector("figcaption").replaceChildren(...curves.map(({ name, colour, dashed }) => element("span", lineMark(colour, dashed ? [6, 4] : []), name)));
    if (curves.length === 0) return;
    const ends = (key) => {
        const all = curves.flatMap(({ points }) => points.map((p) => p[key]).filter(Number.isFinite)), [low, high] = all.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
        const room = key === "y" ? 0.06 * (high - low) || Math.abs(high) || 1 : high > low ? 0 : 1;
        return [low - room, high + room];
    };
    let spans = { x: ends("x"), y: ends("y") };
    if (least !== null) spans.y[0] = least;
    if (even) spans = evenSpans(spans, byId("plot").parentElement);
    const sets = curves.map(({ points, colour, dashed }) => curveOf(points, colour, dashed ? { borderDash: [6, 4] } : {}));
    drawPlot("plot", sets, { x: evenAxis(spans.x, x), y: evenAxis(spans.y, y) }, (item) => [curves[item.datasetIndex].name, `${digits(item.raw.y, 5)} ${y} at ${digits(item.raw.x, 5)} ${x}`]);
    byId("plot").dataset.curves = curves.map(({ name }) => name).join(" ");
}

/* Both ranges about their middles with one scale in a box. */
function evenSpans({ x, y }, { clientWidth, clientHeight }) {
    const shape = Math.max(clientWidth - 60, 50) / Math.max(clientHeight - 40, 50), size = Math.max(1.1 * (x[1] - x[0]), (y[1] - y[0]) * shape) || 1, about = ([a, b], whole) => [(a + b - whole) / 2, (a + b + whole) / 2];
    return { x: about(x, size), y: about(y, size / shape) };
}

/* -- motion ------------------------------------------------------------------------------------------------- */

const modelEnd = () => bench.model?.run?.t_end ?? null;

function askMotion() {
    const end = modelEnd() ?? bench.end ?? DEFAULT_END;
    byId("ask").append(inputOf("t-end", "until, s", String(end), (words) => {
        if (!(Number(words) > 0)) return;
        if (modelEnd() === null) bench.end = Number(words);
        else changeText(setEntry(bench.text, ["run", "t_end"], words));
    }));
}

async function runMotion() {
    const box = byId("t-end"), end = Number(box?.value) > 0 ? Number(box.value) : bench.end ?? DEFAULT_END;
    const answer = await runCommand("simulate", modelEnd() === null || Number(box?.value) !== modelEnd() ? ["--t-end", String(end)] : []);
    if (!answer.page) return { failed: failed(answer), answer };
    bench.run = makeRun(answer.page, answer);
    showScene(answer.page);
    play(!window.matchMedia("(prefers-reduced-motion: reduce)").matches);
    return { answer, run: bench.run };
}

function showMotion({ run, answer }) {
    const groups = [...new Set([...run.columns.values()].slice(1).map(curveGroup))];
    if (!groups.includes(studies.group)) studies.group = groups[0];
    writeVerdict(run.page.status, `${run.page.answer}${run.page.status === "complete" ? "" : `, ${run.page.status}`}`);
    writeFacts(run.page);
    const keep = buttonOf(studies.kept ? "Forget the kept run" : "Keep this run", Boolean(studies.kept), () => {
        studies.kept = studies.kept ? null : { run, name: runName() };
        showStudy();
    });
    keep.id = "keep-run";
    keep.title = "Draws this run with dashed lines in the curves of later runs";
    byId("choose").append(
        selectOf("group", "curves", groups.map((group) => [group, groupWords(group, groups)]), studies.group, (group) => {
            studies.group = group;
            drawMotion(run);
        }),
        selectOf("over", "over", ["t", ...[...run.columns.keys()].filter((name) => /^(q|position)\./.test(name))].map((name) => [name, name]), studies.over, (name) => {
            studies.over = name;
            drawMotion(run);
        }), keep);
    drawMotion(run);
    writePrinted(answer.text);
}

const runName = () => Object.entries(bench.values).map(([name, value]) => `${name} = ${digits(value, 4)}`).join(", ") || "kept run";

/* Curves of the chosen group, those of the kept run dashed. */
function drawMotion(run) {
    const over = run.column(studies.over) ? studies.over : "t", own = [...run.columns.values()].filter((column) => curveGroup(column) === studies.group && column.name !== over);
    const pointsOf = (one, column) => (over === "t" ? curvePoints(column) : Array.from(column.y, (y, k) => ({ x: valueAtTime(one, over, column.x[k]), y })));
    const curves = own.slice(0, 12).map((column, k) => ({ name: column.name, points: pointsOf(run, column), colour: curveColour(k) })), { kept } = studies;
    if (kept && kept.run !== run) for (const [k, column] of own.slice(0, 12).entries()) if (kept.run.column(column.name)) curves.push({ name: `${column.name}, ${kept.name}`, points: pointsOf(kept.run, kept.run.column(column.name)), colour: curveColour(k), dashed: true });
    drawCurves(curves, { x: run.column(over).unit, y: own[0]?.unit || "" });
    writeExtremes(run);
}

function writeExtremes(run) {
    const rows = [...run.columns.values()].filter((column) => curveGroup(column) === studies.group).slice(0, 12).map(({ name, unit, x, y }) => {
        const [low, high] = [Math.min, Math.max].map((of) => y.reduce((best, v) => of(best, v), y[0])), at = (v) => x[y.indexOf(v)];
        return rowOf(name, digits(low, 5), three(at(low)), digits(high, 5), three(at(high)), unit);
    });
    byId("table").replaceChildren(headRow(["", "least", "at t, s", "greatest", "at t, s", "unit"]), ...rows);
}

/* -- forces at pins ----------------------------------------------------------------------------------------- */

function showPins({ run }) {
    const { rows } = run.page.reactions || { rows: [] }, sorted = [...rows].sort((a, b) => (b[2] ?? 0) - (a[2] ?? 0)), [most] = sorted;
    if (!most || !isNumber(most[2])) writeVerdict(run.page.status, "The model has no joint that carries a force.");
    else writeVerdict(run.page.status, `Largest pin force: ${digits(most[2], 4)} N in ${most[0]} at t = ${three(most[3])} s${run.page.status === "complete" ? "" : ` (${run.page.status})`}`);
    writeFacts(run.page, sorted.filter((row) => row[12] === 0).map((row) => `${row[0]}: not unique, ${row[13] || "redundant constraints share it"}`));
    byId("table").replaceChildren(headRow(["joint", "largest force, N", "at t, s", "largest moment, N m", "at t, s"]), ...sorted.map((row) => {
        const cells = [row[2], row[3], row[7], row[8]].map((x, k) => (isNumber(x) ? (k % 2 ? three(x) : digits(x, 5)) : "\u2013"));
        return pressableRow([row[0], ...cells], () => {
            pick(row[0]);
            if (isNumber(row[3])) showTimeOf(run, row[3]);
        });
    }));
    if (shownScene.picture !== run.page.picture || !forces) return drawCurves([]);
    const own = forces.rows.filter(({ kind }) => kind === "joints"), curves = own.slice(0, 10).map((row, k) => ({ name: row.name, points: Array.from(forces.x, (x, i) => ({ x, y: norm(forces.at(i, row)) })), colour: curveColour(k) }));
    return drawCurves(curves, { x: "s", y: forces.unit, least: 0 });
}

/* A row that can be pressed, also by the keyboard. */
function pressableRow(cells, press) {
    const row = rowOf(...cells);
    row.className = "pressable";
    row.tabIndex = 0;
    row.addEventListener("click", press);
    row.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        press();
    });
    return row;
}

/* The picture of a run at a time; of an earlier one it is shown again. */
function showTimeOf(run, t) {
    if (shownScene.picture !== run.page.picture) showScene(run.page);
    play(false);
    showTime(t);
}

/* -- coupler curves ----------------------------------------------------------------------------------------- */

/* Points that move, as BODY.POINT. */
const movingPoints = () => modelPlaces(bench.model).filter(({ body, point }) => body !== "ground" && point).map(({ body, point, local }) => ({ name: `${body}.${point}`, body, local }));

function pathOf({ picture }, { body, local }) {
    const motion = makeMotion(picture), b = picture.bodies.findIndex((one) => one.name === body), count = Math.min(picture.frames.count, 600);
    return b < 0 ? [] : Array.from({ length: count }, (_, k) => moved(motion(timeOfShot(picture, k, count))[b], local));
}

function showCurves({ run }) {
    const points = movingPoints(), held = new Set(modelJoints(bench.model).filter(({ bodies }) => bodies.includes("ground")).map(({ on, at }) => `${on} ${at}`));
    const free = points.filter(({ body, local }) => !held.has(`${body} ${local}`));
    for (const name of [...studies.points]) if (!points.some((point) => point.name === name)) studies.points.delete(name);
    const pinned = new Set([...held].map((place) => place.split(" ")[0])), usual = free.filter(({ body }) => !pinned.has(body)).at(-1) ?? free.at(-1);
    if (studies.points.size === 0 && usual) studies.points.add(usual.name);
    byId("choose").append(...free.slice(0, 24).map(({ name }) => buttonOf(name, studies.points.has(name), () => {
        studies.points[studies.points.has(name) ? "delete" : "add"](name);
        showStudy();
        drawScene();
    })));
    const { basis } = shownScene, paths = free.filter(({ name }) => studies.points.has(name)).map((point, k) => ({ ...point, colour: curveColour(k), world: pathOf(run.page, point) }));
    const sized = paths.map(({ name, world, colour }) => {
        const flat = world.map((p) => [dot(p, basis.right), dot(p, basis.up)]), size = (i) => Math.max(...flat.map((p) => p[i])) - Math.min(...flat.map((p) => p[i]));
        return { name, colour, points: flat.map(([x, y]) => ({ x, y })), width: size(0), height: size(1), length: world.slice(1).reduce((sum, p, k) => sum + norm(sub(p, world[k])), 0) };
    });
    studies.paths = paths;
    if (sized.length === 0) writeVerdict(run.page.status, "Choose a point, or add one to a body.");
    else writeVerdict(run.page.status, `${sized[0].name} moves within ${lengthWords(sized[0].width)} by ${lengthWords(sized[0].height)}, ${lengthWords(sized[0].length)} in all${run.page.status === "complete" ? "" : ` (${run.page.status})`}`);
    writeFacts(run.page);
    drawCurves(sized, { x: "m", y: "m", even: true });
    byId("table").replaceChildren(headRow(["point", "width, m", "height, m", "way, m"]), ...sized.map(({ name, width, height, length }) => rowOf(name, digits(width, 5), digits(height, 5), digits(length, 5))));
}

/* The paths over the picture while their tab is shown. */
function drawPaths(see) {
    if (studies.shown !== "curves" || !studies.paths || shownScene.picture !== bench.run?.page.picture) return [];
    return studies.paths.filter(({ world }) => world.length > 1).map(({ name, world, colour }) => drawn2d("path", { d: `M${world.map((p) => see(p).map((x) => x.toFixed(1))).join("L")}`, fill: "none", stroke: colour, "stroke-width": 1.6, "data-path": name }));
}

/* -- dead centres ------------------------------------------------------------------------------------------- */

const coordinateList = () => (bench.model?.bodies || []).flatMap(({ motions }) => motions.map(({ coordinate, kind }) => ({ name: coordinate, angle: kind === "R" })));

function askDead() {
    const list = coordinateList(), first = list.find(({ name }) => name === studies.sweep) || list[0];
    if (!first) return;
    const range = first.angle ? ["0 deg", "360 deg"] : ["0", "100 mm"];
    byId("ask").append(selectOf("sweep", "sweep", list.map(({ name }) => [name, name]), first.name, (name) => {
        studies.sweep = name;
        showStudy();
    }), inputOf("sweep-from", "from", range[0]), inputOf("sweep-to", "to", range[1]));
}

async function runDead() {
    const drives = bench.model.closures.filter(({ kind }) => kind === "drive").map(({ name }) => name), [name, from, to] = ["sweep", "sweep-from", "sweep-to"].map((id) => byId(id)?.value);
    if (!name) return { failed: "The model has no coordinate." };
    const answer = await runCommand("kinematics", ["--sweep", `${name}=${from}:${to}`, ...(drives.length ? ["--release", drives.join(",")] : [])]);
    if (!answer.page) return { failed: failed(answer), answer };
    showScene(answer.page);
    return { answer, run: makeRun(answer.page, answer) };
}

function showDead({ answer, run }) {
    const { json } = answer, angles = new Set(coordinateList().filter(({ angle }) => angle).map(({ name }) => name)), words = (name, x) => (angles.has(name) ? `${digits(degrees(x), 5)} deg` : (x < 0 ? "-" : "") + lengthWords(Math.abs(x)));
    const swept = json.driven.map(({ name }) => name).join(", "), found = json.dead_centres;
    writeVerdict(found.length ? "complete" : json.status, found.length ? `Dead centre: ${found.map(({ coordinate, value, extreme }) => `${coordinate} = ${words(coordinate, value)} is its ${extreme} value`).join("; ")}` : json.status === "complete" ? `No dead centre: ${swept} goes through the whole range` : json.reason || json.status);
    writeFacts({ ...answer.page, reason: json.status === "complete" ? "" : json.reason });
    const names = [...new Set(found.flatMap(({ q }) => Object.keys(q)))];
    byId("table").replaceChildren(...(found.length ? [headRow(["at the dead centre", ...found.map((_, k) => String(k + 1))]), ...names.map((name) => rowOf(name, ...found.map(({ q }) => words(name, q[name]))))] : []));
    const own = [...run.columns.values()].filter(({ name }) => /^q\./.test(name)), x = run.columns.values().next().value;
    drawCurves(own.slice(0, 10).map((column, k) => ({ name: column.name, points: curvePoints(column), colour: curveColour(k) })), { x: x?.unit || "", y: own[0]?.unit || "" });
    writePrinted(answer.text);
}

/* -- equilibrium over a range ------------------------------------------------------------------------------- */

const freeParameters = () => (bench.startPage?.parameters || []).filter(({ expression }) => !expression);

function askEquilibrium() {
    const list = freeParameters(), one = list.find(({ name }) => name === studies.parameter);
    byId("ask").append(selectOf("range-of", "over", [["", "no range"], ...list.map(({ name }) => [name, name])], one?.name ?? "", (name) => {
        studies.parameter = name;
        showStudy();
    }));
    if (one) byId("ask").append(inputOf("range-from", "from", digits(0.5 * one.value, 4)), inputOf("range-to", "to", digits(1.5 * one.value, 4)), inputOf("range-count", "values", "11"));
}

async function runEquilibrium() {
    const name = byId("range-of")?.value || "", [from, to, count] = ["range-from", "range-to", "range-count"].map((id) => Number(byId(id)?.value)), total = name ? Math.min(Math.max(Math.round(count) || 2, 2), 200) : 1, rows = [];
    if (name && !(Number.isFinite(from) && Number.isFinite(to))) return { failed: "The range needs two numbers." };
    for (let k = 0; k < total && !bench.stopping; k++) {
        const value = name ? from + ((to - from) * k) / (total - 1) : null;
        rows.push({ value, ...(await runCommand("equilibrium", name ? ["--set", `${name}=${value}`] : [], { table: false })) });
        if (!rows[0].json) return { failed: failed(rows[0]), answer: rows[0] };
    }
    if (rows[0].page) showScene(rows[0].page);
    return { answer: rows[0], rows, name };
}

function showEquilibrium({ rows, name, answer }) {
    const found = rows.filter(({ json, code }) => json && code === 0), stable = found.filter(({ json }) => json.stability === "stable"), names = Object.keys(found[0]?.json.q || {});
    const kind = found.length === 0 ? "" : stable.length === found.length ? (found.length > 1 ? "all stable" : "stable") : `${stable.length} stable`;
    writeVerdict(found.length === rows.length ? "complete" : "stopped", name ? `Equilibrium at ${found.length} of ${rows.length} values of ${name}${kind ? `, ${kind}` : ""}` : `One equilibrium, ${found[0]?.json.stability || "not found"}`);
    writeFacts(answer.page, rows.length > 1 ? ["A row shows its picture when it is pressed."] : []);
    byId("table").replaceChildren(headRow([...(name ? [name] : []), ...names, "", "residual"]), ...rows.map((row) => pressableRow([...(name ? [digits(row.value, 5)] : []), ...names.map((q) => digits(row.json?.q?.[q], 5)), row.json?.stability || failed(row), short(row.json?.residual)], () => row.page && showScene(row.page))));
    const curves = name ? names.slice(0, 10).map((q, k) => ({ name: q, colour: curveColour(k), points: found.map(({ value, json }) => ({ x: value, y: json.q[q] })) })) : [];
    drawCurves(curves, { x: "", y: "" });
    writePrinted(answer.text);
}

/* -- modes -------------------------------------------------------------------------------------------------- */

async function runModes() {
    const answer = await runCommand("modes", []);
    if (!answer.page) return { failed: failed(answer), answer };
    studies.chosen = answer.page.moving.findIndex(({ frames }, k) => frames >= 0 && answer.page.modes[k].index >= answer.page.zeros);
    return { answer, page: answer.page };
}

/* The mechanism along a mode: the frames of its period, at most so slow and so fast as one can see. */
function showMode(page, k) {
    const { frames } = page.moving[k], last = page.frames - 1;
    if (frames < 0) return;
    const all = { ...page.picture.frames }, own = { ...page, picture: { ...page.picture, pathless: true, frames: all } };
    showScene(own);
    Object.assign(shownScene, { span: [frames, frames + last], t: frames, period: Math.min(Math.max(1 / (page.modes[k].frequency || 1), 0.7), 4) });
    showTimeBar();
    showTime(frames);
    play(true);
}

function showModes({ page, answer }) {
    writeVerdict(page.status, `${page.modes.length} mode${page.modes.length === 1 ? "" : "s"}, ${page.stability}`);
    writeFacts(page, [page.reasons]);
    byId("table").replaceChildren(headRow(["mode", "frequency, Hz", "damping ratio", "decay by e, s", "moves"]), ...page.modes.map((mode, k) => {
        const row = pressableRow([String(k + 1), mode.eigenvalue[1] > 0 ? digits(mode.frequency, 5) : "\u2013", mode.eigenvalue[1] > 0 ? digits(mode.damping, 4) : "\u2013", digits(mode.decay, 4), element("td.words", mode.moves)], () => {
            studies.chosen = k;
            showMode(page, k);
            for (const other of byId("table").querySelectorAll("tr")) other.classList.toggle("chosen", other === row);
        });
        row.classList.toggle("chosen", k === studies.chosen);
        return row;
    }));
    if (studies.chosen >= 0 && resultNow().state === stateNow()) showMode(page, studies.chosen);
    writePrinted(answer.text);
}

/* -- all of them -------------------------------------------------------------------------------------------- */

/* `run` computes, `show` writes its result, `ask` has the inputs before; studies of one run share it. */
const STUDIES = [
    { key: "motion", name: "Motion", ask: askMotion, run: runMotion, show: showMotion },
    { key: "pins", name: "Pin forces", ask: askMotion, run: runMotion, show: showPins, of: "motion" },
    { key: "curves", name: "Coupler curves", ask: askMotion, run: runMotion, show: showCurves, of: "motion" },
    { key: "dead", name: "Dead centres", ask: askDead, run: runDead, show: showDead },
    { key: "equilibrium", name: "Equilibrium", ask: askEquilibrium, run: runEquilibrium, show: showEquilibrium },
    { key: "modes", name: "Modes", ask: () => {}, run: runModes, show: showModes },
];
const studyNow = () => STUDIES.find(({ key }) => key === studies.shown);
const resultNow = () => studies.results[studyNow().of ?? studies.shown];

/* The tab that is chosen: its inputs, and its result where there is one. */
function showStudy() {
    const study = studyNow(), result = resultNow(), kept = Object.fromEntries([...byId("ask").querySelectorAll("input")].map((box) => [box.id, box.value]));
    clearResult();
    byId("result").dataset.study = study.key;
    if (bench.model?.bodies.length) study.ask();
    for (const box of byId("ask").querySelectorAll("input")) if (kept[box.id] !== undefined && box.id !== "t-end" && studies.asked === study.key) box.value = kept[box.id];
    studies.asked = study.key;
    if (!result) writeFacts(null, [bench.model?.bodies.length && !bench.wrong ? "Press Run to compute this study." : ""]);
    else if (result.failed) {
        writeVerdict("failed", result.failed);
        writePrinted(result.answer?.text);
    } else study.show(result);
    const stale = bench.wrong ? "The text was changed after this result, and has an error: mend it, then press Run." : "The text was changed after this result: press Run.";
    if (result && result.state !== stateNow()) byId("facts").prepend(element("p.warning", stale));
}

async function runStudy() {
    const study = studyNow(), button = byId("run");
    if (bench.running) return stopStudy();
    await bench.checked;
    if (!bench.model?.bodies.length || bench.wrong) {
        showStudy();
        writeVerdict("failed", bench.wrong ? "The text has an error: mend it first." : "The model has no body: draw a bar first.");
        return undefined;
    }
    Object.assign(bench, { running: true, stopping: false });
    Object.assign(shownScene, { span: null, period: 0 });
    const late = setTimeout(() => (button.textContent = "Stop"), 300), watch = setInterval(writeProgress, PROGRESS_EACH), kept = { state: stateNow(), files: modelFiles() };
    try {
        const result = await study.run();
        studies.results[study.of ?? study.key] = { ...result, ...kept };
    } catch (error) {
        studies.results[study.of ?? study.key] = { failed: sentence(error.message), ...kept };
    }
    clearTimeout(late);
    clearInterval(watch);
    button.textContent = "Run";
    bench.running = false;
    showStudy();
    return undefined;
}

/* The progress of a study that takes longer. */
async function writeProgress() {
    const reply = await bench.engine.progress?.("study").catch(() => null);
    if (reply && bench.running) writeVerdict("", `${three(reply.done)} of ${three(reply.total)} ${reply.unit}${reply.leftSeconds > 1 ? `, ${duration(reply.leftSeconds)} left` : ""}`);
}

function stopStudy() {
    bench.stopping = true;
    bench.engine.stop?.("study");
}

function chooseStudy(key) {
    studies.shown = key;
    for (const tab of byId("tabs").children) {
        tab.setAttribute("aria-selected", String(tab.dataset.study === key));
        tab.tabIndex = tab.dataset.study === key ? 0 : -1;
    }
    showStudy();
    drawScene();
}

function beginStudies() {
    byId("tabs").append(...STUDIES.map(({ key, name }) => {
        const tab = element("button", name);
        Object.assign(tab, { type: "button", id: `tab-${key}` });
        tab.dataset.study = key;
        tab.setAttribute("role", "tab");
        tab.setAttribute("aria-controls", "result");
        tab.addEventListener("click", () => chooseStudy(key));
        return tab;
    }));
    byId("tabs").addEventListener("keydown", (event) => {
        const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key], at = STUDIES.findIndex(({ key }) => key === studies.shown);
        if (!step) return;
        chooseStudy(STUDIES[(at + step + STUDIES.length) % STUDIES.length].key);
        byId("tabs").querySelector('[aria-selected="true"]').focus();
    });
    byId("run").addEventListener("click", runStudy);
    shownScene.over.push(drawPaths);
    shownScene.drawn.push((t) => ["motion", "pins"].includes(studies.shown) && studies.over === "t" && showCursor(t));
    chooseStudy("motion");
}
