/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces in joints, gears, contacts, tyres and ropes as arrows over the picture, on the bodies of their colours. All have one scale,
 * in the picture's corner. */
"use strict";

/* Of the smaller side of the picture: the length of a usual force, and of the longest arrow. More arrows than these are drawn only by choice. */
const USUAL_LENGTH = 0.25, FEW_ARROWS = 12;
let forces = data.picture && data.picture.arrows ? readForces(data.picture.arrows) : null;

/* `usual`: what the largest force exceeds at one of twenty instants, or a quarter of the largest of all. A row without a point in a
 * body has a place in each instant. */
function readForces(given) {
    const x = floatsOf(given.x), parts = shortsOf(given.parts), places = shortsOf(given.places), count = given.rows.length;
    let moving = 0;
    const shared = data.reactions ? data.reactions.rows.filter((row) => row[data.reactions.columns.indexOf("unique")] === 0).map((row) => row[data.reactions.columns.indexOf("joint")]) : [];
    const rows = given.rows.map((row, k) => ({ ...row, k, moves: row.at ? -1 : moving++, shared: row.kind === "joints" && shared.includes(row.name) }));
    const triple = (list, most, k) => [0, 1, 2].map((i) => (most / 32767) * list[3 * k + i]);
    const at = (k, row) => triple(parts, given.most, k * count + row.k), placeAt = (k, row) => triple(places, given.farthest, k * moving + row.moves);
    const largest = Array.from(x, (_, k) => Math.max(...rows.map((row) => norm(at(k, row))))).sort((a, b) => a - b);
    const usual = Math.max(largest[Math.floor(0.95 * largest.length)] ?? 0, largest[largest.length - 1] / 4);
    return { ...given, rows, x, at, placeAt, usual, shown: usual > 0 && count <= FEW_ARROWS };
}

/* The force of a row at a time, between two instants, and its place in the ground; states without a motion between them have their own.
 * If only one of both instants has the force, the place is the one of that instant. */
function forceAt(row, poses, time) {
    const [low, high, part] = placeIn(forces.x, data.separate ? Math.round(time) : time), pose = poses[row.on];
    const [a, b] = [forces.at(low, row), forces.at(high, row)], force = add(scaled(1 - part, a), scaled(part, b));
    if (row.at) return [force, moved(pose, row.at)];
    const share = norm(a) === 0 ? 1 : norm(b) === 0 ? 0 : part;
    return [force, add(pose.p, add(scaled(1 - share, forces.placeAt(low, row)), scaled(share, forces.placeAt(high, row))))];
}

const forceWords = (x) => (forces.unit === "N" && x >= 1000 ? `${digits(x / 1000)} kN` : `${digits(x)} ${forces.unit}`);

/* An arrow begins at its joint, unless it would end outside of the picture: then it ends there, if that is within the picture. */
function startOf([x, y], direction, view, length) {
    const [dx, dy] = [length * dot(direction, view.right), -length * dot(direction, view.up)], inside = (a, b) => a > 0 && b > 0 && a < view.width && b < view.height;
    return !inside(x + dx, y + dy) && inside(x - dx, y - dy) ? [x - dx, y - dy] : [x, y];
}

/* The contact patch of a tyre, as wide as its section, and as long as the road cuts off from its circle. */
function contactPatches(m, poses, view, time) {
    const see = projection(m, poses, view);
    return m.discs.flatMap(({ tyre, body, at, axis, radius }) => {
        const row = forces.rows.find(({ name, label }) => name === tyre && label === "Fz");
        const [force, place] = row && !view.hidden.has(body) ? forceAt(row, poses, time) : [[0, 0, 0], [0, 0, 0]];
        if (norm(force) === 0) return [];
        const ahead = unit(cross(turned(poses[body].q, unit(axis)), force)), aside = unit(cross(force, ahead)), loaded = norm(sub(moved(poses[body], at), place));
        const long = scaled(Math.sqrt(Math.max(radius ** 2 - loaded ** 2, 0)), ahead), wide = scaled(tyreThickness({ radius }), aside);
        const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([s, r]) => see(add(place, add(scaled(s, long), scaled(r, wide)))));
        return [drawn2d("path", { d: `M${corners.join("L")}Z`, class: "patch", "data-tyre": tyre, fill: STOP_COLOUR, "fill-opacity": 0.5, stroke: STOP_COLOUR, "stroke-width": 2 })];
    });
}

/* Arrows, and one of an even size for their scale. */
function forceArrows(m, poses, view, time) {
    if (!forces || !forces.shown) return [];
    const see = projection(m, poses, view), long = (USUAL_LENGTH * Math.min(view.width, view.height)) / forces.usual, ink = softColour();
    const scale = evenLength(90 / long), words = forceWords(scale), from = [view.width - 10 - scale * long, view.height - 62];
    const legend = arrow(from, view.right, view, scale * long, ink, "", { bold: 1.5, class: "force-scale", "data-words": words });
    const drawn = forces.rows.flatMap((row) => {
        const { name, body, label, kind, shared } = row, [force, at] = forceAt(row, poses, time), size = norm(force), of = m.picture.bodies[body].of || body;
        if (view.hidden.has(body) || size < 1e-3 * forces.usual) return [];
        const from = startOf(see(at), unit(force), view, size * long);
        const draw = (colour, words, bold, more) => arrow(from, unit(force), view, size * long, colour, words, { bold, head: 1.9, ...more });
        return [...draw(styleOf("--card"), "", 3.4, {}), ...draw(namedColour(m.picture.bodies[of], of), label, 1.9, { class: "force", "data-joint": name + (label && `.${label}`), "data-kind": kind, "stroke-dasharray": shared ? "6 4" : "" })];
    });
    return [...contactPatches(m, poses, view, time), ...drawn, ...legend, label2d(words, view.width - 10, view.height - 68, "end", { fill: ink, "font-size": 11 })];
}

/* "joints, contacts and ropes" */
function kindWords() {
    const words = [...new Set(forces.rows.map(({ kind }) => kind))];
    return words.length > 1 ? `${words.slice(0, -1).join(", ")} and ${words.at(-1)}` : words[0];
}

/* A switch for them, with what they mean; null where no force is shown. */
function forceSwitch(change) {
    if (!forces || !(forces.usual > 0)) return null;
    const box = element("input"), few = forces.left_out > 0 ? ` (the ${forces.rows.length} largest)` : "";
    const dashed = forces.rows.some(({ shared }) => shared) ? ", dashed where they are not unique" : "";
    Object.assign(box, { id: "by-force", type: "checkbox", checked: forces.shown });
    box.addEventListener("change", () => {
        forces.shown = box.checked;
        change();
    });
    return element("p.switch", element("label", box, `Forces in ${kindWords()}${few}, each on the body of its colour${dashed}`));
}

function beginForces() {
    const made = forceSwitch(() => stage.redraw());
    if (made) byId("names").before(made);
}
