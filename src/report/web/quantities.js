/* SPDX-License-Identifier: BSD-3-Clause */
/* Quantities of an ensemble: a histogram of each, and bars of what its scatter comes from (tornado). */
"use strict";

const FIGURE = { width: 360, height: 170, left: 8, right: 8, top: 10, bottom: 26 };
const MOST_BINS = 40, MOST_BARS = 8;

const figureNode = (height, label) => drawn2d("svg", { viewBox: `0 0 ${FIGURE.width} ${height}`, role: "img", "aria-label": label, class: "statistic" });

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
    const found = binsOf(values), { width, height, left, right, top, bottom } = FIGURE;
    const svg = figureNode(height, `Histogram of ${quantity.name}`);
    svg.id = `histogram-${number}`;
    if (!found) {
        svg.append(drawn2d("text", { x: left, y: height / 2 }, "all values are equal"));
        return svg;
    }
    for (const key of ["low", "high"]) svg.setAttribute(`data-${key}`, digits(found[key]));
    svg.setAttribute("data-bars", found.bins.join(" "));
    const most = Math.max(...found.bins), size = (width - left - right) / found.bins.length, floor = height - bottom;
    const placeOf = (x) => left + ((x - found.low) / (found.high - found.low)) * (width - left - right);
    found.bins.forEach((count, k) => {
        const tall = (count / most) * (floor - top);
        svg.append(drawn2d("rect", { x: left + k * size, y: floor - tall, width: Math.max(size - 1, 0.5), height: tall, class: "bar" }));
    });
    const marks = [[quantity.mean.value, "mean"], ...quantity.quantiles.filter((q) => q.part === 0.05 || q.part === 0.95).map((q) => [q.value, "part"])];
    for (const [x, kind] of marks)
        if (isNumber(x) && x >= found.low && x <= found.high) svg.append(drawn2d("line", { x1: placeOf(x), x2: placeOf(x), y1: top, y2: floor, class: kind }));
    svg.append(drawn2d("line", { x1: left, x2: width - right, y1: floor, y2: floor, class: "axis" }));
    svg.append(drawn2d("text", { x: left, y: height - 8 }, digits(found.low)), drawn2d("text", { x: width - right, y: height - 8, "text-anchor": "end" }, digits(found.high)));
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
        svg.append(drawn2d("text", { x: left, y: y + 12 }, c.input));
        svg.append(drawn2d("rect", { x: Math.min(middle, end), y, width: Math.abs(end - middle), height: row - 6, class: sobol ? "bar total" : "bar" }));
        if (sobol && c.first > 0) svg.append(drawn2d("rect", { x: middle, y, width: Math.min(c.first, x) * scale, height: row - 6, class: "bar" }));
        svg.append(drawn2d("text", { x: beside, y: y + 12, "text-anchor": x < 0 ? "end" : "start" }, x.toFixed(2)));
    });
    svg.append(drawn2d("line", { x1: middle, x2: middle, y1: top - 4, y2: height - 2, class: "axis" }));
    return svg;
}

function wordsOfQuantity(quantity, tornado) {
    const parts = [`mean ${digits(quantity.mean.value)} (${digits(quantity.mean.low)} to ${digits(quantity.mean.high)})`, `standard deviation ${digits(quantity.deviation.value)}`];
    const [low, high] = [0.05, 0.95].map((part) => quantity.quantiles.find((q) => q.part === part).value);
    parts.push(`5 to 95 %: ${digits(low)} to ${digits(high)}`);
    if (tornado) parts.push(quantity.groups > 0 ? "bars: Sobol's total index, its dark part of first order" : `bars: standardised regression coefficients, ${(100 * quantity.explained).toPrecision(3)} % of the variance`);
    return parts.join("; ") + ".";
}

function tellQuantities() {
    const given = data.statistics;
    byId("quantities").hidden = !given;
    if (!given) return;
    byId("quantities-note").append(`${given.used} of ${given.instances} instances; intervals have ${+(100 * given.confidence).toPrecision(4)} % confidence. Lines mark the mean, and the quantiles of 5 and 95 %.`);
    given.quantities.forEach((quantity, number) => {
        const column = columns.find((each) => each.name === quantity.name), figure = document.createElement("figure");
        const title = document.createElement("figcaption"), note = document.createElement("p"), tornado = tornadoOf(quantity, number);
        figure.className = "card";
        title.append(quantity.unit ? `${quantity.name}, ${quantity.unit}` : quantity.name);
        note.className = "note";
        note.append(wordsOfQuantity(quantity, tornado));
        figure.append(title);
        if (column) figure.append(histogramOf(quantity, column.values, number));
        if (tornado) figure.append(tornado);
        figure.append(note);
        byId("quantity-figures").append(figure);
    });
}
