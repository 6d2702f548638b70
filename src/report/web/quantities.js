/* SPDX-License-Identifier: BSD-3-Clause */
/* Quantities of an ensemble: a histogram of each, and bars of what its scatter comes from (tornado). */
"use strict";

const FIGURE = { width: 360, height: 170, left: 8, right: 8, top: 10, bottom: 26 };
const MOST_BINS = 40, MOST_BARS = 8;

const figureNode = (height, label) => drawn2d("svg", { viewBox: `0 0 ${FIGURE.width} ${height}`, role: "img", "aria-label": label, class: "diagram" });

/* Numbers of values in equal intervals from the least to the largest, as many as the square root of the values. */
function binsOf(values) {
    const known = Array.from(values).filter(Number.isFinite);
    const low = Math.min(...known), high = Math.max(...known);
    if (known.length < 2 || !(high > low)) return null;
    const count = Math.min(Math.max(Math.ceil(Math.sqrt(known.length)), 5), MOST_BINS), bins = new Array(count).fill(0);
    for (const x of known) bins[Math.min(Math.floor(((x - low) / (high - low)) * count), count - 1)]++;
    return { low, high, bins };
}

/* With the mean, and the quantiles of 5 and 95 %. */
function histogramOf(quantity, values, number) {
    const found = binsOf(values), { width, height } = FIGURE, place = { left: FIGURE.left, right: width - FIGURE.right, top: FIGURE.top, foot: height - FIGURE.bottom };
    const { left, right, top, foot } = place, svg = figureNode(height, `Histogram of ${quantity.name}`);
    svg.id = `histogram-${number}`;
    if (!found) {
        svg.append(label2d("all values are equal", left, height / 2, "start"));
        return svg;
    }
    for (const key of ["low", "high"]) svg.setAttribute(`data-${key}`, digits(found[key]));
    svg.setAttribute("data-bars", found.bins.join(" "));
    const placeOf = (x) => left + ((x - found.low) / (found.high - found.low)) * (right - left);
    const marks = [[quantity.mean.value, "mean"], ...quantity.quantiles.filter((q) => q.part === 0.05 || q.part === 0.95).map((q) => [q.value, "part"])];
    const inside = marks.filter(([x]) => isNumber(x) && x >= found.low && x <= found.high);
    svg.append(...bars2d(found.bins, place, 1), ...inside.map(([x, kind]) => drawn2d("line", { x1: placeOf(x), x2: placeOf(x), y1: top, y2: foot, class: kind })));
    svg.append(drawn2d("line", { x1: left, x2: right, y1: foot, y2: foot, class: "axis" }));
    svg.append(label2d(digits(found.low), left, height - 8, "start"), label2d(digits(found.high), right, height - 8, "end"));
    return svg;
}

/* Bars of the total indices of Sobol with the first-order part in them, or of the coefficients of regression. */
function tornadoOf(quantity, number) {
    const sobol = quantity.groups > 0, value = (c) => (sobol ? c.total : c.regression);
    const known = quantity.contributions.filter((c) => isNumber(value(c))).sort((a, b) => Math.abs(value(b)) - Math.abs(value(a))).slice(0, MOST_BARS);
    if (known.length === 0) return null;
    const row = 22, { width, left, right, top } = FIGURE, name = 110, height = top + row * known.length + 6;
    const svg = figureNode(height, `Contributions to ${quantity.name}`);
    svg.id = `contributions-${number}`;
    svg.setAttribute("data-bars", known.map((c) => `${c.input} ${value(c).toFixed(2)}`).join(", "));
    const most = Math.max(...known.map((c) => Math.abs(value(c))), 1e-12);
    const middle = sobol ? name : (name + width - right) / 2, scale = (sobol ? width - right - 46 - name : (width - right - name) / 2 - 46) / most;
    known.forEach((c, k) => {
        const y = top + k * row, x = value(c), end = middle + x * scale, beside = x < 0 ? end - 4 : Math.max(end, middle) + 4;
        svg.append(label2d(c.input, left, y + 12, "start"));
        svg.append(drawn2d("rect", { x: Math.min(middle, end), y, width: Math.abs(end - middle), height: row - 6, class: sobol ? "bar total" : "bar" }));
        if (sobol && c.first > 0) svg.append(drawn2d("rect", { x: middle, y, width: Math.min(c.first, x) * scale, height: row - 6, class: "bar" }));
        svg.append(label2d(x.toFixed(2), beside, y + 12, x < 0 ? "end" : "start"));
    });
    svg.append(drawn2d("line", { x1: middle, x2: middle, y1: top - 4, y2: height - 2, class: "axis" }));
    return svg;
}

function wordsOfQuantity(quantity, tornado) {
    const parts = [`mean ${digits(quantity.mean.value)}` + (isNumber(quantity.mean.low) ? ` (${digits(quantity.mean.low)} to ${digits(quantity.mean.high)})` : ""), `standard deviation ${digits(quantity.deviation.value)}`];
    const [low, high] = [0.05, 0.95].map((part) => quantity.quantiles.find((q) => q.part === part).value);
    parts.push(`5 to 95 %: ${digits(low)} to ${digits(high)}`);
    if (tornado) parts.push(quantity.groups > 0 ? "bars: Sobol's total index, its dark part of first order" : `bars: standardised regression coefficients, ${(100 * quantity.explained).toPrecision(3)} % of the variance`);
    return parts.join("; ") + ".";
}

function writeQuantities() {
    const given = data.statistics;
    byId("quantities").hidden = !given;
    if (!given) return;
    byId("quantities-note").append(`${given.used} of ${given.instances} instances; intervals have ${+(100 * given.confidence).toPrecision(4)} % confidence. Lines mark the mean, and the quantiles of 5 and 95 %.`);
    given.quantities.forEach((quantity, number) => {
        const column = columns.find((each) => each.name === quantity.name), tornado = tornadoOf(quantity, number);
        const pictures = [column && histogramOf(quantity, column.values, number), tornado].filter(Boolean);
        byId("quantity-figures").append(element("figure.card", element("figcaption", withUnit(quantity)), ...pictures, element("p.note", wordsOfQuantity(quantity, tornado))));
    });
}
