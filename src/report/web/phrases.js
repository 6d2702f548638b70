/* SPDX-License-Identifier: BSD-3-Clause */
/* Common functions of all pages: numbers as words, elements, light and dark, what a page begins with, and the signal for
 * external tests that all is drawn. */
"use strict";

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const isNumber = (x) => typeof x === "number";

/* -- numbers ------------------------------------------------------------------------------------------------ */

function superscript(whole) {
    return String(whole).replace(/./g, (c) => (c === "-" ? "\u207b" : "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[c]));
}

/* 3.6e-8 as printed in running text. */
function power(x) {
    const [digits, exponent] = x.toExponential(1).split("e");
    const rest = digits.replace(/\.0$/, "");
    if (x === 0 || (x >= 0.01 && x < 1000)) return String(Number(x.toPrecision(2)));
    return (rest === "1" ? "" : rest + "\u00b7") + "10" + superscript(Number(exponent));
}

function short(x, digits) {
    return isNumber(x) ? (x === 0 ? "0" : x.toExponential(digits === undefined ? 1 : digits).replace("e+", "e")) : "";
}

/* Tolerances as they are typed. */
const tolerance = (x) => x.toExponential();

function three(x) {
    if (x < 0) return "-" + three(-x);
    return x >= 1000 || (x > 0 && x < 0.001) ? x.toPrecision(3).replace("e+", "e") : String(Number(x.toPrecision(3)));
}

function duration(seconds) {
    if (seconds >= 60) return three(seconds / 60) + " min";
    if (seconds >= 1) return three(seconds) + " s";
    return three(1e3 * seconds) + " ms";
}

function ratio(x) {
    return (x >= 99.5 ? Math.round(x).toLocaleString("en").replace(/,/g, "\u202f") : x.toPrecision(2).replace(/\.0$/, "")) + "\u00d7";
}

/* As many digits as a table has room for. */
function digits(x, most = 6) {
    if (!isNumber(x) || !isFinite(x)) return "\u2013";
    return x !== 0 && (Math.abs(x) < 1e-3 || Math.abs(x) >= 1e7) ? x.toExponential(most - 1).replace(/\.?0+e/, "e") : String(Number(x.toPrecision(most)));
}

const count = (x) => String(x).replace(/\B(?=(\d{3})+$)/g, "\u202f");

/* -- elements ----------------------------------------------------------------------------------------------- */

/* element("td.best", "12") */
function element(kind, ...children) {
    const [tag, ...classes] = kind.split(".");
    const made = document.createElement(tag);
    if (classes.length > 0) made.className = classes.join(" ");
    made.append(...children);
    return made;
}

/* A row of a table; words become cells. */
const rowOf = (...cells) => element("tr", ...cells.map((cell) => (cell instanceof Node ? cell : element("td", cell))));

/* The mark before something, in its colour. */
function swatchOf(background) {
    const made = element("span.swatch");
    made.style.background = background;
    return made;
}

function buttonOf(words, pressed, press) {
    const made = element("button", ...[words].flat());
    made.type = "button";
    made.setAttribute("aria-pressed", String(pressed));
    made.addEventListener("click", press);
    return made;
}

function optionOf(words, value) {
    const made = element("option", words);
    made.value = value;
    return made;
}

function fillList(list, sentences) {
    for (const sentence of sentences) list.append(element("li", sentence));
}

function headRow(names) {
    return element("tr", ...names.map((name) => element("th", name)));
}

/* -- vector graphics ---------------------------------------------------------------------------------------- */

/* The name space, as the browser gives it to a parsed element. */
const SVG_SPACE = Object.assign(document.createElement("div"), { innerHTML: "<svg></svg>" }).firstChild.namespaceURI;

function drawn2d(tag, attributes, ...children) {
    const made = document.createElementNS(SVG_SPACE, tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
}

/* `anchor`: the part of the text that is at the place, "start", "middle" or "end". */
const label2d = (text, x, y, anchor, more) => drawn2d("text", { x, y, "text-anchor": anchor, ...more }, text);

/* Bars of a histogram that stand side by side from left to right, `room` apart; the largest number reaches the top. */
function bars2d(numbers, { left, right, top, foot }, room) {
    const wide = (right - left) / numbers.length, most = Math.max(...numbers);
    const bar = (n, k) => ({ class: "bar", x: left + k * wide + room / 2, y: foot - ((foot - top) * n) / most, width: Math.max(wide - room, 0.5), height: ((foot - top) * n) / most });
    return numbers.map((n, k) => drawn2d("rect", bar(n, k)));
}

/* -- data --------------------------------------------------------------------------------------------------- */

function bytesOf(text) {
    const letters = atob(text), bytes = new Uint8Array(letters.length);
    for (let k = 0; k < bytes.length; k++) bytes[k] = letters.charCodeAt(k);
    return bytes.buffer;
}

const shortsOf = (given) => (typeof given === "string" ? new Int16Array(bytesOf(given)) : given);
const floatsOf = (text) => new Float32Array(bytesOf(text));

/* The entries before and behind x in a list that ascends or descends, and the part of the way between them. */
function placeIn(list, x) {
    let low = 0, high = list.length - 1;
    const up = list[high] >= list[0];
    while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (list[middle] <= x === up) low = middle;
        else high = middle;
    }
    const range = list[high] - list[low];
    return [low, high, range !== 0 ? Math.min(Math.max((x - list[low]) / range, 0), 1) : 0];
}

/* -- light and dark ----------------------------------------------------------------------------------------- */

const dark = window.matchMedia("(prefers-color-scheme: dark)");
let printing = false;

const isDark = () => dark.matches && !printing;

const styleOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const inkColour = () => (printing ? "#222222" : styleOf("--ink"));
const softColour = () => (printing ? "#444444" : styleOf("--soft"));
const lineColour = () => (printing ? "#cccccc" : styleOf("--line"));

/* -- drawn --------------------------------------------------------------------------------------------------- */

/* The number of a canvas' pixels that differ from the one in its corner: for external tests. */
function ink(canvas) {
    const small = document.createElement("canvas");
    small.width = small.height = 160;
    const context = small.getContext("2d", { willReadFrequently: true });
    context.drawImage(canvas, 0, 0, 160, 160);
    const pixels = context.getImageData(0, 0, 160, 160).data;
    let different = 0;
    for (let k = 4; k < pixels.length; k += 4) {
        const away = Math.abs(pixels[k] - pixels[0]) + Math.abs(pixels[k + 1] - pixels[1]) + Math.abs(pixels[k + 2] - pixels[2]) + Math.abs(pixels[k + 3] - pixels[3]);
        if (away > 12) different++;
    }
    return different;
}

/* A mark for each end of a result, that is clear without its colour. */
const MARKS = { complete: "\u2713", "complete, not checked": "\u25cb", "not trustworthy": "\u26a0\ufe0e", stopped: "\u25a0", failed: "\u2715" };

/* Without the zeros of an exponent. */
const neat = (text) => text.replace(/e([+-])0*(\d)/g, (_, sign, digit) => `e${sign === "-" ? sign : ""}${digit}`);
const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1);

function factOf({ name, value, limit, beyond }) {
    const kept = limit ? [element(beyond ? "i.beyond" : "i.kept", beyond ? MARKS.failed : MARKS.complete), " "] : [];
    return element(beyond ? "div.beyond" : "div", element("dt", name), element("dd", ...kept, neat(value)), ...(limit ? [element("dt", `limit ${neat(limit)}`)] : []));
}

/* The top of the page: elements of the answer, facts { name, value, limit, beyond }, and sentences. */
function writeHead(answer, facts, sentences) {
    const mark = element("span.mark", MARKS[data.status]);
    mark.setAttribute("aria-hidden", "true");
    byId("verdict").dataset.status = data.status;
    byId("model").append(data.model);
    byId("scene").append(data.scene);
    byId("command").append(`kempe ${data.command}`);
    byId("answer").append(mark, ...answer);
    byId("facts").append(...facts.map(factOf));
    byId("facts").hidden = facts.length === 0;
    fillList(byId("because"), [data.reason, ...sentences].filter((text) => text).map((text) => neat(sentence(text))));
    byId("because").hidden = byId("because").children.length === 0;
}

let stage = null; /* the moving picture; null: there is none */

/* Draws all plots, and again when colours change; begins the picture (beginStage); signals that all is drawn. */
function drawPage(drawAll, picture, ask) {
    const recolour = () => {
        drawAll();
        if (stage) stage.recolour();
    };
    const print = (on) => {
        printing = on;
        recolour();
    };
    Chart.defaults.font.family = getComputedStyle(document.body).fontFamily;
    drawAll();
    stage = beginStage(picture, ask);
    dark.addEventListener("change", recolour);
    window.addEventListener("beforeprint", () => print(true));
    window.addEventListener("afterprint", () => print(false));
    byId("maker").append(`Made by kempe ${data.kempe}. Drawn with three.js and Chart.js, both under the MIT License, whose text is in the source of this page.`);
    for (const canvas of document.querySelectorAll("canvas")) if (!canvas.closest("[hidden]")) canvas.dataset.ink = ink(canvas);
    document.documentElement.dataset.ready = "yes";
}
