/* SPDX-License-Identifier: BSD-3-Clause */
/* The workbench as a whole: the file and the text, checks while one types, sliders of parameters, panels and keys. The text is the
 * only truth: every tool changes it, and all that is shown follows from it. */
"use strict";

const TYPED_WAIT = 350; /* ms after the last change until the text is checked */
const SLIDER_WAIT = 60;
const WATCH_AGAIN = 2000; /* ms after a failure of the server */

const bench = {
    engine: pageEngine, name: "model.yaml", path: "/model.yaml", text: "", sound: "", saved: "", version: 0, /* sound: the last text without an error */
    model: null, start: null, startPage: null, wrong: false, /* of the text: numbers, assembled start, its picture, whether it has an error */
    values: {}, /* parameters that sliders have changed */
    run: null, running: false, stopping: false, checked: Promise.resolve(), dragSession: null, dragState: null, dragQ: null, end: null,
    others: new Map(), othersChanged: 0, shown: null, /* further files by their names { text or bytes, saved, doc }; the one that is shown, null: the model */
    removed: false, lost: false, /* the file is missing on disk; the server does not answer */
};

/* The text of the model with its other files, to which a result belongs. */
const stateNow = () => `${bench.othersChanged} ${bench.text}`;

/* -- checks ------------------------------------------------------------------------------------------------- */

const jsonOf = (answer, name) => (answer.files[name] ? JSON.parse(new TextDecoder().decode(answer.files[name])) : null);

/* Reads and assembles the text: errors at their places, else the model and its start. */
async function checkText({ picture = true } = {}) {
    const { text } = bench, state = stateNow(), files = modelFiles(), set = overrides();
    if (!text.trim()) {
        Object.assign(bench, { model: null, start: null, startPage: null, wrong: false });
        writeErrors([]);
        showScene(null);
        return writeHint();
    }
    const [shown, start] = await Promise.all([
        bench.engine.command(["show", bench.name, "--model", ...set, "--json", OUTPUTS.json], { files, run: "show" }),
        runCommand("assemble", [], { table: false, run: "start" }),
    ]);
    if (state !== stateNow()) return undefined;
    const model = shown.code === 0 ? jsonOf(shown, "result.json") : null, begun = !model && isBegun(text), closed = Boolean(start.json?.q && start.page);
    const open = model && !closed && !start.messages.some(({ level }) => level === "error") ? [{ level: "error", text: failed(start) }] : [];
    bench.wrong = !begun && !model;
    writeErrors(begun ? [] : [...(model ? start : shown).messages, ...open]);
    if (model) bench.sound = text;
    if (model || begun) bench.model = model ?? groundModel(text);
    if (closed) Object.assign(bench, { start: start.json, startPage: start.page });
    byId("view").classList.toggle("old", !begun && !closed);
    if (start.page && picture) showScene(start.page);
    if (begun) showScene(null);
    showSliders();
    writePicked();
    writeHint();
    return undefined;
}

/* A model that has no body yet is no mistake. */
function isBegun(text) {
    const keys = keysAt(readYaml(text), []);
    return keys.includes("kempe") && keys.every((key) => ["kempe", "name", "gravity", "ground", "parameters", "run"].includes(key));
}

/* Such a model has points of the ground. */
function groundModel(text) {
    const tree = readYaml(text), numbers = (name) => {
        const { start, end } = nodeAt(tree, ["ground", "points", name]);
        return text.slice(start, end).replace(/[[\]]/g, "").split(",").map(Number);
    };
    const points = keysAt(tree, ["ground", "points"]).map((name) => [name, numbers(name)]).filter(([, at]) => at.length === 3 && at.every(Number.isFinite));
    return { bodies: [], closures: [], ground: { points: Object.fromEntries(points) } };
}

let typedTimer = 0;

/* After a change of the text: one check when typing rests. */
function textChanged() {
    takeShownText();
    writeUndo();
    writeSaved();
    clearTimeout(typedTimer);
    let start;
    const begun = new Promise((done) => (start = done));
    bench.checked = begun;
    typedTimer = setTimeout(async () => {
        try {
            bench.values = {};
            await checkText();
            showStudy();
        } catch (error) {
            writeNotice(`The text could not be checked: ${error.message}`);
        }
        document.documentElement.dataset.checked = String(Number(document.documentElement.dataset.checked || 0) + 1);
        start();
    }, TYPED_WAIT);
    setTimeout(start, 20000);
}

/* -- the file ----------------------------------------------------------------------------------------------- */

const hasChanges = () => bench.removed || bench.text !== bench.saved || [...bench.others.values()].some((file) => file.text !== file.saved);

function writeSaved() {
    const changed = hasChanges();
    byId("saved").textContent = bench.engine.save ? (changed ? "not saved" : "saved") : "";
    byId("save").hidden = !bench.engine.save;
    byId("save").disabled = !changed;
    document.title = `${changed ? "\u2022 " : ""}${bench.name} \u2013 Kempe workbench`;
    byId("file-name").textContent = bench.name;
}

/* A sentence above the page, with buttons { words, press }. */
function writeNotice(words, buttons = []) {
    byId("notice").hidden = !words;
    byId("notice").replaceChildren(words, ...buttons.map(({ words: label, press }) => {
        const button = element("button", label);
        button.type = "button";
        button.addEventListener("click", () => {
            writeNotice("");
            press();
        });
        return button;
    }));
}

function takeFile({ name, text, version }, { show = true } = {}) {
    Object.assign(bench, { name, version, saved: text });
    writeThere();
    if (show && bench.text !== text) changeText(text);
    writeSaved();
}

/* The file and the server are there again. */
function writeThere() {
    if (bench.removed || bench.lost) writeNotice("");
    Object.assign(bench, { removed: false, lost: false });
}

async function saveText() {
    if (!bench.engine.save || !hasChanges()) return;
    const { text } = bench;
    try {
        const reply = await bench.engine.save(text, bench.version);
        if (reply.conflict) return offerConflict(reply.conflict);
        Object.assign(bench, { saved: text, version: reply.version });
        writeThere();
        writeSaved();
    } catch (error) {
        writeNotice(`The file was not saved: ${error.message}`);
    }
}

/* The file was changed by another program while the text was changed here. */
function offerConflict(file) {
    writeNotice(`${file.name} was changed by another program, and the text here, too.`, [
        { words: "Keep this text", press: () => takeFile(file, { show: false }) },
        { words: "Take the file", press: () => takeFile(file) },
    ]);
}

/* Changes on disk are shown at once, unless the text has unsaved changes. */
async function watchFile() {
    for (;;) {
        try {
            const file = await bench.engine.changed(bench.version);
            if (bench.lost) writeThere();
            if (!file || file.version === bench.version) continue;
            if (file.text === bench.text || bench.text === bench.saved) takeFile(file);
            else if (file.text === bench.saved) takeFile(file, { show: false });
            else {
                bench.version = file.version;
                offerConflict(file);
            }
        } catch (error) {
            writeMissing(error);
            await new Promise((done) => setTimeout(done, WATCH_AGAIN));
        }
    }
}

/* The file was removed, or the server ended: the text is only in this page then. */
function writeMissing({ status, message }) {
    const before = { removed: bench.removed, lost: bench.lost };
    Object.assign(bench, { removed: status === 404, lost: status === undefined });
    if (bench.removed && !before.removed) writeNotice(`${bench.name} is not there any more: ${sentence(message)} This page has its text.`, [{ words: "Save it again", press: saveText }]);
    else if (bench.lost && !before.lost) writeNotice("The server of this page does not answer: kempe workbench may have ended. This page still has the text; Files has it as a download.");
    writeSaved();
}

/* A text from elsewhere takes the place of the present one; undo brings it back. */
function openText(text, from) {
    showFile(null);
    changeText(text);
    writeNotice(`The model is now the text of ${from}. ${bench.engine.saving} ${bench.name}. Undo brings the former text back.`, [{ words: "Undo", press: () => (showFile(null), modelEditor.undo()) }]);
}

async function openLink() {
    try {
        const reply = await modelOfLink(location.hash);
        if (reply?.others && !bench.engine.holdsFiles) writeNotice(`The link has several files: ${[reply.name, ...Object.keys(reply.others)].join(", ")}. kempe workbench takes further files from the folder of the model: open the link in a page without a server.`);
        else if (reply) {
            if (reply.others) takeName(reply.name);
            for (const [name, file] of Object.entries(reply.others || {})) addFile(name, file);
            openText(reply.text, "the link");
        }
    } catch {
        writeNotice("The link does not contain a whole model: a part of it may be missing.");
    }
    if ([LINK, LINK_OF_FILES].some((word) => location.hash.startsWith(word))) history.replaceState(null, "", location.href.split("#")[0]);
}

/* -- parameters --------------------------------------------------------------------------------------------- */

let sliderTimer = 0, sliderBusy = false;

/* The model with other values: the study again where it has a result, else its start. */
async function followSliders() {
    if (sliderBusy) {
        sliderTimer = setTimeout(followSliders, SLIDER_WAIT);
        return;
    }
    sliderBusy = true;
    const study = studyNow();
    const follows = resultNow()?.answer && (study.of ?? study.key) === "motion";
    await checkText({ picture: !follows });
    if (follows) await runStudy();
    sliderBusy = false;
}

function sliderOf({ name, value }) {
    const row = element("div.slider"), box = element("input"), words = element("output"), write = element("button", "Write"), reach = Math.abs(value) || 1;
    const now = bench.values[name] ?? value;
    Object.assign(box, { type: "range", min: value - reach, max: value + reach, step: reach / 200, value: now });
    box.setAttribute("aria-label", name);
    row.dataset.parameter = name;
    words.textContent = digits(now, 4);
    write.type = "button";
    write.title = `Write this value of ${name} into the text`;
    write.disabled = !(name in bench.values);
    box.addEventListener("input", () => {
        bench.values[name] = Number(Number(box.value).toPrecision(6));
        words.textContent = digits(bench.values[name], 4);
        write.disabled = false;
        clearTimeout(sliderTimer);
        sliderTimer = setTimeout(followSliders, SLIDER_WAIT);
    });
    write.addEventListener("click", () => changeText(setParameter(bench.text, name, digits(bench.values[name], 5))));
    row.append(element("span", name), box, words, write);
    return row;
}

function showSliders() {
    const inText = keysAt(readYaml(bench.text), ["parameters"]), list = freeParameters().filter(({ name }) => inText.includes(name));
    if (byId("sliders").contains(document.activeElement) && Object.keys(bench.values).length > 0) return;
    byId("parameters").hidden = list.length === 0;
    byId("sliders").replaceChildren(...list.map((parameter) => sliderOf(Object.hasOwn(bench.values, parameter.name) ? { ...parameter, value: bench.given[parameter.name] } : parameter)));
    if (Object.keys(bench.values).length === 0) bench.given = Object.fromEntries(list.map(({ name, value }) => [name, value]));
}

/* -- panels and keys ---------------------------------------------------------------------------------------- */

/* On small screens one part of the page is seen. */
function showPanel(name) {
    document.body.dataset.panel = name;
    for (const button of document.querySelectorAll("nav button")) button.setAttribute("aria-pressed", String(button.dataset.panel === name));
    if (name === "text") modelEditor.refresh();
    drawScene();
    if (name === "results" && resultNow()) showStudy();
}

function pressedKey(event) {
    const key = event.key.toLowerCase();
    if (!(event.ctrlKey || event.metaKey)) return;
    if (key === "s") saveText();
    else if (key === "enter") runStudy();
    else if (key === "z" && !modelEditor.hasFocus() && !/INPUT|SELECT/.test(document.activeElement.tagName)) modelEditor[event.shiftKey ? "redo" : "undo"]();
    else return;
    event.preventDefault();
}

/* Another look of all that is drawn, after a change between light and dark. */
function recolour() {
    shownScene.view?.rebuild();
    drawScene();
    showStudy();
}

function beginTime() {
    byId("play").addEventListener("click", () => play(!shownScene.playing));
    byId("time").addEventListener("input", () => {
        const [from, to] = timeSpan();
        play(false);
        showTime(from + ((to - from) * Number(byId("time").value)) / 1000);
    });
    byId("speed").addEventListener("change", () => (shownScene.speed = Number(byId("speed").value)));
    byId("arrows").addEventListener("change", () => {
        if (forces) forces.shown = byId("arrows").checked;
        drawScene();
    });
    shownScene.drawn.push(() => {
        byId("arrows-switch").hidden = !forces || !(forces.usual > 0);
        byId("arrows").checked = Boolean(forces && forces.shown);
    }, () => drawing.picked && !byId("picked").hidden && writePicked());
}

async function begin() {
    Chart.defaults.font.family = getComputedStyle(document.body).fontFamily;
    beginEditor(textChanged);
    beginTime();
    beginTools();
    beginStudies();
    beginFiles(takeFiles);
    byId("save").addEventListener("click", saveText);
    byId("undo").addEventListener("click", () => modelEditor.undo());
    byId("redo").addEventListener("click", () => modelEditor.redo());
    for (const button of document.querySelectorAll("nav button")) button.addEventListener("click", () => showPanel(button.dataset.panel));
    document.addEventListener("keydown", pressedKey);
    dark.addEventListener("change", recolour);
    window.addEventListener("hashchange", openLink);
    window.addEventListener("beforeunload", (event) => hasChanges() && event.preventDefault());
    new ResizeObserver(drawScene).observe(byId("view"));
    showPanel(document.body.dataset.panel);
    try {
        const file = await bench.engine.read();
        Object.assign(bench, { name: file.name, path: file.path, version: file.version, saved: file.text });
        modelEditor.setValue(file.text);
        modelEditor.clearHistory();
        textChanged();
        await openLink();
        await bench.checked;
        if (bench.engine.changed) watchFile();
    } catch (error) {
        writeNotice(`The model could not be read: ${error.message}`);
    }
    document.documentElement.dataset.ready = "yes";
}

begin();
