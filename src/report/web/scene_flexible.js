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
    takeStress(flexible, count, first, second, part);
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

/* -- stress ------------------------------------------------------------------------------------------------- */

/* From dark to light for all eyes: the colours of no and of the largest stress, evenly spaced (viridis). */
const STRESS_COLOURS = ["#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#e4e419"].map((text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16)));

function stressColour(part) {
    const at = Math.min(part, 1) * (STRESS_COLOURS.length - 1), low = Math.min(Math.floor(at), STRESS_COLOURS.length - 2);
    return `rgb(${STRESS_COLOURS[low].map((x, k) => Math.round(x + (at - low) * (STRESS_COLOURS[low + 1][k] - x))).join(",")})`;
}

/* The frames that a scale is for: a mode has one of its own, because amplitudes of modes are as one likes. */
const framesOfScale = (first, count) => (data.command === "modes" ? [first - (first % data.frames), data.frames] : [0, count]);

/* Parts of the largest stress at all places at a time; -1: none is known. */
function takeStress(flexible, count, first, second, part) {
    const { stress, read } = flexible;
    if (!stress) return;
    read.stress ||= shortsOf(stress.numbers);
    const [from, frames] = framesOfScale(first, read.stress.length / count);
    const most = ((read.most ||= {})[from] ||= read.stress.slice(from * count, (from + frames) * count).reduce((a, b) => Math.max(a, b), 1));
    stress.now = Array.from({ length: count }, (_, k) => ((1 - part) * read.stress[first * count + k] + part * read.stress[second * count + k]) / most);
}

/* The colour of a place of a flexible body, or of a piece between two of them. */
function flexibleColour({ picture }, body, places) {
    const { parents, stress } = picture.flexible;
    if (!stress?.shown) return bodyColour(body);
    const parts = places.map((b) => stress.now[b - parents.length]);
    return parts.every((x) => x >= 0) ? stressColour(parts.reduce((a, b) => a + b) / parts.length) : groundColour();
}

function stressWords(pascal) {
    const [factor, unit] = [[1e-9, "GPa"], [1e-6, "MPa"], [1e-3, "kPa"]].find(([by]) => pascal * by >= 1) || [1, "Pa"];
    return `${three(pascal * factor)} ${unit}`;
}

/* The scale of colours, over the picture. */
function stressScale({ flexible: { stress } }, ink) {
    if (!stress?.shown) return [];
    const wide = 150, cells = 30, most = data.command === "modes" ? "largest of the mode" : stressWords(stress.most);
    return [
        label2d(stress.axial.length > 0 ? "normal stress" : "bending stress", 12, 42, "start", { fill: ink, "font-size": 12 }),
        ...Array.from({ length: cells }, (_, k) => drawn2d("rect", { x: 12 + (k * wide) / cells, y: 48, width: wide / cells + 0.5, height: 9, fill: stressColour(k / (cells - 1)) })),
        label2d("0", 12, 71, "start", { fill: ink, "font-size": 11 }),
        label2d(most, 12 + wide, 71, "end", { fill: ink, "font-size": 11, id: "largest-stress" }),
    ];
}

/* A switch for colours by stress; none where no stress is known. */
function stressSwitch({ picture: { flexible: { stress } } }, draw) {
    const box = element("input");
    if (!stress) return [];
    Object.assign(box, { id: "by-stress", type: "checkbox", checked: false });
    box.addEventListener("change", () => {
        stress.shown = box.checked;
        draw();
    });
    return [element("label", box, "Colours by stress")];
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

/* Colours of pieces and of balls between them. */
function colourPieces(m, { lines, groups }) {
    m.lines.forEach((line, k) => line.of && lines[k].material.color.set(flexibleColour(m, line.of, line.body)));
    m.picture.bodies.forEach(({ of }, b) => of && groups[b].userData.ball.material.color.set(flexibleColour(m, of, [b])));
}

/* The parts of a place, and a ball where pieces meet. */
function placeGroup(m, b) {
    const group = new THREE.Group(), colour = bodyColour(m.picture.bodies[b].of);
    for (const part of partsOf(m, b)) group.add(...MESHES[part.kind](m, part));
    group.userData.ball = ballMesh([0, 0, 0], 1.02 * radiusOfPiece(m), shining(colour));
    group.add(group.userData.ball);
    return group;
}

/* A piece on the plain canvas. */
function pieceJob(m, line, poses, view, see, depth) {
    const ends = [0, 1].map((k) => moved(poses[line.body[k]], line.at[k]));
    return { depth: (depth(ends[0]) + depth(ends[1])) / 2, draw: (c) => strokeLine(c, ends.map(see), 2 * radiusOfPiece(m) * view.scale, flexibleColour(m, line.of, line.body)) };
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
    const plain = flexible.plain.length === 0 ? "" : `No colours by stress for ${listed(flexible.plain)}: the edges of the section are not known.`;
    const { axial } = flexible.stress || {}, normal = axial?.length > 0 ? `, with |N|/A for ${listed(axial)}, by axial shapes` : ", without N/A, because no beam has axial shapes";
    const coloured = axial ? `Colours by stress: that of bending at the farthest edge of a section, by the strain of the shapes${normal}.` : "";
    const held = flexible.held.length === 0 ? "" : `Joints of loops stay at their true places: of ${listed(flexible.held)} only the deformation between them is multiplied.`;
    const stiff = flexible.stiff.length === 0 ? "" : `Shapes of ${listed(flexible.stiff)} are drawn without deformation.`;
    return [held, stiff, coloured, plain].filter(Boolean).join(" ");
}

/* A slider for the factor, from 1 on, evenly in its logarithm. Paths of points follow when it is released. */
function beginDeformation(m, rebuild, draw) {
    const slider = element("input"), words = element("output"), { flexible } = m.picture, most = Math.log(Math.max(10, 5 * flexible.factor));
    const writeWords = () => (words.textContent = deformationWords(m.picture));
    Object.assign(slider, { id: "deformation", type: "range", min: 0, max: 1000, step: 1 });
    slider.value = String(Math.round((1000 * Math.log(flexible.factor)) / most));
    slider.setAttribute("aria-label", "Factor of the deformation");
    slider.addEventListener("input", () => {
        flexible.factor = Number(Math.exp((most * Number(slider.value)) / 1000).toPrecision(2));
        writeWords();
        draw();
    });
    slider.addEventListener("change", () => {
        if (!m.picture.pathless) m.paths = pathsOf(m.picture);
        rebuild();
        draw();
    });
    writeWords();
    byId("names").before(element("p.switch", element("label", words, slider), ...stressSwitch(m, draw)));
}
