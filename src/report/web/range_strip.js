/* SPDX-License-Identifier: BSD-3-Clause */
/* A long motion of many periods begins with its last ones. A strip shows which part of the whole range the curves have. */
"use strict";

/* More periods than these are one band of ink. Periods are alike if their lengths scatter by such a part. At least so many are shown,
 * with at least so many points. */
const MOST_PERIODS = 60, ALIKE = 0.15, FEWEST_PERIODS = 4, FEWEST_POINTS = 120;

/* The places at which a column rises through the middle of its values. */
function risesOf({ values, summary: [low, , high] }) {
    const middle = (low + high) / 2, found = [];
    for (let k = 1; k < values.length; k++) if (values[k - 1] < middle && values[k] >= middle) found.push(abscissa.values[k]);
    return found;
}

/* The mean length of the last periods of a column, and their scatter; null: there are few. */
function periodsOf(column) {
    const rises = risesOf(column).slice(-MOST_PERIODS);
    if (rises.length < MOST_PERIODS) return null;
    const times = rises.slice(1).map((x, k) => x - rises[k]), mean = times.reduce((a, b) => a + b) / times.length;
    return { mean, scatter: Math.sqrt(times.reduce((sum, x) => sum + (x - mean) ** 2, 0) / times.length) / mean };
}

/* The last periods of the column whose periods are most alike, as { range, count }; null: there are few, or they are not alike. */
function lastPeriods(list) {
    const found = list.map(periodsOf).filter(Boolean).sort((a, b) => a.scatter - b.scatter)[0], [first, last] = wholeRange();
    if (!found || found.scatter > ALIKE) return null;
    const step = (last - first) / (abscissa.values.length - 1), count = Math.max(FEWEST_PERIODS, Math.ceil((FEWEST_POINTS * step) / found.mean));
    return { range: [Math.max(last - count * found.mean, first), last], count };
}

const isVarying = (column) => constantOf(column, [column]) === null;

/* The range at first. */
function beginRange() {
    const last = abscissa.name === "t" && !series.scattered ? lastPeriods(drawn().filter(isVarying)) : null;
    if (last) {
        range = last.range;
        byId("curves-note").append(` The last ${last.count} periods are shown.`);
    }
    listenToStrip();
}

const STRIP = { width: 1000, height: 34 };

/* The curve that is drawn first, over the whole range, with a window at the range of the plots. */
function drawStrip() {
    const strip = byId("strip"), [first, last] = wholeRange(), own = drawn().filter(isVarying), column = own.find((each) => !revolves(each)) || own[0];
    strip.parentElement.hidden = over !== abscissa || series.scattered || !column || range.every((x, k) => x === wholeRange()[k]);
    if (strip.parentElement.hidden) return;
    const { width, height } = STRIP, [low, , high] = column.summary, across = (x) => (width * (x - first)) / (last - first);
    const points = Array.from(column.values, (y, k) => (isFinite(y) ? `${across(abscissa.values[k]).toFixed(1)},${(height - 3 - ((height - 6) * (y - low)) / (high - low)).toFixed(1)}` : "")).filter((p) => p);
    const [from, to] = range.map(across);
    strip.replaceChildren(
        drawn2d("path", { d: `M${points.join("L")}`, stroke: looks.get(column.name).colour, "stroke-width": 1, fill: "none", opacity: 0.55, "vector-effect": "non-scaling-stroke" }),
        drawn2d("rect", { x: from, y: 0, width: Math.max(to - from, 3), height, class: "window" }),
    );
    strip.dataset.window = `${digits(range[0])} ${digits(range[1])}`;
}

/* A range is dragged across the strip; a click moves the range there. */
function listenToStrip() {
    const strip = byId("strip"), [first, last] = wholeRange();
    const at = (event) => first + ((last - first) * (event.clientX - strip.getBoundingClientRect().left)) / strip.getBoundingClientRect().width;
    let from = null;
    strip.addEventListener("pointerdown", (event) => {
        from = event;
        strip.setPointerCapture(event.pointerId);
    });
    strip.addEventListener("pointerup", (event) => {
        if (!from) return;
        const half = (range[1] - range[0]) / 2, middle = Math.min(Math.max(at(event), first + half), last - half);
        zoom(Math.abs(event.clientX - from.clientX) > 4 ? [at(from), at(event)].sort((a, b) => a - b) : [middle - half, middle + half]);
        from = null;
    });
    strip.addEventListener("pointercancel", () => (from = null));
}
