/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies, in the pages of models that have them: pieces of a curve, drawn with a multiple of their deformation. Their
 * places are bodies of the picture behind the model's own, `of` these. */
"use strict";

const STILL = { p: [0, 0, 0], q: [0, 0, 0, 1] };

/* The rotation a after b. */
const product = (a, b) => [...add(add(scaled(a[3], b), scaled(b[3], a)), cross(a, b)), a[3] * b[3] - dot(a, b)];

const behind = (a, b) => ({ p: moved(a, b.p), q: product(a.q, b.q) });

function rotationOf(v) {
    const angle = norm(v);
    return [...scaled(Math.sin(angle / 2) / (angle || 1), v), Math.cos(angle / 2)];
}

/* -- the deformation ---------------------------------------------------------------------------------------- */

/* Poses with the factor in place of those with the true deformation. Bodies that a place carries move and turn with it. Places
 * that are held by a loop have no deformation. */
function deform({ bodies, flexible }, poses, first, second, part) {
    const own = flexible.parents.length, count = bodies.length - own, more = flexible.factor - 1;
    flexible.read ||= { shift: shortsOf(flexible.shift.numbers), turn: shortsOf(flexible.turn.numbers) };
    const further = (key, k) => [0, 1, 2].map((c) => {
        const { middle, unit } = flexible[key], at = (frame) => flexible.read[key][3 * (frame * count + k) + c];
        return more * (middle[c] + unit * ((1 - part) * at(first) + part * at(second)));
    });
    const carried = [STILL];
    for (let b = 1; b < own; b++) {
        const rider = flexible.riders.find(({ body }) => body === b), before = carried[flexible.parents[b]];
        carried[b] = before;
        if (!rider) continue;
        const from = poses[own + rider.place].p, turn = { p: [0, 0, 0], q: rotationOf(further("turn", rider.place)) };
        carried[b] = behind(before, { p: add(sub(from, moved(turn, from)), further("shift", rider.place)), q: turn.q });
    }
    for (let k = own; k < bodies.length; k++) {
        const moves = { p: add(poses[k].p, further("shift", k - own)), q: product(rotationOf(further("turn", k - own)), poses[k].q) };
        poses[k] = behind(carried[bodies[k].of], moves);
    }
    for (let b = 1; b < own; b++) poses[b] = behind(carried[b], poses[b]);
}

/* -- drawn parts -------------------------------------------------------------------------------------------- */

const radiusOfPiece = (m) => m.thick;

/* Pieces are cylinders in the colour of their body, in place of thin rods. */
function dressPieces(m, lines) {
    m.lines.forEach((line, k) => {
        if (!line.of) return;
        lines[k].geometry.dispose();
        lines[k].geometry = barMesh([[0, 0, -0.5], [0, 0, 0.5]], radiusOfPiece(m)).geometry;
        lines[k].material = shining(bodyColour(line.of));
    });
}

/* The parts of a place, and a ball where pieces meet. */
function placeGroup(m, b) {
    const group = new THREE.Group(), colour = bodyColour(m.picture.bodies[b].of);
    for (const part of partsOf(m, b)) group.add(...MESHES[part.kind](m, part));
    group.add(ballMesh([0, 0, 0], 1.02 * radiusOfPiece(m), shining(colour)));
    return group;
}

/* A piece on the plain canvas. */
function pieceJob(m, line, poses, view, see, depth) {
    const ends = [0, 1].map((k) => moved(poses[line.body[k]], line.at[k]));
    return { depth: (depth(ends[0]) + depth(ends[1])) / 2, draw: (c) => strokeLine(c, ends.map(see), 2 * radiusOfPiece(m) * view.scale, bodyColour(line.of)) };
}

/* Places are hidden with their body. */
function hidePlaces({ bodies }, hidden) {
    bodies.forEach(({ of }, b) => {
        if (of && hidden.has(of)) hidden.add(b);
        else if (of) hidden.delete(b);
    });
}

/* -- words and the factor ----------------------------------------------------------------------------------- */

const deformationWords = ({ flexible }) => `deformation \u00d7 ${count(flexible.factor)}`;

/* The picture without places. */
const withoutPlaces = (picture) => ({ ...picture, bodies: picture.bodies.filter((body) => !body.of) });

function listed(names) {
    return names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names[names.length - 1]}`;
}

function deformationNote({ flexible }) {
    const held = flexible.held.length === 0 ? "" : `Joints in loops are where they are: of ${listed(flexible.held)} the deformation between these is multiplied.`;
    const stiff = flexible.stiff.length === 0 ? "" : `Shapes of ${listed(flexible.stiff)} are drawn without deformation.`;
    return [held, stiff].filter(Boolean).join(" ");
}

/* A slider for the factor, from 1 on, evenly in its logarithm. Paths of points follow when it is released. */
function beginDeformation(m, rebuild, draw) {
    const slider = element("input"), words = element("output"), { flexible } = m.picture, most = Math.log(Math.max(10, 5 * flexible.factor));
    const tell = () => (words.textContent = deformationWords(m.picture));
    Object.assign(slider, { id: "deformation", type: "range", min: 0, max: 1000, step: 1 });
    slider.value = String(Math.round((1000 * Math.log(flexible.factor)) / most));
    slider.setAttribute("aria-label", "Factor of the deformation");
    slider.addEventListener("input", () => {
        flexible.factor = Number(Math.exp((most * Number(slider.value)) / 1000).toPrecision(2));
        tell();
        draw();
    });
    slider.addEventListener("change", () => {
        if (!m.picture.pathless) m.paths = pathsOf(m.picture);
        rebuild();
        draw();
    });
    tell();
    byId("names").before(element("p.switch", element("label", words, slider)));
}
