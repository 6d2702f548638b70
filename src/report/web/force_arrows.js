/* SPDX-License-Identifier: BSD-3-Clause */
/* The forces in joints as arrows over the picture, on the bodies of their colours. All have one scale, in the picture's corner. */
"use strict";

/* Of the smaller side of the picture: the length of a usual force. More joints than these have arrows only by choice. */
const USUAL_LENGTH = 0.25, FEW_JOINTS = 8;
const forces = data.picture && data.picture.arrows ? readForces(data.picture.arrows) : null;

/* `usual`: what the largest force exceeds at one of twenty instants, or a quarter of the largest of all. */
function readForces(given) {
    const x = floatsOf(given.x), parts = shortsOf(given.parts), count = given.joints.length;
    const at = (k, joint) => [0, 1, 2].map((i) => (given.most / 32767) * parts[3 * (k * count + joint) + i]);
    const largest = Array.from(x, (_, k) => Math.max(...given.joints.map((_, joint) => norm(at(k, joint))))).sort((a, b) => a - b);
    const usual = Math.max(largest[Math.floor(0.95 * largest.length)] ?? 0, largest[largest.length - 1] / 4);
    const shared = data.reactions ? data.reactions.rows.filter((row) => row[data.reactions.columns.indexOf("unique")] === 0).map((row) => row[data.reactions.columns.indexOf("joint")]) : [];
    const joints = given.joints.map((joint) => ({ ...joint, shared: shared.includes(joint.name) }));
    return { ...given, joints, x, at, usual, shown: usual > 0 && count <= FEW_JOINTS };
}

/* The force in a joint at a time, between two instants; states without a motion between them have their own. */
function forceAt(joint, time) {
    const [low, high, part] = placeIn(forces.x, data.separate ? Math.round(time) : time);
    return add(scaled(1 - part, forces.at(low, joint)), scaled(part, forces.at(high, joint)));
}

const forceWords = (x) => (forces.unit === "N" && x >= 1000 ? `${digits(x / 1000)} kN` : `${digits(x)} ${forces.unit}`);

/* An arrow begins at its joint, unless it would end outside of the picture: then it ends there, if that is within the picture. */
function startOf([x, y], direction, view, length) {
    const [dx, dy] = [length * dot(direction, view.right), -length * dot(direction, view.up)], inside = (a, b) => a > 0 && b > 0 && a < view.width && b < view.height;
    return !inside(x + dx, y + dy) && inside(x - dx, y - dy) ? [x - dx, y - dy] : [x, y];
}

/* Arrows, and one of an even size for their scale. */
function forceArrows(m, poses, view, time) {
    if (!forces || !forces.shown) return [];
    const see = projection(m, poses, view), long = (USUAL_LENGTH * Math.min(view.width, view.height)) / forces.usual, ink = softColour();
    const scale = evenLength(90 / long), words = forceWords(scale), from = [view.width - 10 - scale * long, view.height - 62];
    const legend = arrow(from, view.right, view, scale * long, ink, "", { bold: 1.5, class: "force-scale", "data-words": words });
    const drawn = forces.joints.flatMap(({ name, body, at, shared }, joint) => {
        const force = forceAt(joint, time), size = norm(force), of = m.picture.bodies[body].of || body;
        if (view.hidden.has(body) || size < 1e-3 * forces.usual) return [];
        const from = startOf(see(moved(poses[body], at)), unit(force), view, size * long);
        const draw = (colour, bold, more) => arrow(from, unit(force), view, size * long, colour, "", { bold, ...more });
        return [...draw(styleOf("--card"), 4.2, {}), ...draw(bodyColour(of), 1.9, { class: "force", "data-joint": name, "stroke-dasharray": shared ? "6 4" : "" })];
    });
    return [...drawn, ...legend, label2d(words, view.width - 10, view.height - 68, "end", { fill: ink, "font-size": 11 })];
}

/* A switch for them, with what they mean. */
function beginForces() {
    if (!forces || !(forces.usual > 0)) return;
    const box = element("input"), few = forces.left_out > 0 ? ` (the ${forces.joints.length} largest)` : "";
    const dashed = forces.joints.some(({ shared }) => shared) ? ", dashed where they are not unique" : "";
    Object.assign(box, { id: "by-force", type: "checkbox", checked: forces.shown });
    box.addEventListener("change", () => {
        forces.shown = box.checked;
        stage.redraw();
    });
    byId("names").before(element("p.switch", element("label", box, `Forces in joints${few}, each on the body of its colour${dashed}`)));
}
