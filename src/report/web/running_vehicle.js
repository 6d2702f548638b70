/* SPDX-License-Identifier: BSD-3-Clause */
/* A run with wheels on rails: running safety in tables, forces of wheels with their limits, lateral positions, the track, and
 * ride comfort. */
"use strict";

const vehicleFigures = [];

/* Points of a curve over time, or over the way along the track. */
const pointsOver = (x, y, factor) => x.map((at, k) => ({ x: at, y: y[k] === null ? NaN : y[k] * factor }));

const evenSteps = (from, to, count) => Array.from({ length: count }, (_, k) => from + ((to - from) * k) / (count - 1));

/* A figure with curves {name, points, dashed}; of limits that are equal one line remains. */
function vehicleFigure(place, id, title, note, unit, over, curves) {
    const canvas = element("canvas"), plot = element("div.plot", canvas, ...(over === "s" ? [element("i")] : [])), names = element("p.note.names");
    canvas.id = id;
    curves.forEach((curve, k) => {
        const swatch = element("span.swatch");
        curve.number = curve.dashed ? null : k;
        swatch.style.background = curve.dashed ? softColour() : markOf(curveColour(k), curveDashes(k));
        names.append(element("span", swatch, curve.name), " ");
    });
    place.append(element("figure.card", element("figcaption", title), plot, names, ...(note ? [element("p.note", note)] : [])));
    const [low, high] = shownRange(curves), all = curves.flatMap((curve) => curve.points.map((p) => p.y)).filter(isFinite);
    if (isNumber(low)) place.lastChild.append(element("p.note", `A few values are outside the picture: the least is ${three(all.reduce((a, b) => Math.min(a, b)))} ${unit}, the largest ${three(all.reduce((a, b) => Math.max(a, b)))} ${unit}.`));
    vehicleFigures.push({ id, unit, over, curves });
}

/* The axis leaves out a few values that are far from all others, as those of the first instants of a run. */
function shownRange(curves) {
    const values = curves.filter((curve) => !curve.dashed).flatMap((curve) => curve.points.map((p) => p.y)).filter(isFinite).sort((a, b) => a - b);
    if (values.length < 200 || curves.some((curve) => curve.dashed)) return [undefined, undefined];
    const at = (part) => values[Math.round(part * (values.length - 1))], room = 0.15 * (at(0.995) - at(0.005));
    const far = at(1) - at(0) > 3 * (at(0.995) - at(0.005)) && room > 0;
    return far ? [Math.max(at(0), at(0.005) - room), Math.min(at(1), at(0.995) + room)] : [undefined, undefined];
}

function drawVehicle() {
    for (const { id, unit, over, curves } of vehicleFigures) {
        const sets = curves.map((curve) => ({
            label: curve.name,
            data: curve.points,
            borderColor: curve.dashed ? softColour() : curveColour(curve.number),
            borderDash: curve.dashed ? [6, 4] : curveDashes(curve.number),
            borderWidth: 1.5,
            pointRadius: 0,
        }));
        const [low, high] = shownRange(curves);
        const x = curves.flatMap((curve) => [curve.points[0].x, curve.points[curve.points.length - 1].x]);
        const scales = { x: evenAxis([Math.min(...x), Math.max(...x)], over), y: evenAxis([low, high], unit) };
        drawPlot(id, sets, scales, (item) => `${item.dataset.label}: ${three(item.parsed.y)} ${unit} at ${three(item.parsed.x)} ${over}`);
    }
}

/* One dashed line for each different limit. */
function limitLines(limits, range, factor) {
    const found = new Map();
    for (const [name, limit] of limits) if (isNumber(limit)) found.set(limit.toPrecision(4), [...(found.get(limit.toPrecision(4)) || []), name]);
    return [...found].map(([limit, names]) => ({
        name: names.length === limits.length ? `limit ${three(limit * factor)}` : `limit ${three(limit * factor)} of ${names.join(", ")}`,
        points: range.map((x) => ({ x, y: limit * factor })),
        dashed: true,
    }));
}

const verdictCell = (value, limit) => element(value > limit ? "td.failed" : "td", !isNumber(value) || !isNumber(limit) ? "-" : value <= limit ? "kept" : "not kept");

const fixed = (x, places) => (isNumber(x) ? x.toFixed(places) : "-");

function safetyTables(vehicle) {
    const wheels = byId("vehicle-wheels"), axles = byId("vehicle-axles");
    wheels.append(headRow(["wheel", "Q0, kN", "(Q0-Q)/Q0", "at t, s", `at ${vehicle.cutoff} Hz`, "largest Y/Q", `mean over ${vehicle.mean_over} m`, "at t, s", "Nadal's limit", "flange, deg", "friction", "verdict", "mean T\u03b3, J/m", "largest T\u03b3, J/m"]));
    for (const w of vehicle.wheels)
        wheels.append(element("tr", element("td", w.name), ...[fixed(w.load / 1e3, 2), fixed(w.unloading, 3), fixed(w.unloading_t, 3), fixed(w.smooth, 3), fixed(w.ratio, 3), fixed(w.mean, 3), fixed(w.mean_t, 3), fixed(w.nadal, 3), fixed((w.flange * 180) / Math.PI, 2), fixed(w.friction, 2)].map((words) => element("td", words)), verdictCell(w.mean, w.nadal), ...[fixed(w.wear, 2), fixed(w.most_wear, 1)].map((words) => element("td", words))));
    axles.parentElement.hidden = vehicle.axles.length === 0;
    axles.append(headRow(["axle", `sum of Y, mean over ${vehicle.mean_over} m, kN`, "at t, s", "Prud'homme's limit, kN", "verdict"]));
    for (const a of vehicle.axles) axles.append(element("tr", element("td", a.name), ...[fixed(a.mean / 1e3, 2), fixed(a.mean_t, 3), fixed(a.limit / 1e3, 2)].map((words) => element("td", words)), verdictCell(a.mean, a.limit)));
}

function comfortTable(vehicle) {
    const table = byId("vehicle-comfort");
    byId("comfort").hidden = vehicle.comfort.length === 0;
    if (vehicle.comfort.length === 0) return;
    table.append(headRow(["direction", "acceleration", "weighting", "RMS, m/s^2", "weighted", "95 % of windows", "largest window", "Wz"]));
    for (const c of vehicle.comfort)
        table.append(element("tr", ...[c.direction, c.name, c.weighting, fixed(c.rms, 4), fixed(c.weighted, 4), fixed(c.percentile, 4), fixed(c.largest, 4), fixed(c.Wz, 3)].map((words) => element("td", words))));
    const words = vehicle.mean_comfort.map((value) => value.toFixed(3)).join(", ");
    byId("comfort-note").append(`Weightings of EN 12299 in ${vehicle.comfort[0].windows.length} windows of 5 s from the start of the run.${words ? ` Mean comfort N_MV: ${words}.` : ""}`);
}

function trackFigures(vehicle, place) {
    for (const track of vehicle.tracks) {
        const waves = ["alignment", "level", "cross", "gauge"].filter((name) => track[name]);
        const curve = (name, factor, words) => ({ name: words, points: pointsOver(evenSteps(track.from, track.to, track[name].length), track[name], factor) });
        if (waves.length > 0) vehicleFigure(place, `irregularities-${track.name}`, `Irregularities of track ${track.name}, over its arc length`, "", "mm", "m", waves.map((name) => curve(name, 1e3, name)));
        if (track.curvature) vehicleFigure(place, `curvature-${track.name}`, `Curvature of track ${track.name}, to the left, over its arc length`, "", "1/km", "m", [curve("curvature", 1e3, "curvature")]);
        if (track.cant) vehicleFigure(place, `cant-${track.name}`, `Cant angle of track ${track.name}, over its arc length`, "", "deg", "m", [curve("cant", 180 / Math.PI, "cant")]);
    }
}

function tellVehicle() {
    const vehicle = data.vehicle, place = byId("vehicle-figures");
    byId("vehicle").hidden = !vehicle;
    if (!vehicle) return;
    const { t, wheels, axles } = vehicle, ends = [t[0], t[t.length - 1]], each = (key, factor) => wheels.map((w) => ({ name: w.name, points: pointsOver(t, w[key], factor) }));
    byId("vehicle-note").append(`${three(vehicle.way)} m of way. Q0, the static wheel load: ${vehicle.loads}${isNumber(vehicle.carried) ? `, together ${vehicle.carried.toFixed(3)} of the weight` : ""}. With every other of ${count(vehicle.samples)} samples values differ by ${vehicle.difference.toExponential(1)}.${vehicle.stride > 1 ? ` One of ${vehicle.stride} samples is drawn.` : ""}`);
    safetyTables(vehicle);
    vehicleFigure(place, "vehicle-q", "Wheel load Q", "", "kN", "s", each("Q", 1e-3));
    vehicleFigure(place, "vehicle-y", "Lateral force Y, outwards", "", "kN", "s", each("Y", 1e-3));
    if (wheels.some((w) => isNumber(w.mean))) vehicleFigure(place, "vehicle-ratio", `Y/Q, mean over ${vehicle.mean_over} m`, "", "", "s", [...each("means", 1), ...limitLines(wheels.map((w) => [w.name, w.nadal]), ends, 1)]);
    if (axles.some((a) => isNumber(a.mean))) {
        const limits = [1, -1].flatMap((side) => limitLines(axles.map((a) => [a.name, side * a.limit]), ends, 1e-3));
        vehicleFigure(place, "vehicle-sum", `Sum of Y of an axle to the left, mean over ${vehicle.mean_over} m`, "", "kN", "s", [...axles.map((a) => ({ name: a.name, points: pointsOver(t, a.sums, 1e-3) })), ...limits]);
    }
    vehicleFigure(place, "vehicle-wear", "Wear number T\u03b3 of wheels, from creep forces and creepages", "", "J/m", "s", each("wear_numbers", 1));
    if (axles.length > 0) vehicleFigure(place, "vehicle-aside", "Lateral position of axles on the track, to the left", "", "mm", "s", axles.map((a) => ({ name: a.name, points: pointsOver(t, a.aside, 1e3) })));
    trackFigures(vehicle, place);
    comfortTable(vehicle);
}
