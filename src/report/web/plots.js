/* SPDX-License-Identifier: BSD-3-Clause */
/* Plots of all pages: axes, curves, and a line over them for the time of the animation. */
"use strict";

/* -- plots -------------------------------------------------------------------------------------------------- */

const plots = {};

/* A colour for each of several bodies and curves, on light and on dark. */
const COLOURS = [
/*COLOURS*/
];
const curveColour = (k) => COLOURS[k % COLOURS.length][isDark() ? 1 : 0];

/* Of curves with one colour; of curve k, whose colour earlier ones have. */
const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3], [14, 4], [4, 2, 1, 2]];
const dashesOf = (rank) => DASHES[rank % DASHES.length];
const curveDashes = (k) => dashesOf(Math.floor(k / COLOURS.length));

/* The mark of a curve. */
function lineMark(colour, dashes) {
    const line = drawn2d("line", { x1: 0, y1: 4, x2: 26, y2: 4, "stroke-width": 3, stroke: colour, "stroke-dasharray": dashes.join(" ") });
    return drawn2d("svg", { class: "line", width: 26, height: 8, "aria-hidden": "true" }, line);
}

/* A curve without marks at its points. */
const curveOf = (points, colour, more) => ({ data: points, borderColor: colour, backgroundColor: colour, borderWidth: 1.6, pointRadius: 0, pointHitRadius: 6, ...more });

function axisOf(type, title, ticks, more) {
    return {
        type,
        title: { display: Boolean(title), text: title, color: softColour() },
        grid: { color: lineColour(), borderColor: lineColour(), tickColor: lineColour() },
        ticks: { color: softColour(), ...ticks },
        ...more,
    };
}

function drawPlot(id, datasets, scales, label) {
    if (plots[id]) plots[id].destroy();
    const canvas = byId(id);
    plots[id] = new Chart(canvas, {
        type: "line",
        data: { datasets },
        options: {
            animation: false,
            parsing: false,
            normalized: true,
            maintainAspectRatio: false,
            interaction: { mode: "nearest", intersect: false, axis: "xy" },
            scales,
            plugins: {
                legend: { display: false },
                tooltip: { displayColors: false, callbacks: { title: () => "", label } },
            },
        },
    });
    canvas.dataset.points = datasets.reduce((sum, set) => sum + set.data.filter((p) => isNumber(p.y)).length, 0);
    canvas.dataset.lines = datasets.length;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", canvas.closest("figure").querySelector("figcaption").textContent);
}

/* -- axes --------------------------------------------------------------------------------------------------- */

/* A logarithmic axis with its powers of ten, or 1, 2, 5 of them where it is short; not more than eight. */
function logAxis(low, high, title) {
    const decades = Math.log10(high / low), each = Math.max(1, Math.ceil(decades / 8));
    const ticks = (scale) => {
        const values = [];
        for (let k = Math.floor(Math.log10(scale.min)); k <= Math.ceil(Math.log10(scale.max)); k++)
            for (const part of decades < 2 ? [1, 2, 5] : [1])
                if (k % each === 0 || decades < 2) values.push(Number(`${part}e${k}`));
        scale.ticks = values.filter((x) => x >= scale.min * 0.999999 && x <= scale.max * 1.000001).map((value) => ({ value }));
    };
    const words = (x) => (x >= 10 && x < 1e5 && decades < 4 ? count(x) : decades < 2 ? three(x) : power(x));
    return axisOf("logarithmic", title, { callback: words }, { min: low, max: high, afterBuildTicks: ticks });
}

/* A number of an axis, with as many digits as distinguish it from the next one. */
function tickWords(x, ticks) {
    const apart = ticks.length > 1 ? Math.abs(ticks[1].value - ticks[0].value) : 0;
    const digits = apart > 0 && x !== 0 ? Math.ceil(Math.log10(Math.abs(x) / apart) - 1e-6) + 1 : 3;
    return digits > 3 ? String(Number(x.toPrecision(Math.min(digits, 12)))) : three(Number(x.toPrecision(8)));
}

/* A linear axis whose numbers have their unit. */
function evenAxis([low, high], unit) {
    const words = (x, _, ticks) => `${tickWords(x, ticks)} ${unit}`.trim();
    return axisOf("linear", "", { maxTicksLimit: 7, maxRotation: 0, callback: words }, { min: low, max: high });
}

/* The values of all points, with a little room; null when there are none. */
function rangeOf(values, room) {
    const positive = values.filter((x) => x > 1e-300 && isFinite(x)); /* below it room for the axis underflows */
    if (positive.length === 0) return null;
    let low = Infinity, high = 0;
    for (const x of positive) {
        low = Math.min(low, x);
        high = Math.max(high, x);
    }
    return [low / room, Math.max(high * room, low * 1.5)];
}

/* -- time --------------------------------------------------------------------------------------------------- */

/* The line of the moving picture's time, laid over the plots that have one, so that they need not be drawn again. */
function showCursor(t) {
    for (const id in plots) {
        const plot = plots[id], line = byId(id).parentElement.querySelector("i"), area = plot.chartArea;
        if (!line || !area) continue;
        const inside = t >= plot.scales.x.min && t <= plot.scales.x.max;
        line.style.display = inside ? "block" : "none";
        line.style.left = `${plot.scales.x.getPixelForValue(t)}px`;
        line.style.top = `${area.top}px`;
        line.style.height = `${area.bottom - area.top}px`;
    }
}

/* A range of a plot is chosen by dragging across it, a place by a click: choose(low, high), place(x). */
function listenToRange(canvas, plot, choose, place) {
    const mark = element("b"), valueAt = (x) => plot().scales.x.getValueForPixel(x - canvas.getBoundingClientRect().left);
    let from = null;
    canvas.parentElement.append(mark);
    canvas.addEventListener("pointerdown", (event) => {
        from = event.clientX;
        canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
        if (from === null) return;
        const left = canvas.getBoundingClientRect().left, area = plot().chartArea;
        mark.style.display = Math.abs(event.clientX - from) > 4 ? "block" : "none";
        mark.style.left = `${Math.min(event.clientX, from) - left}px`;
        mark.style.width = `${Math.abs(event.clientX - from)}px`;
        mark.style.top = `${area.top}px`;
        mark.style.height = `${area.bottom - area.top}px`;
    });
    canvas.addEventListener("pointerup", (event) => {
        mark.style.display = "none";
        if (from === null) return;
        if (Math.abs(event.clientX - from) > 4) choose(...[valueAt(from), valueAt(event.clientX)].sort((a, b) => a - b));
        else place(valueAt(event.clientX));
        from = null;
    });
    canvas.addEventListener("pointercancel", () => (from = null));
}
