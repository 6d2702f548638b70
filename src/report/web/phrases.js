/* SPDX-License-Identifier: BSD-3-Clause */
/* Common functions of all pages: numbers as words, elements, light and dark, and the signal for external tests that all
 * is drawn. */
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

function fillList(list, sentences) {
    for (const sentence of sentences) list.append(element("li", sentence));
}

function headRow(names) {
    return element("tr", ...names.map((name) => element("th", name)));
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
    const context = small.getContext("2d");
    context.drawImage(canvas, 0, 0, 160, 160);
    const pixels = context.getImageData(0, 0, 160, 160).data;
    let different = 0;
    for (let k = 4; k < pixels.length; k += 4) {
        const away = Math.abs(pixels[k] - pixels[0]) + Math.abs(pixels[k + 1] - pixels[1]) + Math.abs(pixels[k + 2] - pixels[2]) + Math.abs(pixels[k + 3] - pixels[3]);
        if (away > 12) different++;
    }
    return different;
}

/* Redraws when colours change, and signals that all is drawn. */
function tellReady(recolourAll) {
    dark.addEventListener("change", recolourAll);
    window.addEventListener("beforeprint", () => {
        printing = true;
        recolourAll();
    });
    window.addEventListener("afterprint", () => {
        printing = false;
        recolourAll();
    });
    byId("maker").append(`Made by kempe ${data.kempe}. Drawn with three.js and Chart.js, both under the MIT License, whose text is in the source of this page.`);
    for (const canvas of document.querySelectorAll("canvas")) if (!canvas.closest("[hidden]")) canvas.dataset.ink = ink(canvas);
    document.documentElement.dataset.ready = "yes";
}
