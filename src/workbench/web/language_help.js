/* SPDX-License-Identifier: BSD-3-Clause */
/* Completion, explanations and new names by the language server (docs/language_server.md), which the engine has. Each question is a
 * whole conversation: the last text without an error, whose names are known, becomes the present text, and then one asks. */
"use strict";

/* -- messages ----------------------------------------------------------------------------------------------- */

function framed(message) {
    const body = JSON.stringify({ jsonrpc: "2.0", ...message });
    return `Content-Length: ${new TextEncoder().encode(body).length}\r\n\r\n${body}`;
}

/* JSON has no line breaks within its strings: headers are where such a line is. */
const unframed = (text) => text.split(/Content-Length: \d+\r\n\r\n/).filter(Boolean).map((body) => JSON.parse(body));

const modelAddress = () => `file://${(bench.shown === null ? bench.path : `/model/${bench.shown}`).split("/").map(encodeURIComponent).join("/")}`;

/* The answer to a question about a place of the text, { line, ch }. */
async function askLanguage(method, text, { line, ch }, more = {}) {
    const uri = modelAddress(), textDocument = { uri };
    const messages = [
        { id: 0, method: "initialize", params: { processId: null, rootUri: null, capabilities: {} } },
        { method: "initialized", params: {} },
        { method: "textDocument/didOpen", params: { textDocument: { uri, languageId: "yaml", version: 1, text: bench.shown === null ? bench.sound : text } } },
        { method: "textDocument/didChange", params: { textDocument: { uri, version: 2 }, contentChanges: [{ text }] } },
        { id: 1, method, params: { textDocument, position: { line, character: ch }, ...more } },
    ];
    const answer = unframed(await bench.engine.language(messages.map(framed).join(""))).find(({ id }) => id === 1);
    if (answer.error) throw new Error(answer.error.message);
    return answer.result;
}

/* -- questions ---------------------------------------------------------------------------------------------- */

const placeOfText = ({ line, character }) => ({ line, ch: character });
const withoutMarks = (words) => words.replace(/\[([^\]]+)\]\([^)]*\)/g, "$1").replace(/[`*]/g, "");

/* { from, list: [{ text, about }] } of what may be typed at a place; null: nothing. */
async function completionsAt(text, place) {
    const reply = await askLanguage("textDocument/completion", text, place), items = Array.isArray(reply) ? reply : reply?.items || [];
    if (items.length === 0) return null;
    const from = placeOfText(items[0].textEdit.range.start), typed = text.split("\n")[place.line].slice(from.ch, place.ch).toLowerCase();
    const list = items.filter(({ label }) => label.toLowerCase().startsWith(typed)).map(({ textEdit, detail, documentation }) => ({ text: textEdit.newText, about: withoutMarks(documentation || detail || "") }));
    return { from, list };
}

/* The words of the language server about a place; "": it has none. */
async function explanationAt(text, place) {
    const reply = await askLanguage("textDocument/hover", text, place);
    return reply ? withoutMarks(reply.contents.value) : "";
}

/* The text with another name for what is at a place. */
async function renamedText(text, place, newName) {
    const { changes } = await askLanguage("textDocument/rename", text, place, { newName }), others = Object.keys(changes).filter((uri) => uri !== modelAddress());
    if (others.length > 0) throw new Error(`The name is also in ${others.map((uri) => decodeURIComponent(uri.split("/").pop())).join(", ")}: an editor with the language server changes several files.`);
    const lines = text.split("\n"), begins = [0];
    for (const line of lines) begins.push(begins.at(-1) + line.length + 1);
    const at = ({ line, character }) => begins[line] + character, edits = (changes[modelAddress()] || []).map(({ range, newText }) => ({ from: at(range.start), to: at(range.end), newText }));
    return edits.sort((a, b) => b.from - a.from).reduce((whole, { from, to, newText }) => whole.slice(0, from) + newText + whole.slice(to), text);
}
