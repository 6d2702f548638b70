/* SPDX-License-Identifier: BSD-3-Clause */
/* A run with wheels on rails: running safety in tables, forces of wheels with their limits, lateral positions, the track, and
 * ride comfort. */
"use strict";

const vehicleFigures = [];

/* A quantity in the unit of the page: { unit, factor } by its kind. */
const vehicleUnit = (kind) => data.vehicle.units[kind];
const inUnit = (kind, x) => (isNumber(x) ? x * vehicleUnit(kind).factor : x);

/* Points of a curve over time, or over the way along the track. */
const pointsOver = (x, y, factor) => x.map((at, k) => ({ x: at, y: y[k] === null ? NaN : y[k] * factor }));

const evenSteps = (from, to, count) => Array.from({ length: count }, (_, k) => from + ((to - from) * k) / (count - 1));

/* A figure with curves {name, points, dashed}; of limits that are equal one line remains. */
function vehicleFigure(place, id, title, unit, over, curves) {
    const canvas = element("canvas"), plot = element("div.plot", canvas, ...(over === "s" ? [element("i")] : [])), names = element("p.note.names");
    canvas.id = id;
    curves.forEach((curve, k) => {
        curve.number = curve.dashed ? null : k;
        names.append(element("span", lineMark(curve.dashed ? softColour() : curveColour(k), curve.dashed ? [6, 4] : curveDashes(k)), curve.name), " ");
    });
    place.append(element("figure.card", element("figcaption", title), plot, names));
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
        const lookOf = ({ dashed, number }) => (dashed ? [softColour(), [6, 4]] : [curveColour(number), curveDashes(number)]);
        const sets = curves.map((curve) => curveOf(curve.points, lookOf(curve)[0], { label: curve.name, borderDash: lookOf(curve)[1] }));
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

const fixed = (x, places) => (isNumber(x) ? x.toFixed(places) : "-");
/* "2 m" */
const wayOf = (metres) => `${three(inUnit("way", metres))} ${vehicleUnit("way").unit}`;
const keptCell = (kept) => element(kept === false ? "td.failed" : "td", kept === null ? "-" : kept ? "kept" : "not kept");

function safetyTables({ wheels, axles, mean_over, cutoff }) {
    const ofWheels = byId("vehicle-wheels"), ofAxles = byId("vehicle-axles"), over = wayOf(mean_over);
    const [force, wear] = ["force", "wear"].map((kind) => vehicleUnit(kind).unit);
    ofWheels.append(headRow(["wheel", `Q0, ${force}`, "(Q0-Q)/Q0", "at t, s", `at ${cutoff} Hz`, "largest Y/Q", `mean over ${over}`, "at t, s", "Nadal's limit", `flange, ${vehicleUnit("angle").unit}`, "friction", "verdict", `mean T\u03b3, ${wear}`, `largest T\u03b3, ${wear}`]));
    for (const w of wheels) {
        const loads = [fixed(inUnit("force", w.Q0), 2), fixed(w.unloading.value, 3), fixed(w.unloading.t, 3), fixed(w.unloading_filtered.value, 3)];
        const ratios = [fixed(w.YQ.value, 3), fixed(w.YQ_mean.value, 3), fixed(w.YQ_mean.t, 3), fixed(w.nadal, 3), fixed(inUnit("angle", w.flange_angle), 2), fixed(w.friction, 2)];
        ofWheels.append(rowOf(w.name, ...loads, ...ratios, keptCell(w.kept), fixed(inUnit("wear", w.wear_mean), 2), fixed(inUnit("wear", w.wear.value), 1)));
    }
    ofAxles.parentElement.hidden = axles.length === 0;
    ofAxles.append(headRow(["axle", `sum of Y, mean over ${over}, ${force}`, "at t, s", `Prud'homme's limit, ${force}`, "verdict"]));
    axles.forEach((a, k) => ofAxles.append(rowOf(data.vehicle.axles[k].name, fixed(inUnit("force", a.Y_mean.value), 2), fixed(a.Y_mean.t, 3), fixed(inUnit("force", a.prudhomme), 2), keptCell(a.kept))));
}

function comfortTable({ signals, window, windows, mean_comfort }) {
    const table = byId("vehicle-comfort");
    byId("comfort").hidden = !signals;
    if (!signals) return;
    table.append(headRow(["direction", "acceleration", "weighting", `RMS, ${vehicleUnit("acceleration").unit}`, "weighted", "95 % of windows", "largest window", "Wz"]));
    for (const c of signals) table.append(rowOf(c.direction, c.name, c.weighting, ...[c.rms, c.weighted, c.percentile_95, c.largest].map((x) => fixed(inUnit("acceleration", x), 4)), fixed(c.Wz, 3)));
    const words = mean_comfort.map((value) => value.toFixed(3)).join(", ");
    byId("comfort-note").append(`Weightings of EN 12299 in ${windows} windows of ${window} s from the start of the run.${words ? ` Mean comfort N_MV: ${words}.` : ""}`);
}

function trackFigures(vehicle, place) {
    const way = vehicleUnit("way");
    for (const track of vehicle.tracks) {
        const waves = ["alignment", "level", "cross", "gauge"].filter((name) => track[name]);
        const curve = (name, kind) => ({ name, points: pointsOver(evenSteps(track.from * way.factor, track.to * way.factor, track[name].length), track[name], vehicleUnit(kind).factor) });
        const figure = (id, words, kind, names) => vehicleFigure(place, `${id}-${track.name}`, `${words} of track ${track.name}${id === "curvature" ? ", to the left" : ""}, over its arc length`, vehicleUnit(kind).unit, way.unit, names.map((name) => curve(name, kind)));
        if (waves.length > 0) figure("irregularities", "Irregularities", "aside", waves);
        if (track.curvature) figure("curvature", "Curvature", "curvature", ["curvature"]);
        if (track.cant) figure("cant", "Cant angle", "angle", ["cant"]);
    }
}

function writeVehicle() {
    const { vehicle, running_safety: safety } = data, place = byId("vehicle-figures");
    byId("vehicle").hidden = !vehicle;
    if (!vehicle) return;
    const { t, stride } = vehicle, ends = [t[0], t[t.length - 1]], { wheels, mean_over } = safety;
    const factorOf = (kind) => (kind ? vehicleUnit(kind).factor : 1), [force, wear, aside] = ["force", "wear", "aside"].map((kind) => vehicleUnit(kind).unit);
    const each = (key, kind) => vehicle.wheels.map((w, k) => ({ name: wheels[k].name, points: pointsOver(t, w[key], factorOf(kind)) }));
    const axles = (key, kind) => vehicle.axles.map((a) => ({ name: a.name, points: pointsOver(t, a[key], factorOf(kind)) }));
    byId("vehicle-note").append(`${wayOf(safety.way)} of way. Q0, the static wheel load: ${vehicle.loads}${isNumber(safety.carried) ? `, together ${safety.carried.toFixed(3)} of the weight` : ""}. With every other of ${count(safety.samples)} samples values differ by ${safety.difference.toExponential(1)}.${stride > 1 ? ` One of ${stride} samples is drawn.` : ""}`);
    safetyTables(safety);
    vehicleFigure(place, "vehicle-q", "Wheel load Q", force, "s", each("Q", "force"));
    vehicleFigure(place, "vehicle-y", "Lateral force Y, outwards", force, "s", each("Y", "force"));
    if (wheels.some((w) => isNumber(w.YQ_mean.value))) vehicleFigure(place, "vehicle-ratio", `Y/Q, mean over ${wayOf(mean_over)}`, "", "s", [...each("means", null), ...limitLines(wheels.map((w) => [w.name, w.nadal]), ends, 1)]);
    if (safety.axles.some((a) => isNumber(a.Y_mean.value))) {
        const limits = [1, -1].flatMap((side) => limitLines(safety.axles.map((a, k) => [vehicle.axles[k].name, side * a.prudhomme]), ends, factorOf("force")));
        vehicleFigure(place, "vehicle-sum", `Sum of Y of an axle to the left, mean over ${wayOf(mean_over)}`, force, "s", [...axles("sums", "force"), ...limits]);
    }
    vehicleFigure(place, "vehicle-wear", "Wear number T\u03b3 of wheels, from creep forces and creepages", wear, "s", each("wear", "wear"));
    if (safety.axles.length > 0) vehicleFigure(place, "vehicle-aside", "Lateral position of axles on the track, to the left", aside, "s", axles("aside", "aside"));
    trackFigures(vehicle, place);
    comfortTable(vehicle.comfort);
}
