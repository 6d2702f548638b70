/* SPDX-License-Identifier: BSD-3-Clause */
/* Places of keys and values in the text of a YAML file, and changes of single entries that leave all other text as it is.
 * A node has its kind (map, list, scalar, empty), start and end in the text; a map has entries { key, at, value }. */
"use strict";

/* -- lines -------------------------------------------------------------------------------------------------- */

/* Lines with content: number, offset of the line, its indentation, offset behind its content without comment. */
function contentLines(text) {
    const lines = [];
    let offset = 0;
    text.split("\n").forEach((line, number) => {
        const body = line.replace(/\r$/, ""), indent = body.length - body.trimStart().length;
        if (body.trim() && body[indent] !== "#" && !/^(---|\.\.\.|%)/.test(body)) lines.push({ number, offset, indent, body });
        offset += line.length + 1;
    });
    return lines;
}

/* The offset in a line where its comment begins, or its end without blanks. */
function contentEnd(body, from = 0) {
    let quote = "";
    for (let k = from; k < body.length; k++) {
        const c = body[k];
        if (quote) quote = c === quote ? "" : quote;
        else if ((c === '"' || c === "'") && /[\s[{,:]/.test(body[k - 1] ?? " ")) quote = c;
        else if (c === "#" && /\s/.test(body[k - 1] ?? " ")) return body.slice(0, k).trimEnd().length;
    }
    return body.trimEnd().length;
}

const KEY = /^(?:"((?:[^"\\]|\\.)*)"|'((?:[^']|'')*)'|([^\s#{}[\],"'&*!|>%@`-][^#{}[\],]*?|-[^\s#{}[\],]+?))\s*:(?=\s|$)/;
const keyOf = (match) => match[1] ?? match[2] ?? match[3];

/* -- flow --------------------------------------------------------------------------------------------------- */

/* Behind blanks, ends of lines and comments. */
function skipBlanks(text, at) {
    for (;;) {
        while (at < text.length && /\s/.test(text[at])) at++;
        if (text[at] !== "#") return at;
        while (at < text.length && text[at] !== "\n") at++;
    }
}

function readFlowScalar(text, at) {
    const quote = text[at];
    let end = at;
    if (quote === '"' || quote === "'") {
        for (end = at + 1; end < text.length && text[end] !== quote; end++) if (quote === '"' && text[end] === "\\") end++;
        return { kind: "scalar", start: at, end: Math.min(end + 1, text.length) };
    }
    while (end < text.length && !/[,{}[\]]/.test(text[end]) && !(text[end] === ":" && /[\s,}\]]/.test(text[end + 1] ?? " ")) && !(text[end] === "#" && /\s/.test(text[end - 1]))) end++;
    while (end > at && /\s/.test(text[end - 1])) end--;
    return { kind: "scalar", start: at, end };
}

/* A value between brackets; one that does not end reaches to the end of the text. */
function readFlow(text, at) {
    if (text[at] !== "{" && text[at] !== "[") return readFlowScalar(text, at);
    const map = text[at] === "{", close = map ? "}" : "]", node = { kind: map ? "map" : "list", flow: true, start: at, entries: [] };
    for (at = skipBlanks(text, at + 1); at < text.length && text[at] !== close; at = skipBlanks(text, at)) {
        const first = readFlow(text, at), colon = skipBlanks(text, first.end);
        if (first.end === at && text[colon] !== ":" && text[colon] !== ",") break;
        if (map && text[colon] === ":") {
            const place = skipBlanks(text, colon + 1), none = /[,}]/.test(text[place] ?? "}");
            const value = none ? { kind: "empty", start: colon + 1, end: colon + 1 } : readFlow(text, place);
            node.entries.push({ key: text.slice(first.start, first.end).replace(/^(["'])(.*)\1$/s, "$2"), at: first.start, value });
            at = value.end;
        } else {
            node.entries.push({ key: String(node.entries.length), at: first.start, value: first });
            at = first.end;
        }
        at = skipBlanks(text, at);
        if (text[at] === ",") at++;
        else if (text[at] !== close) break;
    }
    return { ...node, end: Math.min(at + 1, text.length) };
}

/* -- blocks ------------------------------------------------------------------------------------------------- */

const endOfLine = (line) => line.offset + contentEnd(line.body);

/* The value behind the colon of a line: [node, number of the next line]. */
function readBlockValue(text, lines, k, column) {
    const line = lines[k], rest = line.body.slice(column, contentEnd(line.body, column));
    let next = k + 1, start = line.offset + column + (rest.length - rest.trimStart().length);
    if (!rest.trim()) {
        const below = lines[next], deeper = below && below.indent > line.indent, listed = below && below.indent === line.indent && below.body.trimStart().startsWith("- ");
        if (deeper && /^[{[]/.test(below.body.trimStart())) start = below.offset + below.indent;
        else if (deeper || listed) return readBlock(text, lines, next, below.indent);
        else return [{ kind: "empty", start: endOfLine(line), end: endOfLine(line) }, next];
    }
    const node = /^[{[]/.test(text[start]) ? readFlow(text, start) : { kind: "scalar", start, end: endOfLine(line) };
    while (next < lines.length && (lines[next].offset < node.end || lines[next].indent > line.indent)) {
        if (node.kind === "scalar") node.end = endOfLine(lines[next]);
        next++;
    }
    return [node, next];
}

/* A mapping or list whose lines have this indentation: [node, number of the next line]. */
function readBlock(text, lines, k, indent) {
    const first = lines[k], list = /^-(\s|$)/.test(first.body.trimStart()), node = { kind: list ? "list" : "map", flow: false, indent, start: first.offset + indent, end: endOfLine(first), entries: [] };
    while (k < lines.length && lines[k].indent === indent && /^-(\s|$)/.test(lines[k].body.trimStart()) === list) {
        const line = lines[k], match = list ? null : KEY.exec(line.body.slice(indent));
        let value, next;
        if (list) {
            for (next = k + 1; next < lines.length && lines[next].indent > indent; next++);
            value = { kind: "scalar", start: line.offset + indent + 2, end: endOfLine(lines[next - 1]) };
        } else if (match) {
            [value, next] = readBlockValue(text, lines, k, indent + match[0].length);
        } else {
            k++;
            continue;
        }
        node.entries.push({ key: list ? String(node.entries.length) : keyOf(match), at: line.offset + indent, value });
        node.end = Math.max(value.end, line.offset + indent);
        k = next;
    }
    while (k < lines.length && lines[k].indent > indent) k++;
    return [node, k];
}

/* The tree of a text: a map, also of an empty one. */
function readYaml(text) {
    const lines = contentLines(text);
    if (lines.length === 0) return { kind: "map", flow: false, indent: 0, start: text.length, end: text.length, entries: [] };
    if (/^[{[]/.test(lines[0].body.trimStart())) return readFlow(text, lines[0].offset + lines[0].indent);
    return readBlock(text, lines, 0, lines[0].indent)[0];
}

const entryOf = (node, key) => (node?.entries || []).find((entry) => entry.key === key);
const nodeAt = (node, path) => path.reduce((found, key) => entryOf(found, key)?.value, node);
const keysAt = (node, path) => (nodeAt(node, path)?.entries || []).map((entry) => entry.key);

/* -- changes ------------------------------------------------------------------------------------------------ */

const MOST_COLUMNS = 100;
const splice = (text, from, to, words) => text.slice(0, from) + words + text.slice(to);
const columnAt = (text, at) => at - (text.lastIndexOf("\n", at - 1) + 1);
const lineEndAt = (text, at) => (text.indexOf("\n", at) < 0 ? text.length : text.indexOf("\n", at));

/* The entry at the end of a mapping between braces, on a line of its own where it would become too long. */
function addToFlow(text, node, words) {
    if (node.entries.length === 0) return splice(text, node.start, node.end, `{${words}}`);
    const last = node.entries.at(-1).value.end, line = columnAt(text, last) + words.length + 3;
    const apart = line > MOST_COLUMNS ? `,\n${" ".repeat(columnAt(text, node.start) + 1)}` : ", ";
    return splice(text, last, last, apart + words);
}

function addToBlock(text, node, words) {
    const at = lineEndAt(text, node.end);
    return splice(text, at, at, `\n${" ".repeat(node.indent)}${words}`);
}

/* Sets the entry at a path, or adds it. `nest` gives the words of a mapping that is missing on the way. */
function putEntry(text, path, words, nest = (key, inner) => `${key}: {${inner}}`) {
    let node = readYaml(text);
    for (let k = 0; k < path.length; k++) {
        const entry = entryOf(node, path[k]), rest = path.slice(k + 1);
        if (entry && rest.length === 0) return splice(text, entry.value.start, entry.value.end, entry.value.kind === "empty" ? ` ${words}` : words);
        if (entry && entry.value.kind === "map") {
            node = entry.value;
            continue;
        }
        const inner = rest.reduceRight((inside, key) => (inside === null ? `${key}: ${words}` : nest(key, inside)), null);
        if (entry) return splice(text, entry.value.start, entry.value.end, `${entry.value.kind === "empty" ? " " : ""}{${inner}}`);
        const added = inner === null ? `${path[k]}: ${words}` : nest(path[k], inner);
        return node.flow ? addToFlow(text, node, added) : addToBlock(text, node, added);
    }
    return text;
}

/* Without the entry at a path, and without the line that it leaves empty. */
function dropEntry(text, path) {
    const node = nodeAt(readYaml(text), path.slice(0, -1)), entry = entryOf(node, path.at(-1));
    if (!entry) return text;
    if (!node.flow) return splice(text, entry.at - columnAt(text, entry.at), Math.min(lineEndAt(text, entry.value.end) + 1, text.length), "");
    const k = node.entries.indexOf(entry);
    if (node.entries.length === 1) return splice(text, node.start + 1, node.end - 1, "");
    return k > 0 ? splice(text, node.entries[k - 1].value.end, entry.value.end, "") : splice(text, entry.at, node.entries[1].at, "");
}

/* Without the entry at a path, and without the mappings that it leaves empty, of which comments stay. */
function dropWhole(text, path) {
    const left = dropEntry(text, path), above = nodeAt(readYaml(left), path.slice(0, -1));
    if (left === text) return text;
    return path.length > 1 && !above?.entries?.length ? dropWhole(left, path.slice(0, -1)) : withoutDoubleGap(left, differenceOf(text, left).from);
}

/* One empty line where a removal has left two. */
function withoutDoubleGap(text, at) {
    const from = text.slice(0, at).replace(/[ \t]*$/, "").length, before = /(^|\n)[ \t]*\n$/.test(text.slice(0, from)), after = /^[ \t]*(\n|$)/.exec(text.slice(from));
    return before && after && (after[0] || from === text.length) ? text.slice(0, from).replace(after[0] ? /$/ : /\n$/, "") + text.slice(from + after[0].length) : text;
}
