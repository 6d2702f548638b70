/* SPDX-License-Identifier: BSD-3-Clause */
/* Files in addition to the model that a page without a server holds: parts that it includes, tables, meshes. Texts are edited in the same
 * editor, each with its own steps of undo; other files are kept as bytes. */
"use strict";

const otherFiles = () => Object.fromEntries([...bench.others].map(([name, { text, bytes }]) => [name, text ?? bytes]));

/* All files of the model by their names, as they are now. */
const modelFiles = () => ({ ...otherFiles(), [bench.name]: bench.text });

const isModelName = (name) => /\.ya?ml$/i.test(name);

/* -- which one is shown ------------------------------------------------------------------------------------- */

/* The text of the editor belongs to the file that is shown. */
function takeShownText() {
    if (bench.shown === null) {
        bench.text = modelEditor.getValue();
        return;
    }
    const file = bench.others.get(bench.shown), text = modelEditor.getValue();
    bench.othersChanged += Number(file.text !== text);
    file.text = text;
}

/* Shows a file in the editor; null: the model. */
function showFile(name) {
    if (name === bench.shown) return;
    const file = bench.others.get(name), key = name === null ? "model" : name;
    if (name !== null && file?.text === undefined) return;
    bench.modelDoc ||= modelEditor.getDoc();
    if (file) file.doc ||= CodeMirror.Doc(file.text, isModelName(key) ? "yaml" : null);
    bench.shown = name;
    modelEditor.swapDoc(file ? file.doc : bench.modelDoc);
    writeErrors(bench.messages || []);
    showFiles();
    writeUndo();
}

/* A button for each file, with one that takes it away. */
function showFiles() {
    const names = [...bench.others.keys()];
    byId("model-files").hidden = names.length === 0;
    byId("model-files").replaceChildren(...[null, ...names].map((name) => {
        const press = element("button", name ?? bench.name), isText = name === null || bench.others.get(name).text !== undefined;
        Object.assign(press, { type: "button", disabled: !isText, title: isText ? "" : "This file is not a text: the model uses it as it is" });
        press.setAttribute("aria-pressed", String(name === bench.shown));
        press.addEventListener("click", () => showFile(name));
        if (name === null) return press;
        const away = element("button.away", "\u00d7");
        away.type = "button";
        away.setAttribute("aria-label", `Take ${name} away`);
        away.addEventListener("click", () => takeAwayFile(name));
        return element("span", press, away);
    }));
}

/* A file that the model names and the page does not hold: where it is opened. */
function withoutFile({ text }) {
    const missing = bench.engine.holdsFiles && /cannot read '([^']+)'/.exec(text);
    return missing ? ` Open ${missing[1].split("/").pop()} with Files to add it.` : "";
}

/* The model has the name of the file that it is from, by which it is saved. */
function takeName(name) {
    if (bench.others.delete(name)) showFiles();
    Object.assign(bench, { name, path: `/model/${name}` });
}

/* -- files that come and go --------------------------------------------------------------------------------- */

function addFile(name, { text, bytes }) {
    const { shown } = bench;
    if (shown === name) showFile(null);
    bench.others.set(name, { text, bytes, saved: text });
    bench.othersChanged++;
    showFiles();
    textChanged();
}

function takeAwayFile(name) {
    if (bench.shown === name) showFile(null);
    const file = bench.others.get(name);
    bench.others.delete(name);
    bench.othersChanged++;
    showFiles();
    textChanged();
    writeNotice(`${name} is taken away.`, [{ words: "Undo", press: () => addFile(name, file) }]);
}

/* A text, or bytes. */
async function contentOf(file) {
    const bytes = new Uint8Array(await file.arrayBuffer());
    try {
        if (bytes.includes(0)) return { bytes };
        return { text: new TextDecoder("utf-8", { fatal: true, ignoreBOM: true }).decode(bytes) };
    } catch {
        return { bytes };
    }
}

/* The name by which the texts name a file, which may begin with folders: "wheels/S1002.csv". */
function nameInTexts(name, texts) {
    const found = texts.flatMap((text) => text.split(/[\s,'"[\]{}]+/)).find((word) => word === name || word.endsWith(`/${name}`));
    return found ?? null;
}

/* Files that the user opens: one model takes the place of the present one; others are held with it. */
async function takeFiles(files) {
    if (files.length === 0) return;
    if (!bench.engine.holdsFiles) {
        if (files.length > 1) writeNotice("Open one model: further files are taken from the folder of the model.");
        else openText(await files[0].text(), files[0].name);
        return;
    }
    const opened = await Promise.all(files.map(async (file) => ({ name: file.name, ...(await contentOf(file)) })));
    const present = [bench.text, ...[...bench.others.values()].map(({ text }) => text ?? "")], models = opened.filter(({ name, text }) => isModelName(name) && text !== undefined);
    const named = (one) => nameInTexts(one.name, [...present, ...opened.filter((other) => other !== one).map(({ text }) => text ?? "")]);
    const first = models.find((one) => !named(one)) ?? (opened.length > 1 && !opened.some(named) ? models[0] : undefined);
    for (const one of opened) if (one !== first) addFile(named(one) ?? one.name, one);
    if (first) {
        takeName(first.name);
        openText(first.text, first.name);
        showFiles();
    }
    if (!first) writeNotice(`The model has ${opened.map(({ name }) => name).join(", ")} now.`);
}
